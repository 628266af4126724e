"""More charts of the response to injury: a second injury, a jog after a hurt walk, divided severities.

A link is the piece of the body between two neighbouring joints. `hobble.channels.injury.response.cases`
measures what is shown here.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from hobble.report.parts import Chart, Column, Table, Trace, axis, line_trace

# Colours of the lines in a chart.
COLOURS = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0")


def second_chart(rows: Sequence[Mapping[str, Any]]) -> Chart | None:
    """The effect of a second injury in addition to a first one, with a cell for each pair of links.

    rows: `second` of injury.json. None if it is empty.
    """
    if not rows:
        return None
    first_links, second_links = (list(dict.fromkeys(row[key] for row in rows)) for key in ("first", "second"))
    by_pair = {(row["first"], row["second"]): row for row in rows}
    # Option of the menu -> key of a row, and format of its value.
    units = {
        "centimetres per joint": ("from_first_cm", ".1f"),
        "share of its effect on a healthy body": ("share", ".0%"),
    }
    options: dict[str, list[Trace]] = {}
    for unit, (key, number_format) in units.items():
        options[unit] = [
            {
                "type": "heatmap",
                "x": second_links,
                "y": first_links,
                "z": [[by_pair.get((a, b), {}).get(key) for b in second_links] for a in first_links],
                "colorscale": [[0, "@sunken"], [1, "@accent"]],
                "zmin": 0,
                "xgap": 2,
                "ygap": 2,
                "texttemplate": f"%{{z:{number_format}}}",
                "showscale": False,
                "hovertemplate": f"%{{x}} in addition to %{{y}}: %{{z:{number_format}}}<extra></extra>",
            }
        ]
    return Chart(
        "second-injury",
        "A second injury in addition to a first",
        "Each row names the part of the body that is hurt first, at severity 7; if the part has several "
        "links, one of them is hurt. Each column is a second injury, at severity 10. The cell says how much "
        "the second injury changes the walk, in centimetres or as a share of its effect on a healthy body. A "
        "pale cell means that the second injury hardly shows.",
        layout={
            "xaxis": {"type": "category", "tickangle": -50, "automargin": True},
            "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
        },
        height=max(300, 190 + 24 * len(first_links)),
        choose="Unit",
        options=options,
    )


def second_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """Every walk with two injuries, as in injury/second.csv. name: of the configuration."""
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
    """How far the walk with one link hurt is from the healthy walk, with a line for each divisor.

    A menu selects the link. rows: `divided` of injury.json. None if it is empty.
    """
    options: dict[str, list[Trace]] = {}
    scales = sorted({row["scale"] for row in rows})
    for link in dict.fromkeys(row["link"] for row in rows):
        traces = []
        for scale, colour in zip(scales, COLOURS, strict=False):
            of_line = [row for row in rows if row["link"] == link and row["scale"] == scale]
            x, y = [row["severity"] for row in of_line], [row["from_healthy_cm"] for row in of_line]
            traces.append(line_trace(f"divided by {scale:g}", x, y, colour, mode="lines+markers"))
        options[link] = traces
    if not options:
        return None
    return Chart(
        "divided",
        "Severities divided by a number",
        "As in an experiment of Ferre, the severities are divided by a number before the network gets them. "
        "Each line belongs to one number. Its height is the distance of the pose from the healthy walk.",
        layout={"xaxis": axis("severity", dtick=2), "yaxis": axis("cm per joint", rangemode="tozero")},
        choose="Link",
        options=options,
    )


def jog_chart(rows: Sequence[Mapping[str, Any]], untrained: Collection[str] = ()) -> Chart | None:
    """How much of an injury shows in a jog after a hurt walk, with a line for each link.

    rows: `into_a_jog` of injury.json. untrained: links that were never hurt in training. They share one line.
    None if there is nothing to show.
    """
    links = [link for link in dict.fromkeys(row["link"] for row in rows) if link is not None]
    hurt = [link for link in links if link not in untrained]
    traces: list[Trace] = []
    for i, link in enumerate(hurt):
        of_link = [row for row in rows if row["link"] == link]
        x, y = [row["severity"] for row in of_link], [row.get("jog_from_healthy_cm") for row in of_link]
        dash = "solid" if i < len(COLOURS) else "dash"
        traces.append(
            line_trace(link, x, y, COLOURS[i % len(COLOURS)], dash=dash, mode="lines+markers", width=1.4)
        )
    untrained_jogs: dict[float, list[float]] = {}  # severity -> distance of each link's jog, cm
    for row in rows:
        if row["link"] in untrained and row.get("jog_from_healthy_cm") is not None:
            untrained_jogs.setdefault(row["severity"], []).append(row["jog_from_healthy_cm"])
    if untrained_jogs:
        means = [sum(values) / len(values) for values in untrained_jogs.values()]
        traces.append(
            line_trace("never hurt in training", list(untrained_jogs), means, "@muted", dash="dot", width=1.4)
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
