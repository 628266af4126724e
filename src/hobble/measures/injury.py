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
from hobble.core.section import PositiveFloat
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Cost, Measure, SampleOptions
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
    shows_something,
    with_order,
)
from hobble.runtime.options import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(SampleOptions):
    """The keys of this measurement in the section `evaluation`."""

    # 3 s are enough. With 4 s, the mean effects on pose and speed differ by only 1 % (configuration `limp`).
    seconds: PositiveFloat = Field(3.0, description="seconds that a figure walks at each severity")


MEASURE = Measure(
    name="injury",
    module=__name__,
    inputs=("weights", "clips", "summaries"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    channel="injury",
    cost=Cost(mb_per_1000_frames=14, seconds_per_1000_frames=0.2, least_minutes=60),
)
Rows = Sequence[Mapping[str, Any]]  # rows of injury.json
LINK_KEYS = ("link", "first", "second")  # keys whose values are labels of links
UNTRAINED = "never hurt in training"
GAIT_COLOURS = {"walk": "@accent", "jog": "@g2"}
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")  # of the lines in a chart
# The marker of links that were never hurt in training.
HOLLOW = {"symbol": "circle-open", "size": 8, "line": {"width": 1.2}}
STRIP_WIDTH, STRIP_HEIGHT = 110.0, 205.0  # cm between the figures of a strip
SIDES = (("left", "@accent"), ("right", "@g2"))  # side of the body, colour
# A small chart: its name, title and unit; its lines as (key of a row, label, colour); the least length of the
# vertical axis; whether this axis starts at 0.
Panel = tuple[str, str, str, Sequence[tuple[str, str, str]], float, bool]


def _both_sides(key: str) -> list[tuple[str, str, str]]:
    return [(f"{key}_{side}", side, colour) for side, colour in SIDES]


POSE = [("from_healthy", "from healthy", "@accent"), ("from_worst", "from severity 10", "@muted")]
LEAN = [("lean_forward", "forward", "@accent"), ("lean_left", "to the left", "@g2")]
ROUGH = [("largest_acceleration", "joint", "@accent")]
PANELS: tuple[Panel, ...] = (
    ("pose", "Pose", "cm", POSE, 2.0, True),
    ("speed", "Speed", "cm/s", [("speed", "speed", "@accent")], 20.0, True),
    ("stance", "Time on each foot", "share", _both_sides("stance"), 0.2, False),
    ("step", "Step length", "cm", _both_sides("step"), 15.0, False),
    ("knee", "Range of the knee", "degrees", _both_sides("knee"), 15.0, False),
    ("arm", "Swing of the arm", "degrees", _both_sides("arm"), 15.0, False),
    ("lean", "Lean of the trunk", "degrees", LEAN, 6.0, False),
    ("hip", "Height of the hips", "cm", [("hip_height", "hips", "@accent")], 5.0, False),
    ("rough", "Largest acceleration of a joint", "cm per frame²", ROUGH, 2.0, True),
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
INTRODUCTION = (
    "The character walks or jogs while the severity of one link (the piece of the body between two "
    "neighbouring joints) rises from 0 to 10 and falls again. Each value is a mean over the links that were "
    "hurt in training, except the share that a classifier recognises. ρ is Spearman's rank correlation: "
    "1 means that the measure always rises with severity, −1 that it always falls, 0 that it has no trend."
)
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
    "clip_acceleration_share": "largest acceleration, divided by the captured clips'",
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
    table = injury_table(compared)
    introduction = Paragraph(INTRODUCTION) if table else None
    parts = [SectionPart(0, introduction), SectionPart(10, table, open=True, short=True)]
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
    found = {key for *_, summary in summaries for key in summary}
    keys = [*(key for key in ROW_LABELS if key in found), *sorted(found - set(ROW_LABELS))]
    columns = [Column("measure"), *(Column.number(f"{name}, {gait}") for name, gait, _ in summaries)]
    rows: list[list[Any]] = [
        [ROW_LABELS.get(key, key.replace("_", " ")), *(summary.get(key) for *_, summary in summaries)]
        for key in keys
    ]
    # The measurement `recognition` gives one share for each configuration. It is from walks, not from jogs.
    recognised = {
        e["configuration"]: e["generated"]["right"] for e in compared["recognition"] if e.get("applies")
    }
    if recognised:
        shares = [recognised.get(name) if gait == "walk" else None for name, gait, _ in summaries]
        rows.append(["share of walks of 1 s in which a classifier recognises what hurts", *shares])
    return Table("compare-injury", columns, rows, "Means over the links that were hurt in training")


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
    rows, responses = (found.get(key) or [] for key in ("rows", "responses"))
    sweep, thresholds = (found.get(key) or [] for key in ("second_sweep", "second_thresholds"))
    untrained = {r["link"] for r in responses if not _trained(r)}
    words = {"from_worst": "from severity 10"}
    all_rows = table_of_rows(f"{name}-injury", rows, "Every walk and jog at rising severity", words)
    both = (
        "Two injuries: where the second begins to show, has its whole effect, and shows more than the first"
    )
    jogs = found.get("into_a_jog") or ()
    return [
        SectionPart(0, ChartPair(effect_charts(responses))),
        SectionPart(10, response_table(name, responses)),
        SectionPart(15, strip_chart(found.get("strips") or (), material.network["skeleton"])),
        SectionPart(20, sweep_charts(rows, found.get("falling") or (), untrained) if rows else None),
        SectionPart(25, range_table(name, rows, untrained, published["one_link"]), open=True, short=True),
        SectionPart(42, sweep_chart(sweep, published)),
        SectionPart(45, table_of_rows(f"{name}-second-thresholds", thresholds, both), open=True, short=True),
        SectionPart(51, table_of_rows(f"{name}-second-sweep", sweep, "Every step of a second injury")),
        SectionPart(60, ChartPair([divided_chart(found.get("divided") or ()), jog_chart(jogs, untrained)])),
        SectionPart(
            65, table_of_rows(f"{name}-into-a-jog", jogs, "Every walk that becomes a jog", texts=["link"])
        ),
        SectionPart(70, all_rows),
    ]


def strip_chart(strips: Rows, skeleton: Json) -> Chart | None:
    """Poses at rising severity, from the side and from the front: Figures 3 and 4 of Ferre et al. (2019)."""
    if not strips:
        return None
    joints = list(skeleton["joints"])
    bones = [(joints.index(j["parent"]), i) for i, j in enumerate(skeleton["joints"].values()) if j["parent"]]

    def figure(pose: Any, place: float) -> list[Trace]:
        """A pose from the side, walking to the right, and above it from the front."""
        p = np.array(pose)
        views = [(p[:, 2] + place, p[:, 1]), (p[:, 0] + place, p[:, 1] + STRIP_HEIGHT)]
        points = [((x[a], x[b], None), (y[a], y[b], None)) for x, y in views for a, b in bones]
        xs, ys = ([v for point in points for v in point[axis_]] for axis_ in (0, 1))
        return [line_trace("", xs, ys, "@accent", width=3, showlegend=False, hoverinfo="skip")]

    options: dict[str, list[Trace]] = {}
    for strip in strips:
        first = f"{strip['first']} at {strip['first_severity']:g}, and " if strip["first"] else ""
        places = [STRIP_WIDTH * n for n in range(len(strip["poses"]))]
        texts = [f"{severity:g}" for severity in strip["severities"]]
        label = marker_trace("", places, [-14.0] * len(places), {"size": 1}, mode="text", text=texts)
        figures = [t for p, x in zip(strip["poses"], places, strict=True) for t in figure(p, x)]
        options[first + strip["link"]] = [*figures, {**label, "showlegend": False, "hoverinfo": "skip"}]
    bare = {"showgrid": False, "zeroline": False, "showticklabels": False}
    caption = (
        "Poses of the walk at the severity below each, from the side (walking to the right) and, above, "
        "from the front. They are means over gait cycles, all at the phase at which the last differs most "
        "from the first. Ferre et al. show such strips in their Figures 3 (one link at 0, 4, 7 and 10) and "
        "4 (a second injury at 0 and 5 over a first at 5)."
    )
    layout = {"xaxis": {**bare, "title": {"text": "severity"}}, "yaxis": {**bare, "scaleanchor": "x"}}
    return Chart("strips", "Poses at rising severity", caption, (), layout, 520, "Injury", options)


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

    table = [
        [gait, link, *shares(sweep, "from_healthy"), *shares(sweep, "speed")]
        for (gait, link), sweep in sweeps.items()
        if {0, 10, *ends} <= set(sweep)
    ]
    columns = [Column("gait"), Column("link")]
    columns += [Column.number(f"{what} at {end}", 2) for what in ("pose", "speed") for end in ends]
    title = (
        "Shares of the whole change at the ends of the ranges that Ferre et al. saw: 0 to 3 little change, "
        "4 to 6 speed and pose change, 7 to 10 as in the clips"
    )
    return Table(f"{name}-injury-ranges", columns, table, title) if table else None


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
    caption = (
        "The character walks with one injury while the severity of a second one rises. Pose: distance from "
        "the walk with only the first injury, and from that with only the second. Dotted vertical lines are "
        "the thresholds that Ferre et al. (2019) saw: over a first injury at 5, both are blended until the "
        "second reaches 5; over one at 10, the second begins to show at 3 and has its whole effect at 8. At "
        "equal severities, they saw the speed of the faster of both."
    )
    layout = {"xaxis": axis("severity of the second injury", dtick=1), "yaxis": axis("cm")}
    chart = Chart(
        "second-sweep", "A second injury, swept", caption, (), layout, 340, "Injuries", options, layouts
    )
    return chart if options else None


def _threshold(severity: float) -> dict[str, Any]:
    """A dotted vertical line."""
    (shape,) = reference_line(severity, "")["shapes"]
    return shape


def _trained(response: Mapping[str, Any]) -> bool:
    """Whether the link of a response was hurt in training."""
    return response.get("trained", True)


def table_of_rows(
    key: str, rows: Rows, title: str, words: Mapping[str, str] | None = None, texts: Collection[str] = ()
) -> Table:
    """A table with all values of the rows.

    words: key of a row -> heading of its column, if it is not the key itself. texts: keys of texts, which may
    be missing in the first row.
    """
    columns = {}
    for name, value in rows[0].items() if rows else ():
        heading = (words or {}).get(name, name.replace("_", " "))
        columns[name] = Column(heading) if isinstance(value, str) or name in texts else Column.number(heading)
    return Table.of(key, columns, rows, title)


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
    charts = [_panel_chart(panel, rows, rising_rows, by_option(falling)) for panel in PANELS]
    caption = (
        "The character moves on while the severity of one link rises from 0 to 10 and falls again. Each "
        "point is measured over whole gait cycles at one severity. A smooth curve means that the walk "
        "changes gradually. A gap between left and right is a limp. A jump between neighbouring points "
        "means that the network switches between two gaits. The first chart shows how far the pose is from "
        "the healthy walk and from the walk at severity 10: the mean distance of the joints at the same "
        "phase. Dotted lines divide the ranges that Ferre et al. (2019) saw: little change to 3, then a "
        "change of speed and pose, and from 7 on the walk of the clips."
    )
    if falling:
        caption += " Dotted lines show falling severity."
    if untrained:
        caption += " Links that were never hurt in training show how much a healthy walk varies."
    return ChartGroup("sweeps", "One link at rising severity", caption, charts, "Link and gait")


def _panel_chart(
    panel: Panel, rows: Rows, rising_rows: Mapping[str, Rows], falling_rows: Mapping[str, Rows]
) -> Chart:
    """The small chart of an entry of PANELS.

    rows: the rows of all options of the menu, for the range of the axis. rising_rows, falling_rows: option of
    the menu -> its rows of rising and of falling severity.
    """
    name, title, unit, lines, least_range, from_zero = panel
    options: dict[str, list[Trace]] = {}
    for option, rising in rising_rows.items():
        options[option] = [
            _line(label, rising, key, colour, mode="lines+markers") | {"marker": {"size": 5}}
            for key, label, colour in lines
        ] + [
            _line(f"{label}, healing", falling, key, colour, width=1.3, dash="dot", showlegend=False)
            for key, label, colour in lines
            if (falling := falling_rows.get(option, ()))
        ]
    layout = {
        "xaxis": axis("severity", dtick=2, range=[-0.3, 10.3]),
        "yaxis": axis(unit),
        "showlegend": len(lines) > 1,
        "shapes": [_threshold(x) for x in (3.5, 6.5)] if name in ("pose", "speed") else [],
    }
    keys = [key for key, *_ in lines]
    ranges = {
        option: {"yaxis": {"range": y_range(rows, rising[0]["gait"], keys, least_range, from_zero)}}
        for option, rising in rising_rows.items()
    }
    return Chart(
        f"sweep-{name}", title, "", layout=layout, height=230, options=options, option_layouts=ranges
    )


def _line(label: str, rows: Rows, key: str, colour: str, **more: Any) -> Trace:
    """A line of the values `key` over severity."""
    x, y = [row["severity"] for row in rows], [row.get(key) for row in rows]
    return line_trace(label, x, y, colour, **more)


def y_range(
    rows: Rows, gait: str, keys: Sequence[str], least_range: float, from_zero: bool
) -> list[float] | None:
    """[lowest, highest] value of the vertical axis. It is the same for all links of a gait, to compare them.

    keys: keys of a row whose values the chart shows. least_range: the axis is at least this long, so that
    noise looks small. from_zero: whether the axis starts at 0. None if no row has a value.
    """
    values = [row[k] for row in rows if row["gait"] == gait for k in keys if row.get(k) is not None]
    if not values:
        return None
    low, high = (0.0 if from_zero else min(values)), max(values)
    # The empty space: 8 % of the range of the values, or more to reach `least_range`. An axis from 0 has all
    # of it at the top; another axis has one half at each end.
    spare = max(least_range - (high - low), 0.08 * (high - low))
    return [low if from_zero else low - spare / 2, high + spare / (1 if from_zero else 2)]


def effect_charts(responses: Rows) -> list[Chart]:
    """Two charts of each link at severity 10: the change of the pose, and the remaining speed."""
    pose = "Distance from the healthy walk at the same phase, mean over joints."
    speed = "Speed at severity 10, divided by the healthy speed."
    if any(not _trained(r) for r in responses):
        hollow = " Hollow dots are links that were never hurt in training."
        pose += (
            f"{hollow} They have no effect, so they show how much healthy walks differ. If a filled dot is "
            "not to the right of the hollow dots, its link has no effect either."
        )
        speed += hollow
    of_pose, of_speed = (
        ("injury-pose", "Change of the pose", pose),
        ("injury-speed", "Remaining speed", speed),
    )
    charts = [
        _effect_chart(responses, "from_healthy_cm", of_pose, "cm per joint at severity 10", 2.0),
        _effect_chart(responses, "speed_share", of_speed, "share of the healthy speed", 1.0),
    ]
    return [chart for chart in charts if shows_something(chart)]


def _effect_chart(
    responses: Rows, key: str, texts: tuple[str, str, str], axis_title: str, least_range: float
) -> Chart:
    """A dot for each link and gait. texts: name, title and caption of the chart."""
    traces: list[Trace] = []
    known = [r for r in responses if r.get(key) is not None]
    for (gait, colour), hurt in product(GAIT_COLOURS.items(), (True, False)):
        if dots := [r for r in known[::-1] if r["gait"] == gait and _trained(r) is hurt]:
            name = gait if hurt else f"{gait}, {UNTRAINED}"
            marker = {"size": 9} if hurt else HOLLOW
            x, y = [r[key] for r in dots], [r["link"] for r in dots]
            hover = "%{y}: %{x:.2f}<extra>%{fullData.name}</extra>"
            traces.append(marker_trace(name, x, y, {**marker, "color": colour}, hovertemplate=hover))
    # Links that were hurt in training are at the top. Plotly counts from below, so the list is reversed.
    from_top = sorted(responses, key=lambda r: not _trained(r))
    links = list(dict.fromkeys(r["link"] for r in from_top))[::-1]
    furthest = max((r[key] for r in known), default=0.0)
    layout = {
        "xaxis": axis(axis_title, range=[0, 1.08 * max(least_range, furthest)]),
        "yaxis": ordered_axis(links, type="category"),
    }
    return Chart(*texts, traces, layout, 150 + 21 * len(links))


def response_table(name: str, responses: Rows) -> Table:
    """A row for each gait and link. name: of the configuration."""
    columns = {
        "gait": Column("gait"),
        "link": Column("link"),
        "trained": Column("in training", lambda v: "hurt" if v else "never hurt"),
        **{key: Column.number(label) for key, label in RESPONSE_COLUMNS.items()},
    }
    records = [
        {"trained": True, **r} | {f"spearman_{key}": rho for key, rho in (r.get("spearman") or {}).items()}
        for r in responses
    ]
    title = "Every link at severity 10, and the rank correlation of its effects with severity (Spearman's ρ)"
    return Table.of(f"{name}-injury-responses", columns, records, title)


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
    smooth, layouts = "smoothness against range", {}
    if all("largest_acceleration" in row for row in rows):
        options[smooth] = []
        for scale, colour in zip(scales, COLOURS, strict=False):
            of_scale = [row for row in rows if row["scale"] == scale]
            x = [max(r["from_healthy_cm"] for r in of_scale if r["link"] == link) for link in links]
            y = [max(r["largest_acceleration"] for r in of_scale if r["link"] == link) for link in links]
            hover = {"text": links, "hovertemplate": "%{text}: %{x:.1f} cm, %{y:.2f}<extra></extra>"}
            dots = {"size": 9, "color": colour}
            options[smooth].append(marker_trace(f"divided by {scale:g}", x, y, dots, **hover))
        axes = {
            "xaxis": axis("largest change of the pose, cm"),
            "yaxis": axis("largest acceleration, cm/frame²"),
        }
        layouts[smooth] = axes
    return Chart(
        "divided",
        "Severities divided by a number",
        "As in an experiment of Ferre et al., the severities are divided by a number before the network "
        "gets them. Each line belongs to one number. Its height is the distance of the pose from the "
        "healthy walk. Smoothness against range: a dot for each link, with the largest change of the pose "
        "and the largest acceleration of a joint while severity rises. Division makes both smaller.",
        layout={"xaxis": axis("severity", dtick=2), "yaxis": axis("cm per joint", rangemode="tozero")},
        choose="Link",
        options=options,
        option_layouts=layouts,
    )


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
    caption = (
        "The character walks hurt, then jogs and is still hurt. Pose: how far its jog is from the healthy "
        "jog. Dotted vertical lines divide what Ferre et al. (2019) saw of a link that hurt in no run of "
        "the training: little change to 3, from 4 to 7 the injury at nearly the speed of a run, from 8 on a "
        "slower run."
    )
    if untrained:
        caption += (
            " The dotted line is the mean of links that were never hurt in training. They have no effect, so "
            "the line shows how much two healthy jogs differ. If the line of a link is not above it, the "
            "injury does not show in the jog."
        )
    layout = {
        "xaxis": axis("severity", dtick=1),
        "yaxis": {"rangemode": "tozero"},
        "showlegend": True,
        "shapes": [_threshold(x) for x in (3.5, 7.5)],
    }
    return Chart("into-a-jog", "From a hurt walk into a jog", caption, (), layout, 420, "Shown", options)


def injury_hints(found: Json) -> Iterator[Hint]:
    """Whether and how much each hurt link changes the walk, and whether the walk recovers.

    Only links that were hurt in training are judged. Their changes are compared with the drift of a healthy
    walk, which is how much it changes although nothing hurts.
    """
    responses = [r for r in found.get("responses") or () if r["gait"] == "walk"]
    trained = [r for r in responses if _trained(r)]
    if not trained:
        return
    drift, drift_at_end = (_drift(responses, key) for key in ("from_healthy_cm", "after_healing_cm"))
    if drift > 2:
        yield Hint(
            "warn",
            f"Even a healthy walk changes, by {format_number(drift)} cm per joint.",
            "So the effect of severity is hard to measure. Train for longer, or measure for longer.",
        )
    unchanged = [r["link"] for r in trained if (r.get("from_healthy_cm") or 0) < max(0.5, 2 * drift)]
    if unchanged:
        yield Hint(
            "note",
            f"{len(unchanged)} of {_plural(len(trained), 'link')} hardly "
            f"{'changes' if len(unchanged) == 1 else 'change'} the walk at severity 10",
            "(by less than half a centimetre per joint, or by less than twice the change of a healthy walk): "
            f"{_first_four(unchanged)}. Add clips in which they hurt.",
        )
    not_healed = [
        r["link"]
        for r in trained
        if r["link"] not in unchanged and (r.get("after_healing_cm") or 0) > max(2, 2 * drift_at_end)
    ]
    if not_healed:
        yield Hint(
            "note",
            f"The walk does not recover after these links have healed: {_first_four(not_healed)}.",
            "The character keeps limping although nothing hurts any more.",
        )
    if not unchanged:
        low, high = (format_number(f(r["from_healthy_cm"] for r in trained)) for f in (min, max))
        yield Hint(
            "good",
            f"{len(trained)} of {_plural(len(responses), 'link')} {'was' if len(trained) == 1 else 'were'} "
            "hurt in training.",
            f"At severity 10, {'it' if len(trained) == 1 else 'each of them'} changes the walk by "
            f"{low if low == high else f'{low} to {high}'} cm per joint. A link is the piece of the body "
            "between two neighbouring joints.",
        )


def _drift(responses: Rows, key: str) -> float:
    """The drift of a healthy walk: the mean of `key` over links that were never hurt in training, cm.

    These links have no effect, so a walk that changes with their severity only drifts. 0 if there are none.
    """
    values = [r[key] for r in responses if not _trained(r) and r.get(key) is not None]
    return float(np.mean(values)) if values else 0.0


def _first_four(links: Sequence[str]) -> str:
    return ", ".join(links[:4]) + (" …" if len(links) > 4 else "")


def _plural(count: int, word: str) -> str:
    """A count and its noun, in the plural unless the count is 1."""
    return f"{count} {word}{'' if count == 1 else 's'}"
