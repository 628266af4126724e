"""How the gait changes as the severity of each link rises from 0 to 10.

A link is the piece of the body between two neighbouring joints. Its label in files is a pair of joints, such
as "LeftUpLeg-LeftLeg". Readers of the page see a name such as "left thigh". `found` is the content of
injury.json.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import PositiveFloat, Section
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Cost, Measure, flatten
from hobble.measures.shown import STRIP_HEIGHT, STRIP_WIDTH, grouped, line, strip, strips, with_spoken_names
from hobble.report import parts
from hobble.runtime import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(Section):
    """The keys of this measurement in the section `evaluation`."""

    # 3 s are enough. With 4 s, the mean effects on pose and speed differ by only 1 % (configuration `limp`).
    seconds: PositiveFloat = Field(3.0, description="seconds that a figure walks at each severity")


MEASURE = Measure(
    name="injury",
    module=__name__,
    inputs=("weights",),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    channel="injury",
    cost=Cost(memory_mb=600, least_minutes=60),
)
UNTRAINED = "never hurt in training"
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")  # of the lines in a chart
# Groups of small charts: name -> title, unit, keys of a row -> labels of the lines, from the first colour on.
Panels = Mapping[str, tuple[str, str, Mapping[str, str]]]
BOTH_SIDES = {"{}_left": "left", "{}_right": "right"}
SWEEPS: Panels = {
    "pose": ("Pose", "cm", {"from_healthy": "from healthy", "from_worst": "from severity 10"}),
    "speed": ("Speed", "cm/s", {"speed": "speed"}),
    "stance": ("Time on each foot", "share", BOTH_SIDES),
    "step": ("Step length", "cm", BOTH_SIDES),
    "knee": ("Range of the knee", "degrees", BOTH_SIDES),
    "arm": ("Swing of the arm", "degrees", BOTH_SIDES),
    "lean": ("Lean of the trunk", "degrees", {"lean_forward": "forward", "lean_left": "to the left"}),
    "hip": ("Height of the hips", "cm", {"hip_height": "hips"}),
    "rough": ("Largest acceleration of a joint", "cm per frame²", {"largest_acceleration": "joint"}),
}
SECOND_SWEEP: Panels = {
    "pose": ("Pose", "cm", {"from_first_cm": "from first", "from_second_cm": "from second"}),
    "speed": (
        "Speed",
        "cm/s",
        {"speed": "both", "speed_of_first": "only the first", "speed_of_second": "only the second"},
    ),
}
INTO_A_JOG: Panels = {
    "pose": ("Pose", "cm", {"jog_from_healthy_cm": "of the jog", "walk_from_healthy_cm": "of the walk"}),
    "speed": ("Speed", "cm/s", {"jog_speed": "of the jog", "walk_speed": "of the walk"}),
}


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """The charts and tables of the response to injury. Empty for a network without severities."""
    content = _parts(found, material) if found.get("applies") else []
    return parts.PageSection("injury", content, title="Injury response", order=20)


def _parts(found: Json, material: ReportMaterial) -> list[parts.SectionPart]:
    skeleton, published = material.network["skeleton"], material.published["severities"]
    found = with_spoken_names(found, skeleton)
    rows, responses = found["rows"], found["responses"]
    untrained = {r["link"] for r in responses if not r["trained"]}
    of_links = grouped(sorted(rows, key=lambda row: row["link"] in untrained), "link")
    swept = {
        link + (f" ({UNTRAINED})" if link in untrained else ""): (of_link, (3.5, 6.5))
        for link, of_link in of_links.items()
    }
    of_pairs = grouped(found["second_sweep"], "first", "second", "first_severity")
    pairs = {
        f"{second} over {first} at {at:g}": (of_pair, published[f"second_over_{at:g}"].values())
        for (first, second, at), of_pair in of_pairs.items()
    }
    of_jogs = grouped([row for row in found["into_a_jog"] if row["link"]], "link")
    jogs = {link: (of_link, (3.5, 7.5)) for link, of_link in of_jogs.items()}
    more = ["untrained"] if untrained else []

    def say(key: str, records: parts.Records) -> parts.Table:
        return parts.told_table(f"{material.name}-{key}", records, f"injury.{key.removeprefix('injury-')}")

    ranges = range_records([row for row in rows if row["link"] not in untrained], published["one_link"])
    return [
        parts.SectionPart(
            0,
            say(
                "injury-responses",
                [flatten(row) for row in sorted(responses, key=lambda r: not r["trained"])],
            ),
            open=True,
        ),
        parts.SectionPart(15, strip_chart(found["strips"], skeleton)),
        parts.SectionPart(20, panels("sweeps", SWEEPS, swept, "Link", more) if swept else None),
        parts.SectionPart(25, say("injury-ranges", ranges), open=True),
        parts.SectionPart(42, panels("second-sweep", SECOND_SWEEP, pairs, "Injuries") if pairs else None),
        parts.SectionPart(45, say("second-thresholds", found["second_thresholds"]), open=True),
        parts.SectionPart(60, divided_chart(found["divided"])),
        parts.SectionPart(65, panels("into-a-jog", INTO_A_JOG, jogs, "Link") if jogs else None),
    ]


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """Whether the character of each configuration can be hurt, and means over the links hurt in training."""
    entries = []
    for results in all_measured:
        found = results.results_of("injury")
        kept = {key: found[key] for key in ("applies", "reason", "summary") if key in found}
        entries.append({"configuration": results.name, **kept})
    return ComparisonAddition(entries=entries)


def compared_section(compared: parts.Compared) -> parts.PageSection:
    """A table with a row for each measure, and a column for each configuration with injuries.

    Empty if no configuration has a character that can be hurt.
    """
    summaries = {e["configuration"]: e["summary"] for e in compared["injury"] if e.get("summary")}
    rows = [
        {"measure": label} | {column: summary.get(key) for column, summary in summaries.items()}
        for key, label in parts.told("injury.means")["rows"].items()
    ]
    means = parts.table("compare-injury", rows, title=parts.told("injury.means")["title"])
    content = [
        parts.SectionPart(0, parts.Paragraph(parts.words("injury.introduction"))),
        parts.SectionPart(10, means, open=True),
    ]
    return parts.PageSection("injury", content if summaries else [], title="Injury response", order=20)


def strip_chart(found: parts.Records, skeleton: Json) -> parts.Chart:
    """Poses at rising severity, from the side and from the front: Figures 3 and 4 of Ferre et al. (2019)."""
    options: dict[str, list[parts.Trace]] = {}
    for one in found:
        first = f"{one['first']} at {one['first_severity']:g}, and " if one["first"] else ""
        poses, severities = np.array(one["poses"]), one["severities"]
        texts = [(f"{severity:g}", STRIP_WIDTH * n, -14.0) for n, severity in enumerate(severities)]
        options[first + one["link"]] = [
            *strip(skeleton, poses, "@accent", texts),
            *strip(skeleton, poses, "@accent", view="front", up=STRIP_HEIGHT),
        ]
    return strips("strips", options, 520, "Injury", below="severity")


def range_records(rows: parts.Records, ranges: Json) -> list[dict[str, object]]:
    """Shares of the whole change of pose and speed that walks have at the ends of the published ranges.

    rows: of injury.json. ranges: `severities.one_link` of published.yaml.
    """
    ends = [high for _, high in (ranges["little"], ranges["changing"])] + [ranges["as_trained"][0]]
    records = []
    for link, of_link in grouped(rows, "link").items():
        record: dict[str, object] = {"link": link}
        at = {row["severity"]: row for row in of_link}
        for what, key in (("pose", "from_healthy"), ("speed", "speed")):
            whole = at[10][key] - at[0][key]
            for end in ends:
                share = (at[end][key] - at[0][key]) / whole if abs(whole) > 1e-9 else None
                record[f"{what} at {end}"] = share
        records.append(record)
    return records


def panels(
    name: str,
    charts: Panels,
    options: Mapping[str, tuple[parts.Records, Collection[float]]],
    choose: str,
    more: Sequence[str] = (),
) -> parts.ChartGroup:
    """A group of small charts over severity. captions.yaml has its title and caption under its `name`.

    options: text in the menu -> the rows to show, and severities of published thresholds. These are dotted
    lines in the charts of pose and speed. choose: the menu's label. more: see `parts.chart`.
    """
    drawn = []
    for panel, (title, unit, lines) in charts.items():
        traces = {
            option: [
                line(label, rows, key.format(panel), colour, mode="lines+markers", marker={"size": 5})
                for (key, label), colour in zip(lines.items(), COLOURS, strict=False)
            ]
            for option, (rows, _) in options.items()
        }
        shapes = {
            option: {"shapes": [s for at in limits for s in parts.reference_line(at, "")["shapes"]]}
            for option, (_, limits) in options.items()
            if panel in ("pose", "speed")
        }
        layout = {
            "xaxis": parts.axis("severity", dtick=2, range=[-0.3, 10.3]),
            "yaxis": parts.axis(unit, rangemode="normal" if panel == "lean" else "tozero"),
            "showlegend": len(lines) > 1,
        }
        chart = parts.Chart(f"{name}-{panel}", title, "", (), layout, 230, None, traces, shapes)
        drawn.append(chart)
    caption = parts.words(*(f"{name}.{key}" for key in ("caption", *more)))
    return parts.ChartGroup(drawn, name, parts.words(f"{name}.title"), caption, choose)


def divided_chart(rows: parts.Records) -> parts.Chart:
    """How far the walk with one link hurt is from the healthy walk, with a line for each divisor.

    A menu selects the link, or a dot for each link. rows: `divided` of injury.json.
    """
    options: dict[str, list[parts.Trace]] = {}
    smooth, dots = "smoothness against range", []
    for (scale, of_scale), colour in zip(grouped(rows, "scale").items(), COLOURS, strict=False):
        label, links = f"divided by {scale:g}", grouped(of_scale, "link")
        for link, of_line in links.items():
            trace = line(label, of_line, "from_healthy_cm", colour, mode="lines+markers")
            options.setdefault(link, []).append(trace)
        x, y = (
            [max(row[key] for row in of_link) for of_link in links.values()]
            for key in ("from_healthy_cm", "largest_acceleration")
        )
        hover = {"text": [*links], "hovertemplate": "%{text}: %{x:.1f} cm, %{y:.2f}<extra></extra>"}
        dots.append(parts.marker_trace(label, x, y, {"size": 9, "color": colour}, **hover))
    options |= {smooth: dots} if dots else {}
    axes = {
        "xaxis": parts.axis("largest change of the pose, cm"),
        "yaxis": parts.axis("largest acceleration, cm/frame²"),
    }
    layout = {
        "xaxis": parts.axis("severity", dtick=2),
        "yaxis": parts.axis("cm per joint", rangemode="tozero"),
    }
    return parts.chart(
        "divided", layout=layout, choose="Link", options=options, option_layouts={smooth: axes}
    )


def hints(found: Json, material: ReportMaterial) -> Iterator[parts.Hint]:
    """Whether and how much each hurt link changes the walk, and whether the walk recovers.

    Only links that were hurt in training are judged. Their changes are compared with the drift of a healthy
    walk, which is how much a walk changes with the severity of a link that was never hurt in training.
    """
    found = with_spoken_names(found, material.network["skeleton"])
    responses = found.get("responses") or ()
    trained = [r for r in responses if r["trained"]]
    if not trained:
        return

    def drift(key: str) -> float:
        return float(np.mean([r[key] for r in responses if not r["trained"]] or [0.0]))

    def named(links: Sequence[str]) -> str:
        return ", ".join(links[:4]) + (" …" if len(links) > 4 else "")

    limit = drift("from_healthy_cm")
    if limit > 2:
        yield parts.hint("injury.drifts", cm=parts.format_number(limit))
    unchanged = [r["link"] for r in trained if r["from_healthy_cm"] < max(0.5, 2 * limit)]
    if unchanged:
        yield parts.hint("injury.unchanged", count=len(unchanged), of=len(trained), links=named(unchanged))
    at_end = max(2, 2 * drift("after_healing_cm"))
    sick = [r["link"] for r in trained if r["link"] not in unchanged and r["after_healing_cm"] > at_end]
    if sick:
        yield parts.hint("injury.lasting", links=named(sick))
    if not unchanged:
        low, high = (parts.format_number(f(r["from_healthy_cm"] for r in trained)) for f in (min, max))
        cm = low if low == high else f"{low} to {high}"
        yield parts.hint("injury.changed", trained=len(trained), of=len(responses), cm=cm)
