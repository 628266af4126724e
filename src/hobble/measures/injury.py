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

from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.core.section import PositiveFloat, Section
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Cost, Measure
from hobble.measures.shown import (
    BARE,
    STRIP_HEIGHT,
    STRIP_WIDTH,
    Records,
    chart,
    stick_figures,
    strip_texts,
    table,
    words,
)
from hobble.report.parts import (
    Chart,
    ChartGroup,
    ChartPair,
    Column,
    Compared,
    Hint,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    Trace,
    axis,
    format_number,
    line_trace,
    marker_trace,
    ordered_axis,
    reference_line,
    with_order,
)
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
Rows = Sequence[Mapping[str, Any]]  # rows of injury.json
LINK_KEYS = ("link", "first", "second")  # keys whose values are labels of links
UNTRAINED = "never hurt in training"
GAIT_COLOURS = {"walk": "@accent", "jog": "@g2"}
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")  # of the lines in a chart
# The marker of links that were never hurt in training.
HOLLOW = {"symbol": "circle-open", "size": 8, "line": {"width": 1.2}}
SIDES = (("left", "@accent"), ("right", "@g2"))  # side of the body, colour
# A small chart: its name, title and unit; its lines as (key of a row, label, colour).
Panel = tuple[str, str, str, Sequence[tuple[str, str, str]]]


def _both_sides(key: str) -> list[tuple[str, str, str]]:
    return [(f"{key}_{side}", side, colour) for side, colour in SIDES]


POSE = [("from_healthy", "from healthy", "@accent"), ("from_worst", "from severity 10", "@muted")]
LEAN = [("lean_forward", "forward", "@accent"), ("lean_left", "to the left", "@g2")]
PANELS: tuple[Panel, ...] = (
    ("pose", "Pose", "cm", POSE),
    ("speed", "Speed", "cm/s", [("speed", "speed", "@accent")]),
    ("stance", "Time on each foot", "share", _both_sides("stance")),
    ("step", "Step length", "cm", _both_sides("step")),
    ("knee", "Range of the knee", "degrees", _both_sides("knee")),
    ("arm", "Swing of the arm", "degrees", _both_sides("arm")),
    ("lean", "Lean of the trunk", "degrees", LEAN),
    ("hip", "Height of the hips", "cm", [("hip_height", "hips", "@accent")]),
    (
        "rough",
        "Largest acceleration of a joint",
        "cm per frame²",
        [("largest_acceleration", "joint", "@accent")],
    ),
)
# Columns of the table of responses: label, and how the value is found in a response.
RESPONSE_COLUMNS = {
    "from_healthy_cm": "change of the pose, cm",
    "speed_share": "share of the healthy speed",
    "settle_seconds": "time to settle, s",
    "heal_seconds": "time to heal, s",
    "after_healing_cm": "change left after healing, cm",
    "hysteresis_cm": "difference between rising and falling severity, cm",
    "acceleration_share": "largest acceleration, divided by the healthy walk's",
    "spearman_from_healthy": "ρ of pose",
    "spearman_speed": "ρ of speed",
}
# Key of a summary -> label of its row in the comparison.
ROW_LABELS = {
    "from_healthy_cm": "distance from the healthy walk at severity 10, cm per joint",
    "speed_share": "share of the healthy speed at severity 10",
    "spearman_from_healthy": "ρ of pose and severity",
    "spearman_speed": "ρ of speed and severity",
    "spearman_falling_from_healthy": "ρ of pose and severity, while severity falls",
    "settle_seconds": "time to settle, s",
    "heal_seconds": "time to heal, s",
    "after_healing_cm": "remaining distance after healing, cm per joint",
    "hysteresis_cm": "difference between rising and falling severity, cm per joint",
    "acceleration_share": "largest acceleration, divided by the healthy walk's",
}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The charts and tables of the response to injury. Empty for a network without severities."""
    parts = _parts(with_spoken_links(found, material), material) if found.get("applies") else []
    return PageSection("injury", parts, title="Injury response", order=20)


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Sentences about the response, for the top of the report."""
    return with_order(50, injury_hints(with_spoken_links(found, material)))


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """Whether the character of each configuration can be hurt, and means over the links hurt in training."""
    entries = []
    for results in all_measured:
        found = results.results_of("injury")
        kept = {key: found[key] for key in ("applies", "reason", "summary") if key in found}
        entries.append({"configuration": results.name, **kept})
    return ComparisonAddition(entries=entries)


