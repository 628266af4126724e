"""More charts of the response to injury: a second injury, a jog after a hurt walk, divided severities."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from hobble.report.charts import Chart, Trace, axis, line
from hobble.report.tables import Column, Table

# Colours of the lines in a chart.
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")


def second_chart(rows: Sequence[Mapping[str, Any]]) -> Chart | None:
    """The effect of a second injury in addition to a first, for every pair of injury.json's `second`."""
    if not rows:
        return None
    firsts, seconds = (list(dict.fromkeys(row[key] for row in rows)) for key in ("first", "second"))
    by_pair = {(row["first"], row["second"]): row for row in rows}
    shown = {"centimetres per joint": ("from_first_cm", ".1f"), "share of its effect alone": ("share", ".0%")}
    options: dict[str, list[Trace]] = {}
    for label, (key, form) in shown.items():
        options[label] = [
            {
                "type": "heatmap",
                "x": seconds,
                "y": firsts,
                "z": [[by_pair.get((a, b), {}).get(key) for b in seconds] for a in firsts],
                "colorscale": [[0, "@sunken"], [1, "@accent"]],
                "zmin": 0,
                "xgap": 2,
                "ygap": 2,
                "texttemplate": f"%{{z:{form}}}",
                "showscale": False,
                "hovertemplate": f"%{{x}} over %{{y}}: %{{z:{form}}}<extra></extra>",
            }
        ]
    return Chart(
        "second-injury",
        "A second injury in addition to a first",
        "Rows: the first injury, at severity 7, one link of each part of the body. Columns: the second, at "
        "10. The cell says how much the second changes the walk, in centimetres or as a share of its effect "
        "on a healthy body. A pale cell means that the first injury hides the second.",
        layout={
            "xaxis": {"type": "category", "tickangle": -50, "automargin": True},
            "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
        },
        height=max(300, 190 + 24 * len(firsts)),
        choose="Unit",
        options=options,
    )


def second_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """Every walk with two injuries, as in injury/second.csv."""
    if not rows:
        return None
    keys = [key for key, value in rows[0].items() if not isinstance(value, (dict, list))]
    columns = [
        Column(k.replace("_", " ")) if isinstance(rows[0][k], str) else Column.number(k.replace("_", " "))
        for k in keys
    ]
    table = [[row.get(k) for k in keys] for row in rows]
    return Table(f"{name}-second-injury", columns, table, "Every walk with two injuries")


def divided_chart(rows: Sequence[Mapping[str, Any]]) -> Chart | None:
    """How far the walk with a chosen link hurt is from the healthy walk, with a line for each divisor."""
    options: dict[str, list[Trace]] = {}
    scales = sorted({row["scale"] for row in rows})
    for link in dict.fromkeys(row["link"] for row in rows):
        traces = []
        for scale, colour in zip(scales, COLOURS, strict=False):
            some = [row for row in rows if row["link"] == link and row["scale"] == scale]
            x, y = [row["severity"] for row in some], [row["from_healthy_cm"] for row in some]
            traces.append(line(f"divided by {scale:g}", x, y, colour, mode="lines+markers"))
        options[link] = traces
    if not options:
        return None
    return Chart(
        "divided",
        "Weaker inputs",
        "This shows how much of the effect remains if the severities are divided before the network gets "
        "them. Each line belongs to one divisor. Its height is the distance of the pose from the "
        "healthy walk.",
        layout={"xaxis": axis("severity", dtick=2), "yaxis": axis("cm per joint", rangemode="tozero")},
        choose="Link",
        options=options,
    )


def jog_chart(rows: Sequence[Mapping[str, Any]], untrained: Collection[str] = ()) -> Chart | None:
    """How much of an injury remains when a walk becomes a jog. All `untrained` links share one line."""
    links = [link for link in dict.fromkeys(row["link"] for row in rows) if link is not None]
    hurt = [link for link in links if link not in untrained]
    traces: list[Trace] = []
    for i, link in enumerate(hurt):
        some = [row for row in rows if row["link"] == link]
        x, y = [row["severity"] for row in some], [row.get("jog_from_healthy_cm") for row in some]
        dash = "solid" if i < len(COLOURS) else "dash"
        traces.append(line(link, x, y, COLOURS[i % len(COLOURS)], dash=dash, mode="lines+markers", width=1.4))
    untrained_jogs: dict[float, list[float]] = {}
    for row in rows:
        if row["link"] in untrained and row.get("jog_from_healthy_cm") is not None:
            untrained_jogs.setdefault(row["severity"], []).append(row["jog_from_healthy_cm"])
    if untrained_jogs:
        means = [sum(values) / len(values) for values in untrained_jogs.values()]
        traces.append(
            line("never hurt in training", list(untrained_jogs), means, "@muted", dash="dot", width=1.4)
        )
    if not traces:
        return None
    caption = (
        "The character walks hurt, then jogs and is still hurt. The chart shows how far its jog is from the "
        "healthy jog."
    )
    if untrained_jogs:
        caption += (
            " The dotted line is the mean of links that were never hurt in training. They have no effect, so "
            "the line shows how much two healthy jogs differ. If the line of a link is not above it, the "
            "injury does not show in the jog."
        )
    return Chart(
        "into-a-jog",
        "From a hurt walk into a jog",
        caption,
        traces,
        {
            "xaxis": axis("severity", dtick=1),
            "yaxis": axis("cm per joint", rangemode="tozero"),
            "showlegend": True,
        },
        height=420,
    )
