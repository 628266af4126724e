"""Shows how the gait responds to injury, link by link.

A link is the piece of the body between two neighbouring joints. Its label in files is a pair of joints, such
as "LeftUpLeg-LeftLeg". Readers of the page see a name such as "left thigh".
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from hobble.channels.injury.response import page_cases as cases
from hobble.channels.injury.response.hints import injury_hints
from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Chart,
    ChartGroup,
    ChartPair,
    Column,
    Hint,
    PageSection,
    SectionPart,
    Table,
    Trace,
    axis,
    line_trace,
    with_order,
)

LINK_KEYS = ("link", "first", "second")  # keys of injury.json whose values are labels of links
UNTRAINED = "never hurt in training"
GAIT_COLOURS = {"walk": "@accent", "jog": "@g2"}
# The marker of links that were never hurt in training.
HOLLOW = {"symbol": "circle-open", "size": 8, "line": {"width": 1.2}}
SIDES = (("left", "@accent"), ("right", "@g2"))  # side of the body, colour
# A small chart: its name, title and unit; its lines as (key of a row of injury.json, label, colour); the
# least length of the vertical axis; whether this axis starts at 0.
Panel = tuple[str, str, str, tuple[tuple[str, str, str], ...], float, bool]
PANELS: tuple[Panel, ...] = (
    (
        "pose",
        "Pose",
        "cm",
        (("from_healthy", "from healthy", "@accent"), ("from_worst", "from severity 10", "@muted")),
        2.0,
        True,
    ),
    ("speed", "Speed", "cm/s", (("speed", "speed", "@accent"),), 20.0, True),
    ("stance", "Time on each foot", "share", tuple((f"stance_{s}", s, c) for s, c in SIDES), 0.2, False),
    ("step", "Step length", "cm", tuple((f"step_{s}", s, c) for s, c in SIDES), 15.0, False),
    ("knee", "Range of the knee", "degrees", tuple((f"knee_{s}", s, c) for s, c in SIDES), 15.0, False),
    ("arm", "Swing of the arm", "degrees", tuple((f"arm_{s}", s, c) for s, c in SIDES), 15.0, False),
    (
        "lean",
        "Lean of the trunk",
        "degrees",
        (("lean_forward", "forward", "@accent"), ("lean_left", "to the left", "@g2")),
        6.0,
        False,
    ),
    ("hip", "Height of the hips", "cm", (("hip_height", "hips", "@accent"),), 5.0, False),
    (
        "rough",
        "Largest acceleration of a joint",
        "cm per frame²",
        (("largest_acceleration", "joint", "@accent"),),
        2.0,
        True,
    ),
)


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The charts and tables of the response to injury. Empty for a network without severities.

    found: the content of injury.json. material: what the report is made from.
    """
    parts = _parts(with_spoken_links(found, material), material.name) if found.get("applies") else []
    return PageSection("injury", parts, title="Injury response", order=20)


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Sentences about the response, for the top of the report. found, material: as for `section`."""
    return with_order(50, injury_hints(with_spoken_links(found, material)))


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


def _parts(found: Json, name: str) -> list[SectionPart]:
    """The parts of the section. found: injury.json, with links renamed. name: of the configuration."""
    rows, responses, second = (found.get(key) or [] for key in ("rows", "responses", "second"))
    untrained = {r["link"] for r in responses if not r.get("trained", True)}
    return [
        SectionPart(0, ChartPair(effect_charts(responses))),
        SectionPart(10, response_table(name, responses)),
        SectionPart(20, sweep_charts(rows, found.get("falling") or (), untrained) if rows else None),
        SectionPart(40, cases.second_chart(second)),
        SectionPart(50, cases.second_table(name, second)),
        SectionPart(
            60,
            ChartPair(
                [
                    cases.divided_chart(found.get("divided") or ()),
                    cases.jog_chart(found.get("into_a_jog") or (), untrained),
                ]
            ),
        ),
        SectionPart(70, sweep_table(name, rows)),
    ]


def sweep_charts(
    rows: Sequence[Mapping[str, Any]],
    falling: Sequence[Mapping[str, Any]] = (),
    untrained: Collection[str] = (),
) -> ChartGroup:
    """A small chart of each measure over severity, for a chosen gait and link.

    rows, falling: the rows of injury.json with rising and with falling severity. Lines of falling severity
    are dotted. untrained: links that were never hurt in training. They come last in the menu, with a remark.
    """

    def menu_option(row: Mapping[str, Any]) -> str:
        remark = f" ({UNTRAINED})" if row["link"] in untrained else ""
        return f"{row['link']}, {row['gait']}{remark}"

    # Option of the menu -> its rows of rising and of falling severity.
    rising_rows: dict[str, list[Mapping[str, Any]]] = {}
    for row in sorted(rows, key=lambda row: row["link"] in untrained):
        rising_rows.setdefault(menu_option(row), []).append(row)
    falling_rows: dict[str, list[Mapping[str, Any]]] = {}
    for row in falling:
        falling_rows.setdefault(menu_option(row), []).append(row)
    charts = [_panel_chart(panel, rows, rising_rows, falling_rows) for panel in PANELS]
    caption = (
        "The character moves on while the severity of one link rises from 0 to 10 and falls again. Each "
        "point is measured over whole gait cycles at one severity. A smooth curve means that the walk "
        "changes gradually. A gap between left and right is a limp. A jump between neighbouring points means "
        "that the network switches between two gaits. The first chart shows how far the pose is from the "
        "healthy walk and from the walk at severity 10: the mean distance of the joints at the same phase."
    )
    if falling:
        caption += " Dotted lines show falling severity."
    if untrained:
        caption += " Links that were never hurt in training show how much a healthy walk varies."
    return ChartGroup("sweeps", "One link at rising severity", caption, charts, "Link and gait")


def _panel_chart(
    panel: Panel,
    rows: Sequence[Mapping[str, Any]],
    rising_rows: Mapping[str, Sequence[Mapping[str, Any]]],
    falling_rows: Mapping[str, Sequence[Mapping[str, Any]]],
) -> Chart:
    """The small chart of an entry of PANELS.

    rows: the rows of all options of the menu, for the range of the axis. rising_rows, falling_rows: option of
    the menu -> its rows of rising and of falling severity.
    """
    name, title, unit, lines, least_range, from_zero = panel
    options: dict[str, list[Trace]] = {}
    for option, rising in rising_rows.items():
        x = [row["severity"] for row in rising]
        options[option] = [
            line_trace(label, x, [row.get(key) for row in rising], colour, mode="lines+markers")
            | {"marker": {"size": 5}}
            for key, label, colour in lines
        ]
        falling = falling_rows.get(option, ())
        for key, label, colour in lines if falling else ():
            x, y = [row["severity"] for row in falling], [row.get(key) for row in falling]
            options[option].append(
                line_trace(f"{label}, healing", x, y, colour, width=1.3, dash="dot", showlegend=False)
            )
    layout = {
        "xaxis": axis("severity", dtick=2, range=[-0.3, 10.3]),
        "yaxis": axis(unit),
        "showlegend": len(lines) > 1,
    }
    keys = [key for key, *_ in lines]
    ranges = {
        option: {"yaxis": {"range": y_range(rows, rising[0]["gait"], keys, least_range, from_zero)}}
        for option, rising in rising_rows.items()
    }
    return Chart(
        f"sweep-{name}", title, "", layout=layout, height=230, options=options, option_layouts=ranges
    )


def y_range(
    rows: Sequence[Mapping[str, Any]], gait: str, keys: Sequence[str], least_range: float, from_zero: bool
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


def effect_charts(responses: Sequence[Mapping[str, Any]]) -> list[Chart]:
    """Two charts of each link at severity 10: the change of the pose, and the remaining speed.

    responses: those of injury.json.
    """
    charts = []
    has_untrained = any(not r.get("trained", True) for r in responses)
    for name, key, title, axis_title, least_range, caption, on_hollow_dots in (
        (
            "injury-pose",
            "from_healthy_cm",
            "Change of the pose",
            "cm per joint at severity 10",
            2.0,
            "Distance from the healthy walk at the same phase, mean over joints.",
            "They have no effect, so they show how much healthy walks differ. If a filled dot is not to the "
            "right of the hollow dots, its link has no effect either.",
        ),
        (
            "injury-speed",
            "speed_share",
            "Remaining speed",
            "share of the healthy speed",
            1.0,
            "Speed at severity 10, divided by the healthy speed.",
            "",
        ),
    ):
        if has_untrained:
            hollow_dots = "Hollow dots are links that were never hurt in training."
            caption = f"{caption} {hollow_dots} {on_hollow_dots}".strip()
        traces: list[Trace] = []
        for gait, colour in GAIT_COLOURS.items():
            for hurt in (True, False):
                dots = [
                    r
                    for r in responses[::-1]
                    if r["gait"] == gait and r.get("trained", True) is hurt and r.get(key) is not None
                ]
                if dots:
                    marker = {"color": colour, "size": 9} if hurt else HOLLOW | {"color": colour}
                    traces.append(
                        {
                            "type": "scatter",
                            "mode": "markers",
                            "name": gait if hurt else f"{gait}, {UNTRAINED}",
                            "y": [r["link"] for r in dots],
                            "x": [r[key] for r in dots],
                            "marker": marker,
                            "hovertemplate": "%{y}: %{x:.2f}<extra>%{fullData.name}</extra>",
                        }
                    )
        # Links that were hurt in training are at the top. Plotly counts from below, so the list is reversed.
        from_top = sorted(responses, key=lambda r: not r.get("trained", True))
        links = list(dict.fromkeys(r["link"] for r in from_top))[::-1]
        furthest = max((r[key] for r in responses if r.get(key) is not None), default=0.0)
        x_axis = axis(axis_title, range=[0, 1.08 * max(least_range, furthest)])
        y_axis = {"categoryorder": "array", "categoryarray": links, "automargin": True, "type": "category"}
        if traces:
            layout = {"xaxis": x_axis, "yaxis": y_axis}
            charts.append(Chart(name, title, caption, traces, layout, 150 + 21 * len(links)))
    return charts


def response_table(name: str, responses: Sequence[Mapping[str, Any]]) -> Table:
    """A row for each gait and link. name: of the configuration. responses: those of injury.json."""
    columns = [
        Column("gait"),
        Column("link"),
        Column("in training", lambda v: "hurt" if v else "never hurt"),
        Column.number("change of the pose, cm"),
        Column.number("share of the healthy speed"),
        Column.number("time to settle, s"),
        Column.number("time to heal, s"),
        Column.number("change left after healing, cm"),
        Column.number("difference between rising and falling severity, cm"),
        Column.number("largest acceleration, divided by the healthy walk's"),
        Column.number("ρ of pose"),
        Column.number("ρ of speed"),
    ]
    rows = [
        [
            r["gait"],
            r["link"],
            r.get("trained", True),
            r.get("from_healthy_cm"),
            r.get("speed_share"),
            r.get("settle_seconds"),
            r.get("heal_seconds"),
            r.get("after_healing_cm"),
            r.get("hysteresis_cm"),
            r.get("acceleration_share"),
            (r.get("spearman") or {}).get("from_healthy"),
            (r.get("spearman") or {}).get("speed"),
        ]
        for r in responses
    ]
    title = "Every link at severity 10, and the rank correlation of its effects with severity (Spearman's ρ)"
    return Table(f"{name}-injury-responses", columns, rows, title)


def sweep_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """The rows of injury/sweep.csv with rising severity. None if there are none.

    name: of the configuration. rows: those of injury.json.
    """
    if not rows:
        return None
    keys = list(rows[0])
    words = {key: key.replace("_", " ") for key in keys} | {"from_worst": "from severity 10"}
    columns = [Column(k) if isinstance(rows[0][k], str) else Column.number(words[k]) for k in keys]
    table = [[row.get(k) for k in keys] for row in rows]
    return Table(f"{name}-injury", columns, table, "Every walk and jog at rising severity")