def compared_section(compared: Compared) -> PageSection:
    """A table of means. It is empty if no configuration has a character that can be hurt."""
    means = injury_table(compared)
    introduction = Paragraph(words("injury.introduction")) if means else None
    parts = [SectionPart(0, introduction), SectionPart(10, means, open=True, short=True)]
    return PageSection("injury", parts, title="Injury response", order=20)


def injury_table(compared: Compared) -> Table | None:
    """A row for each measure, and a column for each gait of each configuration with injuries.

    None if no configuration has injuries. compared: the content of compare.json.
    """
    # One item for each column of numbers: configuration, gait, and the summary from injury.json.
    summaries = [
        (entry["configuration"], gait, summary)
        for entry in compared["injury"]
        if entry.get("applies")
        for gait, summary in (entry.get("summary") or {}).items()
    ]
    if not summaries:
        return None
    columns = [f"{name}, {gait}" for name, gait, _ in summaries]
    found = {key for *_, summary in summaries for key in summary}
    rows = [
        {"measure": ROW_LABELS.get(key, key.replace("_", " "))}
        | {column: summary.get(key) for column, (*_, summary) in zip(columns, summaries, strict=True)}
        for key in [*(key for key in ROW_LABELS if key in found), *sorted(found - set(ROW_LABELS))]
    ]
    # The measurement `recognition` gives one share for each configuration. It is from walks, not from jogs.
    shares = {
        f"{e['configuration']}, walk": e["generated"]["right"]
        for e in compared["recognition"]
        if e.get("applies")
    }
    if shares:
        rows.append({"measure": words("injury.recognised")} | {c: shares.get(c) for c in columns})
    return table("compare-injury", rows, title=words("injury.means"))


def with_spoken_links(found: Json, material: ReportMaterial) -> dict[str, Any]:
    """`found` with names such as "left thigh" in place of the labels of links.

    found: the JSON of a measurement, such as injury.json.
    """
    shown_name = shown_names(material.network["skeleton"])

    def renamed(value: Any, key: str = "") -> Any:
        """`value` with its links renamed. key: the key under which it stands, "" for an item of a list."""
        if isinstance(value, Mapping):
            return {k: renamed(v, k) for k, v in value.items()}
        if isinstance(value, list | tuple):
            return [renamed(item) for item in value]
        return shown_name(value) if key in LINK_KEYS and isinstance(value, str) else value

    return {key: renamed(value) for key, value in found.items()}


def _parts(found: Json, material: ReportMaterial) -> list[SectionPart]:
    """The parts of the section. found: injury.json, with links renamed."""
    name, published = material.name, material.published["severities"]
    rows, responses, jogs, sweep = (found[k] for k in ("rows", "responses", "into_a_jog", "second_sweep"))
    untrained = {r["link"] for r in responses if not r["trained"]}

    def all_of(key: str, records: Records) -> Table:
        return table(f"{name}-{key}", records, title=words(f"injury.{key}"))

    thresholds = all_of("second-thresholds", found["second_thresholds"])
    charts = [divided_chart(found["divided"]), jog_chart(jogs, untrained)]
    return [
        SectionPart(0, ChartPair(effect_charts(responses))),
        SectionPart(10, response_table(name, responses)),
        SectionPart(15, strip_chart(found["strips"], material.network["skeleton"])),
        SectionPart(20, sweep_charts(rows, found["falling"], untrained) if rows else None),
        SectionPart(25, range_table(name, rows, untrained, published["one_link"]), open=True, short=True),
        SectionPart(42, sweep_chart(sweep, published)),
        SectionPart(45, thresholds, open=True, short=True),
        SectionPart(51, all_of("second-sweep", sweep)),
        SectionPart(60, ChartPair(charts)),
        SectionPart(65, all_of("into-a-jog", jogs)),
        SectionPart(70, all_of("injury", rows)),
    ]


