"""The section on training: the errors on training clips and held-out clips over the passes.

A pass goes over the training data once. It is divided into sections, and the errors are recorded after each
section.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from hobble.report.charts import Chart, ChartGroup, axis, line_trace, log_axis
from hobble.report.formats import format_number
from hobble.report.gather import ReportMaterial
from hobble.report.tables import Column, Table

# The network's output consists of blocks. The names of these blocks do not say that they belong to the path,
# so the page uses other names.
PATH_PARTS = {"position": "path position", "direction": "path direction"}


def passes_axis(material: ReportMaterial) -> list[float]:
    """The number of passes done at the end of each section: section 5 of 10 in pass 2 ends at 1.5."""
    passes, sections = material.history.get("pass", []), material.history.get("section", [])
    last = max((s for s in sections if s is not None), default=1) or 1
    # Passes and sections may be numbered from 1 or from 0.
    first_pass = min((p for p in passes if p is not None), default=1)
    start = 1 if first_pass >= 1 else 0
    first_section = min((s for s in sections if s is not None), default=1)
    per_pass = last if first_section >= 1 else last + 1
    ends = [(s if first_section >= 1 else s + 1) / per_pass for s in sections if s is not None]
    return [p - start + end for p, end in zip(passes, ends, strict=False) if p is not None]


def learning_curve(material: ReportMaterial) -> Chart:
    """The training error and, if clips were held out, the held-out error, on a logarithmic scale."""
    x, history = passes_axis(material), material.history
    traces = [line_trace("training", x, history.get("train_mse", []), "@muted")]
    held_out = any(v is not None for v in history.get("held_out_mse", ()))
    if held_out:
        traces.append(line_trace("held out", x, history["held_out_mse"], "@accent"))
    return Chart(
        "learning-curve",
        "Error over the passes",
        "Mean squared error of the standardised output, on a logarithmic scale. A network that always "
        "predicts the mean has error 1. The training error is measured with dropout"
        + (
            ", so it can be above the held-out error. If the held-out error still falls at the end, train "
            "longer. If it rises again, the network overfits."
            if held_out
            else ". No clips were held out, so there is no held-out error."
        ),
        traces,
        {
            "xaxis": axis("pass", rangemode="tozero"),
            "yaxis": log_axis("mean squared error", [v for t in traces for v in t["y"]]),
        },
    )


def block_curves(material: ReportMaterial) -> ChartGroup | None:
    """The held-out error of each block of the output, in small charts that share a scale.

    The block with the largest error comes first. None if there is no held-out error.
    """
    x, history = passes_axis(material), material.history
    whole = [v for v in history.get("held_out_mse", ()) if v is not None]
    blocks = {
        part_in_words(name.removeprefix("held_out_").removesuffix("_mse")): history[name]
        for name in material.blocks
        if any(v is not None for v in history[name])
    }
    if not blocks:
        return None
    last = {name: next(v for v in values[::-1] if v is not None) for name, values in blocks.items()}
    every = [v for values in blocks.values() for v in values] + whole
    charts = []
    for i, name in enumerate(sorted(blocks, key=lambda name: last[name], reverse=True)):
        traces = (
            [line_trace("whole output", x, history["held_out_mse"], "@muted", width=1.2)] if whole else []
        )
        traces.append(line_trace(name, x, blocks[name], "@accent"))
        layout = {
            "xaxis": axis("pass", rangemode="tozero"),
            "yaxis": log_axis("", every) | {"range": _log_span(every)},
            "showlegend": False,
        }
        charts.append(
            Chart(f"block-{i}", f"{name}, {format_number(last[name])}", "", traces, layout, height=190)
        )
    return ChartGroup(
        "block-curves",
        "Held-out error of each part of the output",
        "Each title gives the error at the end of training, and the largest comes first. The grey line is "
        "the error of the whole output. All charts have the same logarithmic scale.",
        charts,
    )


def _column_in_words(name: str) -> str:
    """A column of history.csv in words, such as "held out joint velocity"."""
    part = name.removeprefix("held_out_")
    return part_in_words(part) if part == name else f"held out {part_in_words(part)}"


def part_in_words(name: str) -> str:
    """A block of the output in words, such as "joint velocity" or "path position"."""
    return PATH_PARTS.get(name, name.replace("_", " "))


def _log_span(values: Sequence[float | None]) -> list[float]:
    """Lowest and highest exponent of ten on a logarithmic axis that shows the values, with a small margin."""
    powers = [math.log10(v) for v in values if v is not None and v > 0] or [0.0]
    margin = 0.05 * (max(powers) - min(powers)) + 0.02
    return [min(powers) - margin, max(powers) + margin]


def history_table(material: ReportMaterial) -> Table:
    """A row for each section (part of a pass) of training, as in history.csv."""
    names = list(material.history)
    counts = ("pass", "section", "samples")
    columns = [
        Column.count(name) if name in counts else Column.number(_column_in_words(name), 4) for name in names
    ]
    rows = list(zip(*material.history.values(), strict=False))
    return Table(f"{material.name}-history", columns, rows, "Every section (part of a pass) of training")
