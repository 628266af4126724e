"""How well the next pose is predicted, clip by clip."""

from __future__ import annotations

from typing import Any

from hobble.report.charts import Chart, axis, line, log_axis, mark
from hobble.report.findings import published
from hobble.report.gather import Material
from hobble.report.tables import Column, Table

COLOURS = {"train": "@muted", "held_out": "@accent"}
NAMES = {"train": "training", "held_out": "held out"}
QUANTILES = ("p05", "p25", "p50", "p75", "p95")


def _rows(material: Material) -> list[dict[str, Any]]:
    rows = [row for row in material.accuracy.get("clips", ()) if row.get("mean") is not None]
    return sorted(rows, key=lambda row: (row["split"] != "held_out", row["mean"]))


def _height(count: int) -> int:
    return max(260, 110 + 21 * count)


def clip_bars(material: Material) -> Chart | None:
    """Mean relative error of each clip, whiskers of one standard deviation, published means as lines."""
    rows = _rows(material)[::-1]
    if not rows:
        return None
    traces = []
    for split in ("held_out", "train"):
        chosen = [row for row in rows if row["split"] == split]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": NAMES[split],
                "y": [row["clip"] for row in chosen],
                "x": [100 * row["mean"] for row in chosen],
                "error_x": {
                    "type": "data",
                    "symmetric": False,
                    "array": [100 * (row.get("sd") or 0) for row in chosen],
                    "arrayminus": [0 for _ in chosen],
                    "color": "@faint",
                    "thickness": 1,
                    "width": 2,
                },
                "marker": {"color": COLOURS[split]},
                "hovertemplate": "%{y}: %{x:.2f} %<extra></extra>",
            }
        )
    shapes, notes = [], []
    theirs = published(material, "accuracy")
    if theirs:
        shape, note = mark(100 * theirs["mean"], f"{theirs['label']} as published")
        shapes, notes = [shape], [note]
    order = [row["clip"] for row in rows]
    return Chart(
        "accuracy-clips",
        "Error of each clip",
        "Bars: mean over frames and joints of the distance between predicted and true joint position, as a "
        "share of the joint's distance from the root (eq. 3.1 of Segerstedt). Whiskers reach one standard "
        "deviation further. Held-out clips, which the network never saw, stand first.",
        traces,
        {
            "xaxis": axis("relative error, %", rangemode="tozero"),
            "yaxis": {"categoryorder": "array", "categoryarray": order, "automargin": True},
            "shapes": shapes,
            "annotations": notes,
            "bargap": 0.35,
            "barmode": "overlay",
        },
        height=_height(len(rows)),
    )


def clip_boxes(material: Material) -> Chart | None:
    """Quantiles of the error within each clip, where the evaluation gives them."""
    rows = [row for row in _rows(material)[::-1] if quantiles(row)]
    if not rows:
        return None
    traces = []
    for split in ("held_out", "train"):
        chosen = [row for row in rows if row["split"] == split]
        if not chosen:
            continue
        values = [[100 * v for v in quantiles(row)] for row in chosen]  # type: ignore[union-attr]
        low, q1, median, q3, high = (list(column) for column in zip(*values, strict=True))
        traces.append(
            {
                "type": "box",
                "orientation": "h",
                "name": NAMES[split],
                "y": [row["clip"] for row in chosen],
                "lowerfence": low,
                "q1": q1,
                "median": median,
                "q3": q3,
                "upperfence": high,
                "mean": [100 * row["mean"] for row in chosen],
                "marker": {"color": COLOURS[split]},
                "line": {"width": 1.4, "color": COLOURS[split] if split == "held_out" else "@faint"},
                "fillcolor": "@accent-wash" if split == "held_out" else "@sunken",
            }
        )
    return Chart(
        "accuracy-boxes",
        "Spread within each clip",
        "Boxes hold the middle half of the errors of a clip, the line in them is the median; whiskers reach "
        "from the 5th to the 95th percentile. A long whisker with a low box means a few hard moments in an "
        "easy clip.",
        traces,
        {
            "xaxis": axis("relative error, %", rangemode="tozero"),
            "yaxis": {
                "categoryorder": "array",
                "categoryarray": [r["clip"] for r in rows],
                "automargin": True,
            },
            "boxmode": "overlay",
        },
        height=_height(len(rows)),
    )


def rollout_chart(material: Material) -> Chart | None:
    """How the error grows when the figure is fed its own pose."""
    traces = []
    for split in ("held_out", "train"):
        rows = [
            (entry["length"], entry[split]["position_error_cm"])
            for entry in material.rollouts.get("lengths", ())
            if (entry.get(split) or {}).get("position_error_cm") is not None
        ]
        if rows:
            x, y = zip(*rows, strict=True)
            traces.append(line(NAMES[split], x, y, COLOURS[split], mode="lines+markers"))
    if not traces:
        return None
    return Chart(
        "rollouts",
        "Fed its own pose",
        "Mean distance of a joint from the captured one when the network goes on from what it predicted "
        "itself, as at run time, over roll-outs of so many frames. A line that flattens is a figure that "
        "keeps to its feet; 60 frames are a second.",
        traces,
        {
            "xaxis": log_axis("frames", [x for trace in traces for x in trace["x"]]),
            "yaxis": axis("cm a joint", rangemode="tozero"),
        },
    )


def quantiles(row: dict[str, Any]) -> list[float] | None:
    """The 5th, 25th, 50th, 75th and 95th percentile of a clip's error, or None."""
    found = [row[key] for key in QUANTILES if row.get(key) is not None]
    return found if len(found) == len(QUANTILES) else None


def accuracy_table(material: Material) -> Table:
    """A row per clip."""
    columns = [
        Column("clip"),
        Column("split", lambda value: NAMES.get(value, value)),
        Column.count("frames"),
        Column.number("mean"),
        Column.number("sd"),
        Column.number("position error, cm"),
    ]
    rows = [
        [r["clip"], r["split"], r.get("frames"), r["mean"], r.get("sd"), r.get("position_error_cm")]
        for r in _rows(material)
    ]
    return Table(f"{material.name}-accuracy", columns, rows)


def beside_published(material: Material) -> Table:
    """Our two splits with the published means under them."""
    rows: list[list[Any]] = []
    for split in ("held_out", "train"):
        part = material.accuracy.get(split) or {}
        if part.get("mean") is not None:
            what = f"{material.name}, {NAMES[split]} clips"
            rows.append([what, part["mean"], part.get("sd"), part.get("position_error_cm"), "this report"])
    sources = material.published["sources"]
    for entry in material.published["accuracy"]:
        rows.append([entry["label"], entry["mean"], None, None, sources[entry["source"]]])
    columns = [
        Column("network"),
        Column.number("mean"),
        Column.number("sd"),
        Column.number("position error, cm"),
        Column("source", kind="long"),
    ]
    return Table(f"{material.name}-published", columns, rows, "Beside the published figures")