def strip_chart(strips: Rows, skeleton: Json) -> Chart | None:
    """Poses at rising severity, from the side and from the front: Figures 3 and 4 of Ferre et al. (2019)."""
    if not strips:
        return None
    options: dict[str, list[Trace]] = {}
    for strip in strips:
        first = f"{strip['first']} at {strip['first_severity']:g}, and " if strip["first"] else ""
        places = [(STRIP_WIDTH * n, -14.0) for n in range(len(strip["poses"]))]
        poses = np.array(strip["poses"])
        options[first + strip["link"]] = [
            stick_figures(skeleton, poses, "@accent"),
            stick_figures(skeleton, poses, "@accent", "front", STRIP_HEIGHT),
            strip_texts([f"{severity:g}" for severity in strip["severities"]], places),
        ]
    layout = {"xaxis": {**BARE, "title": {"text": "severity"}}, "yaxis": {**BARE, "scaleanchor": "x"}}
    return chart("strips", layout=layout, height=520, choose="Injury", options=options)


def range_table(name: str, rows: Rows, untrained: Collection[str], ranges: Json) -> Table | None:
    """Shares of the whole change of pose and speed that walks have at the ends of the published ranges.

    rows: of injury.json. ranges: `severities.one_link` of published.yaml.
    """
    sweeps: dict[tuple[str, str], dict[float, Any]] = {}
    for row in rows:
        if row["link"] not in untrained:
            sweeps.setdefault((row["gait"], row["link"]), {})[row["severity"]] = row
    ends = [high for _, high in (ranges["little"], ranges["changing"])] + [ranges["as_trained"][0]]

    def shares(sweep: Mapping[float, Any], key: str) -> list[float | None]:
        healthy, worst = sweep[0][key], sweep[10][key]
        whole = worst - healthy
        return [(sweep[end][key] - healthy) / whole if abs(whole) > 1e-9 else None for end in ends]

    shown = [
        [gait, link, *shares(sweep, "from_healthy"), *shares(sweep, "speed")]
        for (gait, link), sweep in sweeps.items()
        if {0, 10, *ends} <= set(sweep)
    ]
    columns = [Column("gait"), Column("link")]
    columns += [Column.number(f"{what} at {end}", 2) for what in ("pose", "speed") for end in ends]
    return Table(f"{name}-injury-ranges", columns, shown, words("injury.ranges")) if shown else None


def sweep_chart(rows: Rows, published: Json) -> Chart | None:
    """A second injury swept over a first one at 5 and at 10, with lines at the published thresholds."""
    options: dict[str, list[Trace]] = {}
    layouts: dict[str, dict[str, Any]] = {}
    lines = {5.0: published["second_over_5"].values(), 10.0: published["second_over_10"].values()}
    keys = (("from_first_cm", "cm"), ("from_second_cm", "cm"), ("speed", "cm/s"))
    for first, second, severity in dict.fromkeys(
        (r["first"], r["second"], r["first_severity"]) for r in rows
    ):
        labels = {"first": first, "second": second, "first_severity": severity}
        of_pair = [row for row in rows if labels.items() <= row.items()]
        for label, shown in (("pose", keys[:2]), ("speed", keys[2:])):
            option = f"{second} over {first} at {severity:g}, {label}"
            options[option] = [
                _line(key.removesuffix("_cm").replace("_", " "), of_pair, key, colour, mode="lines+markers")
                for (key, _), colour in zip(shown, COLOURS, strict=False)
            ]
            if label == "speed":
                for key, colour in (("speed_of_first", "@muted"), ("speed_of_second", "@faint")):
                    words = key.replace("speed_of_", "only the ")
                    options[option].append(_line(words, of_pair, key, colour, dash="dot", width=1.4))
            layouts[option] = {"shapes": [_threshold(x) for x in lines[severity]], "yaxis": axis(shown[0][1])}
    if not options:
        return None
    layout = {"xaxis": axis("severity of the second injury", dtick=1), "yaxis": axis("cm")}
    return chart("second-sweep", layout=layout, choose="Injuries", options=options, option_layouts=layouts)


def _threshold(severity: float) -> dict[str, Any]:
    """A dotted vertical line."""
    (shape,) = reference_line(severity, "")["shapes"]
    return shape


