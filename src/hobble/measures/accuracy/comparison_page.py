"""Shows the errors of several configurations side by side.

The error of a joint is its relative error (eq. 3.1 of Segerstedt 2021): the distance between its predicted
and its captured position, divided by its distance from the root. compare.json has it as a fraction, the page
shows it in %.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

from hobble.measures.accuracy.page import quantiles
from hobble.report.compare_page import difference_table
from hobble.report.parts import (
    SPLITS,
    Chart,
    Column,
    Compared,
    OverviewColumn,
    PageSection,
    SectionPart,
    Trace,
    axis,
    configuration_colours,
    configuration_names,
    dot_trace,
)

# The difference between two configurations is the difference of their mean errors, divided by standard
# deviations (sd; eq. 3.2 of Segerstedt 2021). compare.json has it twice, with different standard deviations.
# Key of the difference -> what it is divided by, for the menu of the chart.
DEVIATIONS = {"difference_of_means": "sd of the means of clips", "difference": "sd of single frames"}


def section(compared: Compared) -> PageSection:
    """The spread of the errors, differences between configurations, and errors of single clips."""
    # The first argument of each part is its place in the section, from 0 (top) to 100 (end).
    return PageSection(
        "accuracy",
        [
            SectionPart(10, error_boxes(compared)),
            SectionPart(30, difference_map(compared)),
            SectionPart(40, difference_table(compared)),
            SectionPart(50, clip_dots(compared), tall=True),
        ],
        title="Accuracy",
        order=10,
        long=True,
    )


def columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Columns for the table of configurations: the error on each split, and the number of measured joints."""
    entries = {entry["configuration"]: entry for entry in compared["accuracy"]}
    for at, split, label in ((10, "held_out", "held-out error"), (20, "train", "training error")):
        values = {name: entry[split]["mean"] for name, entry in entries.items()}
        yield OverviewColumn(at, Column(label, _percent, "n"), values)
    yield OverviewColumn(
        70, Column.count("joints"), {name: entry["joints"] for name, entry in entries.items()}
    )


def error_boxes(compared: Compared) -> Chart | None:
    """A box for each configuration: the spread of its error over all frames of a split. A menu selects it."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLITS.items():
        traces: list[Trace] = []
        for entry in compared["accuracy"]:
            percentiles = quantiles(entry[split])
            if percentiles is None:
                continue
            # In %. Each is a list, because plotly draws a box for each entry.
            low, q1, median, q3, high = ([100 * value] for value in percentiles)
            colour = configuration_colours(compared)[entry["configuration"]]
            traces.append(
                {
                    "type": "box",
                    "name": entry["configuration"],
                    "x": [entry["configuration"]],
                    "lowerfence": low,
                    "q1": q1,
                    "median": median,
                    "q3": q3,
                    "upperfence": high,
                    "mean": [100 * entry[split]["mean"]],
                    "boxmean": True,
                    "marker": {"color": colour},
                    "line": {"width": 1.6, "color": colour},
                }
            )
        if traces:
            options[label] = traces
    published = [
        row
        for row in compared["published"]["accuracy"]
        if row["configuration"] in configuration_names(compared)
    ]
    if not options:
        return None
    for traces in options.values():
        if published:
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": "published mean",
                    "x": [row["configuration"] for row in published],
                    "y": [100 * row["mean"] for row in published],
                    "marker": {"symbol": "diamond-open", "size": 10, "color": "@ink"},
                    "hovertemplate": "%{x}: %{y:.2f} % published<extra></extra>",
                }
            )
    return Chart(
        "compare-boxes",
        "Spread of the error",
        "Each box holds the middle half of the relative errors of all frames (eq. 3.1 of Segerstedt). The "
        "solid line is the median, the dashed line the mean. Whiskers reach from the 5th to the 95th "
        "percentile. Diamonds are published means, measured on other data.",
        layout={"yaxis": axis("relative error, %", rangemode="tozero"), "showlegend": False},
        height=400,
        choose="Clips",
        options=options,
    )


def clip_dots(compared: Compared) -> Chart | None:
    """The mean error of every clip, a dot for each configuration."""
    clips = {(row["split"], row["clip"]) for entry in compared["accuracy"] for row in entry["clips"]}
    # Plotly puts the first clip at the bottom, so held-out clips come last.
    order = [clip for _, clip in sorted(clips, key=lambda pair: (pair[0] == "held_out", pair[1]))]
    if not order:
        return None
    traces = []
    for entry in compared["accuracy"]:
        rows = [row for row in entry["clips"] if row.get("mean") is not None]
        traces.append(
            dot_trace(
                entry["configuration"],
                [100 * row["mean"] for row in rows],
                [row["clip"] for row in rows],
                configuration_colours(compared)[entry["configuration"]],
                "%{y}: %{x:.2f} %",
            )
        )
    layout = {
        "xaxis": axis("relative error, %", rangemode="tozero"),
        "yaxis": {"categoryorder": "array", "categoryarray": order, "automargin": True, "type": "category"},
    }
    caption = "Each row is a clip, with one dot for each configuration. Held-out clips are at the top."
    return Chart("compare-clips", "Error of each clip", caption, traces, layout, 130 + 19 * len(order))


def difference_map(compared: Compared) -> Chart | None:
    """The difference of each two configurations. A menu selects the split and the kind of deviation."""
    configurations, options = configuration_names(compared), {}
    for (split, label), (key, kind) in product(SPLITS.items(), DEVIATIONS.items()):
        values = {(r["a"], r["b"]): r[key] for r in compared["difference"] if r["over"] == split}
        if all(value is None for value in values.values()):
            continue
        # compare.json has each pair in one order only, (a, b) or (b, a).
        cells = [[values.get((a, b), values.get((b, a))) for b in configurations] for a in configurations]
        options[f"{label}, {kind}"] = [
            {
                "type": "heatmap",
                "x": configurations,
                "y": configurations,
                "z": cells,
                "colorscale": [[0, "@sunken"], [1, "@accent"]],
                "zmin": 0,
                "texttemplate": "%{z:.2f}",
                "xgap": 3,
                "ygap": 3,
                "showscale": False,
                "hovertemplate": "%{y} and %{x}: %{z:.3f}<extra></extra>",
            }
        ]
    if not options:
        return None
    layout = {
        "xaxis": {"type": "category"},
        "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
    }
    return Chart(
        "compare-difference",
        "Difference between two configurations",
        "Eq. 3.2 of Segerstedt: twice the difference of the two means, divided by the sum of the two "
        "standard deviations. Segerstedt uses the standard deviation of the clips' means. The standard "
        "deviation of single frames is several times as large. A value of 1 says that the means are one "
        "standard deviation apart. Our rule of thumb: differences under 0.2 are too small to matter.",
        layout=layout,
        height=max(240, 90 + 42 * len(configurations)),
        choose="Clips and deviation",
        options=options,
    )


def _percent(value: Any) -> str:
    return f"{100 * float(value):.2f} %"
