"""How the gait changes as the severity of each link rises from 0 to 10 and falls again.

A link is the piece of the body between two neighbouring joints. Its label in files is a pair of joints, such
as "LeftUpLeg-LeftLeg". Readers of the page see a name such as "left thigh". `found` is the content of
injury.json.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import PositiveFloat, Section
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Cost, Measure
from hobble.measures.shown import STRIP_HEIGHT, STRIP_WIDTH, grouped, line, strip, strips, with_spoken_names
from hobble.report import parts
from hobble.runtime.options import Runtime

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
GAIT_COLOURS = {"walk": "@accent", "jog": "@g2"}
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")  # of the lines in a chart
# The marker of links that were never hurt in training.
HOLLOW = {"symbol": "circle-open", "size": 8, "line": {"width": 1.2}}
# The charts of each link at severity 10: name, key of a response, label of the axis, its least range.
EFFECTS = (
    ("injury-pose", "from_healthy_cm", "cm per joint at severity 10", 2.0),
    ("injury-speed", "speed_share", "share of the healthy speed", 1.0),
)
# The small charts of a sweep: name -> title, unit, keys of a row -> labels of the lines, from the first
# colour on.
BOTH_SIDES = {"{}_left": "left", "{}_right": "right"}
PANELS: Mapping[str, tuple[str, str, Mapping[str, str]]] = {
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


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """The charts and tables of the response to injury. Empty for a network without severities."""
    content = _parts(found, material) if found.get("applies") else []
    return parts.PageSection("injury", content, title="Injury response", order=20)


def _parts(found: Json, material: ReportMaterial) -> list[parts.SectionPart]:
    skeleton, published = material.network["skeleton"], material.published["severities"]
    found = with_spoken_names(found, skeleton)
    rows, responses, jogs, sweep = (found[k] for k in ("rows", "responses", "into_a_jog", "second_sweep"))
    untrained = {r["link"] for r in responses if not r["trained"]}

    def say(key: str, records: parts.Records) -> parts.Table:
        return parts.told_table(f"{material.name}-{key}", records, f"injury.{key.removeprefix('injury-')}")

    flat = [
        r | {f"{way}_{key}": rho for way in ("spearman", "spearman_falling") for key, rho in r[way].items()}
        for r in responses
    ]
    ranges = range_records([row for row in rows if row["link"] not in untrained], published["one_link"])
    return [
        parts.SectionPart(0, parts.ChartGroup([effect_chart(responses, *each) for each in EFFECTS])),
        parts.SectionPart(10, say("injury-responses", flat)),
        parts.SectionPart(15, strip_chart(found["strips"], skeleton)),
        parts.SectionPart(20, sweep_charts(rows, found["falling"], untrained) if rows else None),
        parts.SectionPart(25, say("injury-ranges", ranges), open=True),
        parts.SectionPart(42, second_sweep_chart(sweep, published)),
        parts.SectionPart(45, say("second-thresholds", found["second_thresholds"]), open=True),
        parts.SectionPart(51, say("second-sweep", sweep)),
        parts.SectionPart(
            60, parts.ChartGroup([divided_chart(found["divided"]), jog_chart(jogs, untrained)])
        ),
        parts.SectionPart(65, say("into-a-jog", jogs)),
        parts.SectionPart(70, say("injury", rows)),
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
    """A table with a row for each measure, and a column for each gait of each configuration with injuries.

    Empty if no configuration has a character that can be hurt.
    """
    summaries = {
        f"{entry['configuration']}, {gait}": summary
        for entry in compared["injury"]
        for gait, summary in (entry.get("summary") or {}).items()
    }
    rows = [
        {"measure": label} | {column: summary.get(key) for column, summary in summaries.items()}
        for key, label in parts.told("injury.means")["rows"].items()
    ]
    # The measurement `recognition` gives one share for each configuration. It is from walks, not from jogs.
    shares = {
        f"{e['configuration']}, walk": e["generated"]["right"]
        for e in compared["recognition"]
        if e.get("applies")
    }
    if shares:
        rows.append({"measure": parts.words("injury.recognised")} | {c: shares.get(c) for c in summaries})
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
    for (gait, link), of_link in grouped(rows, "gait", "link").items():
        record: dict[str, object] = {"gait": gait, "link": link}
        at = {row["severity"]: row for row in of_link}
        for what, key in (("pose", "from_healthy"), ("speed", "speed")):
            whole = at[10][key] - at[0][key]
            for end in ends:
                share = (at[end][key] - at[0][key]) / whole if abs(whole) > 1e-9 else None
                record[f"{what} at {end}"] = share
        records.append(record)
    return records


def _thresholds(severities: Collection[float]) -> list[dict]:
    """Dotted vertical lines."""
    return [shape for at in severities for shape in parts.reference_line(at, "")["shapes"]]


def second_sweep_chart(rows: parts.Records, published: Json) -> parts.Chart:
    """A second injury swept over a first one at 5 and at 10, with lines at the published thresholds."""
    options: dict[str, list[parts.Trace]] = {}
    layouts: dict[str, dict] = {}
    # Option -> unit, and key of a row -> label of its line.
    shows = {
        "pose": ("cm", {"from_first_cm": "from first", "from_second_cm": "from second"}),
        "speed": ("cm/s", {"speed": "speed"}),
    }
    for (first, second, severity), of_pair in grouped(rows, "first", "second", "first_severity").items():
        thresholds = _thresholds(published[f"second_over_{severity:g}"].values())
        for what, (unit, lines) in shows.items():
            option = f"{second} over {first} at {severity:g}, {what}"
            options[option] = [
                line(label, of_pair, key, colour, mode="lines+markers")
                for (key, label), colour in zip(lines.items(), COLOURS, strict=False)
            ]
            layouts[option] = {"shapes": thresholds, "yaxis": parts.axis(unit)}
        for one, colour in (("first", "@muted"), ("second", "@faint")):
            options[option].append(
                line(f"only the {one}", of_pair, f"speed_of_{one}", colour, dash="dot", width=1.4)
            )
    layout = {"xaxis": parts.axis("severity of the second injury", dtick=1), "yaxis": parts.axis("cm")}
    return parts.chart(
        "second-sweep", layout=layout, choose="Injuries", options=options, option_layouts=layouts
    )


def sweep_charts(
    rows: parts.Records, falling: parts.Records = (), untrained: Collection[str] = ()
) -> parts.ChartGroup:
    """A small chart of each measure over severity, for a chosen gait and link.

    rows, falling: the rows of injury.json with rising and with falling severity. Lines of falling severity
    are dotted. untrained: links that were never hurt in training. They come last in the menu, with a remark.
    """
    rising = grouped(sorted(rows, key=lambda row: row["link"] in untrained), "link", "gait")
    healing, charts = grouped(falling, "link", "gait"), []
    for name, (title, unit, lines) in PANELS.items():
        options: dict[str, list[parts.Trace]] = {}
        for (link, gait), of_link in rising.items():
            remark = f" ({UNTRAINED})" if link in untrained else ""
            traces = options.setdefault(f"{link}, {gait}{remark}", [])
            for (key, label), colour in zip(lines.items(), COLOURS, strict=False):
                key = key.format(name)
                traces.append(line(label, of_link, key, colour, mode="lines+markers", marker={"size": 5}))
                if back := healing.get((link, gait)):
                    dotted: dict[str, Any] = {"width": 1.3, "dash": "dot", "showlegend": False}
                    traces.append(line(f"{label}, healing", back, key, colour, **dotted))
        layout = {
            "xaxis": parts.axis("severity", dtick=2, range=[-0.3, 10.3]),
            "yaxis": parts.axis(unit, rangemode="normal" if name == "lean" else "tozero"),
            "showlegend": len(lines) > 1,
            "shapes": _thresholds((3.5, 6.5)) if name in ("pose", "speed") else [],
        }
        charts.append(parts.Chart(f"sweep-{name}", title, "", layout=layout, height=230, options=options))
    caption = parts.words("sweeps.caption", "sweeps.falling", *(["sweeps.untrained"] if untrained else []))
    return parts.ChartGroup(charts, "sweeps", parts.words("sweeps.title"), caption, "Link and gait")


def effect_chart(
    responses: parts.Records, name: str, key: str, label: str, least_range: float
) -> parts.Chart:
    """A chart of each link at severity 10, with a dot for each gait: one of EFFECTS.

    Links that were hurt in training are at the top.
    """
    from_top = sorted(responses, key=lambda r: not r["trained"])
    links = list(dict.fromkeys(r["link"] for r in from_top))[::-1]  # plotly counts from below
    known = [r for r in responses[::-1] if r[key] is not None]
    dots, traces = grouped(known, "gait", "trained"), []
    for (gait, colour), hurt in product(GAIT_COLOURS.items(), (True, False)):
        if rows := dots.get((gait, hurt)):
            marker = {**({"size": 9} if hurt else HOLLOW), "color": colour}
            hover = {"hovertemplate": "%{y}: %{x:.2f}<extra>%{fullData.name}</extra>"}
            title = gait if hurt else f"{gait}, {UNTRAINED}"
            x, y = [r[key] for r in rows], [r["link"] for r in rows]
            traces.append(parts.marker_trace(title, x, y, marker, **hover))
    furthest = max((r[key] for r in known), default=0.0)
    layout = {
        "xaxis": parts.axis(label, range=[0, 1.08 * max(least_range, furthest)]),
        "yaxis": parts.ordered_axis(links, type="category"),
    }
    more = ["hollow"] if any(not r["trained"] for r in responses) else []
    return parts.chart(name, traces, layout, 150 + 21 * len(links), more=more)


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


def jog_chart(rows: parts.Records, untrained: Collection[str] = ()) -> parts.Chart:
    """A jog after a hurt walk: how much of the injury shows, and the speed, with a line for each link.

    rows: `into_a_jog` of injury.json. untrained: links that were never hurt in training. They share one line.
    """
    of_links = grouped([row for row in rows if row["link"]], "link")
    hurt = [link for link in of_links if link not in untrained]
    options: dict[str, list[parts.Trace]] = {}
    for option, key in (("pose, cm per joint", "jog_from_healthy_cm"), ("speed, cm/s", "jog_speed")):
        traces = []
        for i, link in enumerate(hurt):
            dash, colour = "solid" if i < len(COLOURS) else "dash", COLOURS[i % len(COLOURS)]
            traces.append(line(link, of_links[link], key, colour, dash=dash, mode="lines+markers", width=1.4))
        without = [row[key] for row in rows if row["link"] in untrained and row.get(key) is not None]
        if without:
            mean = [float(np.mean(without))] * 2
            traces.append(parts.line_trace(UNTRAINED, [1, 10], mean, "@muted", dash="dot", width=1.4))
        options |= {option: traces} if traces else {}
    layout = {
        "xaxis": parts.axis("severity", dtick=1),
        "yaxis": {"rangemode": "tozero"},
        "showlegend": True,
        "shapes": _thresholds((3.5, 7.5)),
    }
    more = ["untrained"] if untrained else []
    return parts.chart("into-a-jog", layout=layout, height=420, choose="Shown", options=options, more=more)


def hints(found: Json, material: ReportMaterial) -> Iterator[parts.Hint]:
    """Whether and how much each hurt link changes the walk, and whether the walk recovers.

    Only links that were hurt in training are judged. Their changes are compared with the drift of a healthy
    walk, which is how much a walk changes with the severity of a link that was never hurt in training.
    """
    found = with_spoken_names(found, material.network["skeleton"])
    responses = [r for r in found.get("responses") or () if r["gait"] == "walk"]
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