def sweep_charts(rows: Rows, falling: Rows = (), untrained: Collection[str] = ()) -> ChartGroup:
    """A small chart of each measure over severity, for a chosen gait and link.

    rows, falling: the rows of injury.json with rising and with falling severity. Lines of falling severity
    are dotted. untrained: links that were never hurt in training. They come last in the menu, with a remark.
    """

    def by_option(of_links: Rows) -> dict[str, list[Mapping[str, Any]]]:
        """Option of the menu -> its rows."""
        out: dict[str, list[Mapping[str, Any]]] = {}
        for row in of_links:
            remark = f" ({UNTRAINED})" if row["link"] in untrained else ""
            out.setdefault(f"{row['link']}, {row['gait']}{remark}", []).append(row)
        return out

    rising_rows = by_option(sorted(rows, key=lambda row: row["link"] in untrained))
    falling_rows, charts = by_option(falling), []
    for name, title, unit, lines in PANELS:
        options: dict[str, list[Trace]] = {}
        for option, rising in rising_rows.items():
            options[option] = [
                _line(label, rising, key, colour, mode="lines+markers") | {"marker": {"size": 5}}
                for key, label, colour in lines
            ] + [
                _line(f"{label}, healing", healing, key, colour, width=1.3, dash="dot", showlegend=False)
                for key, label, colour in lines
                if (healing := falling_rows.get(option))
            ]
        layout = {
            "xaxis": axis("severity", dtick=2, range=[-0.3, 10.3]),
            "yaxis": axis(unit, rangemode="normal" if name == "lean" else "tozero"),
            "showlegend": len(lines) > 1,
            "shapes": [_threshold(x) for x in (3.5, 6.5)] if name in ("pose", "speed") else [],
        }
        charts.append(Chart(f"sweep-{name}", title, "", layout=layout, height=230, options=options))
    caption = words("sweeps.caption", "sweeps.falling", *(["sweeps.untrained"] if untrained else []))
    return ChartGroup("sweeps", words("sweeps.title"), caption, charts, "Link and gait")


def _line(label: str, rows: Rows, key: str, colour: str, **more: Any) -> Trace:
    """A line of the values `key` over severity."""
    x, y = [row["severity"] for row in rows], [row.get(key) for row in rows]
    return line_trace(label, x, y, colour, **more)


def effect_charts(responses: Rows) -> list[Chart]:
    """Two charts of each link at severity 10: the change of the pose, and the remaining speed.

    A dot for each link and gait. Links that were hurt in training are at the top.
    """
    more = ["hollow"] if any(not r["trained"] for r in responses) else []
    from_top = sorted(responses, key=lambda r: not r["trained"])
    links = list(dict.fromkeys(r["link"] for r in from_top))[::-1]  # plotly counts from below
    charts = []
    for name, key, label, least_range in (
        ("injury-pose", "from_healthy_cm", "cm per joint at severity 10", 2.0),
        ("injury-speed", "speed_share", "share of the healthy speed", 1.0),
    ):
        known = [r for r in responses[::-1] if r[key] is not None]
        traces: list[Trace] = []
        for (gait, colour), hurt in product(GAIT_COLOURS.items(), (True, False)):
            if dots := [r for r in known if r["gait"] == gait and r["trained"] is hurt]:
                marker = {"size": 9} if hurt else HOLLOW
                x, y = [r[key] for r in dots], [r["link"] for r in dots]
                hover = {"hovertemplate": "%{y}: %{x:.2f}<extra>%{fullData.name}</extra>"}
                title = gait if hurt else f"{gait}, {UNTRAINED}"
                traces.append(marker_trace(title, x, y, {**marker, "color": colour}, **hover))
        furthest = max((r[key] for r in known), default=0.0)
        layout = {
            "xaxis": axis(label, range=[0, 1.08 * max(least_range, furthest)]),
            "yaxis": ordered_axis(links, type="category"),
        }
        if traces:
            charts.append(chart(name, traces, layout, 150 + 21 * len(links), more=more))
    return charts


def response_table(name: str, responses: Rows) -> Table:
    """A row for each gait and link. name: of the configuration."""
    records = [{**r, **{f"spearman_{key}": rho for key, rho in r["spearman"].items()}} for r in responses]
    heads = {"gait": "gait", "link": "link", "trained": "in training", **RESPONSE_COLUMNS}
    show = {"trained": lambda hurt: "hurt" if hurt else "never hurt"}
    return table(f"{name}-injury-responses", records, heads, words("injury.responses"), show)


