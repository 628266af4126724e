"""How the network learnt: training and held-out error over the passes."""

from __future__ import annotations

from hobble.report.charts import Chart, axis, line, log_axis
from hobble.report.gather import Material
from hobble.report.tables import Column, Table

BLOCK_COLOURS = ("@g1", "@g2", "@g3", "@g4", "@g5", "@g0")


def passes_axis(material: Material) -> list[float]:
    """Where each section ends, in passes: pass 1 section 10 of 10 ends at 1.0."""
    passes, sections = material.history.get("pass", []), material.history.get("section", [])
    most = max((s for s in sections if s is not None), default=1) or 1
    first = min((p for p in passes if p is not None), default=1)
    start = 1 if first >= 1 else 0
    low = min((s for s in sections if s is not None), default=1)
    per_pass = most if low >= 1 else most + 1
    ends = [(s if low >= 1 else s + 1) / per_pass for s in sections if s is not None]
    return [p - start + end for p, end in zip(passes, ends, strict=False) if p is not None]


def learning_curve(material: Material) -> Chart:
    """Training and held-out error, on a logarithmic scale."""
    x, history = passes_axis(material), material.history
    traces = [line("training", x, history.get("train_mse", []), "@muted")]
    if any(v is not None for v in history.get("held_out_mse", ())):
        traces.append(line("held out", x, history["held_out_mse"], "@accent"))
    return Chart(
        "learning-curve",
        "Error over the passes",
        "Mean squared error of the standardised output, on a logarithmic scale: 1 would be guessing the "
        "mean. Training error is taken under dropout, so it can lie above the held-out error; what counts "
        "is whether the held-out line still falls, is flat, or rises again.",
        traces,
        {
            "xaxis": axis("pass", rangemode="tozero"),
            "yaxis": log_axis("mean squared error", [v for t in traces for v in t["y"]]),
        },
    )


def block_curves(material: Material) -> Chart | None:
    """The held-out error of each block of Y."""
    x, traces = passes_axis(material), []
    for i, block in enumerate(material.blocks):
        values = material.history[block]
        if any(v is not None for v in values):
            label = block.removeprefix("held_out_").removesuffix("_mse").replace("_", " ")
            dash = "solid" if i < len(BLOCK_COLOURS) else "dash"
            colour = BLOCK_COLOURS[i % len(BLOCK_COLOURS)]
            traces.append(line(label, x, values, colour, width=1.6, dash=dash))
    if not traces:
        return None
    return Chart(
        "block-curves",
        "Held-out error by what is predicted",
        "The same error for each part of the output: the parts that stay high are those the network finds "
        "hardest. Click a name in the legend to hide its line, twice to see it alone.",
        traces,
        {
            "xaxis": axis("pass", rangemode="tozero"),
            "yaxis": log_axis("mean squared error", [v for t in traces for v in t["y"]]),
        },
        height=380,
    )


def history_table(material: Material) -> Table:
    """Every section of training, as in history.csv."""
    names = list(material.history)
    whole = ("pass", "section", "samples")
    columns = [
        Column.count(name) if name in whole else Column.number(name.replace("_", " "), 4) for name in names
    ]
    rows = list(zip(*material.history.values(), strict=False))
    return Table(f"{material.name}-history", columns, rows, "Every section of training")