def divided_chart(rows: Rows) -> Chart | None:
    """How far the walk with one link hurt is from the healthy walk, with a line for each divisor.

    A menu selects the link. rows: `divided` of injury.json. None if it is empty.
    """
    if not rows:
        return None
    scales = sorted({row["scale"] for row in rows})

    def line(link: str, scale: float, colour: str) -> Trace:
        of_line = [row for row in rows if row["link"] == link and row["scale"] == scale]
        return _line(f"divided by {scale:g}", of_line, "from_healthy_cm", colour, mode="lines+markers")

    links = list(dict.fromkeys(row["link"] for row in rows))
    options = {
        link: [line(link, scale, colour) for scale, colour in zip(scales, COLOURS, strict=False)]
        for link in links
    }
    smooth = "smoothness against range"
    options[smooth] = []
    for scale, colour in zip(scales, COLOURS, strict=False):
        x, y = (
            [max(row[key] for row in rows if (row["link"], row["scale"]) == (link, scale)) for link in links]
            for key in ("from_healthy_cm", "largest_acceleration")
        )
        hover = {"text": links, "hovertemplate": "%{text}: %{x:.1f} cm, %{y:.2f}<extra></extra>"}
        dots = {"size": 9, "color": colour}
        options[smooth].append(marker_trace(f"divided by {scale:g}", x, y, dots, **hover))
    axes = ("largest change of the pose, cm", "largest acceleration, cm/frame²")
    layouts = {smooth: dict(zip(("xaxis", "yaxis"), map(axis, axes), strict=True))}
    layout = {"xaxis": axis("severity", dtick=2), "yaxis": axis("cm per joint", rangemode="tozero")}
    return chart("divided", layout=layout, choose="Link", options=options, option_layouts=layouts)


def jog_chart(rows: Rows, untrained: Collection[str] = ()) -> Chart | None:
    """A jog after a hurt walk: how much of the injury shows, and the speed, with a line for each link.

    rows: `into_a_jog` of injury.json. untrained: links that were never hurt in training. They share one line.
    None if there is nothing to show.
    """
    hurt = [link for link in dict.fromkeys(row["link"] for row in rows) if link and link not in untrained]
    options: dict[str, list[Trace]] = {}
    for option, key in (("pose, cm per joint", "jog_from_healthy_cm"), ("speed, cm/s", "jog_speed")):
        options[option] = []
        for i, link in enumerate(hurt):
            of_link = [row for row in rows if row["link"] == link]
            dash, colour = "solid" if i < len(COLOURS) else "dash", COLOURS[i % len(COLOURS)]
            options[option].append(
                _line(link, of_link, key, colour, dash=dash, mode="lines+markers", width=1.4)
            )
        without = [row[key] for row in rows if row["link"] in untrained and row.get(key) is not None]
        if without:
            mean = [float(np.mean(without))] * 2
            options[option].append(line_trace(UNTRAINED, [1, 10], mean, "@muted", dash="dot", width=1.4))
    if not any(options.values()):
        return None
    layout = {
        "xaxis": axis("severity", dtick=1),
        "yaxis": {"rangemode": "tozero"},
        "showlegend": True,
        "shapes": [_threshold(x) for x in (3.5, 7.5)],
    }
    more = ["untrained"] if untrained else []
    return chart("into-a-jog", layout=layout, height=420, choose="Shown", options=options, more=more)


def injury_hints(found: Json) -> Iterator[Hint]:
    """Whether and how much each hurt link changes the walk, and whether the walk recovers.

    Only links that were hurt in training are judged. Their changes are compared with the drift of a healthy
    walk, which is how much a walk changes with the severity of a link that was never hurt in training.
    """
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
        head = f"Even a healthy walk changes, by {format_number(limit)} cm per joint."
        yield Hint("warn", head, words("injury.drifts"))
    unchanged = [r["link"] for r in trained if r["from_healthy_cm"] < max(0.5, 2 * limit)]
    if unchanged:
        head = f"{len(unchanged)} of {len(trained)} hurt links hardly change the walk at severity 10"
        yield Hint("note", head, words("injury.unchanged", links=named(unchanged)))
    at_end = max(2, 2 * drift("after_healing_cm"))
    sick = [r["link"] for r in trained if r["link"] not in unchanged and r["after_healing_cm"] > at_end]
    if sick:
        head = f"The walk does not recover after these links have healed: {named(sick)}."
        yield Hint("note", head, words("injury.lasting"))
    if not unchanged:
        low, high = (format_number(f(r["from_healthy_cm"] for r in trained)) for f in (min, max))
        head = f"{len(trained)} of {len(responses)} links were hurt in training."
        cm = low if low == high else f"{low} to {high}"
        yield Hint("good", head, words("injury.changed", cm=cm))
