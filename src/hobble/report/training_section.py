"""The section on training: training and held-out error over the passes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hobble.report.charts import Chart, ChartGroup, axis, line, log_axis
from hobble.report.formats import number
from hobble.report.gather import ReportMaterial
from hobble.report.tables import Column, Table

# Block of the output -> its name on the page, if the block's name does not say that it belongs to the path.
PATH_PARTS = {"position": "path position", "direction": "path direction"}


def passes_axis(material: ReportMaterial) -> list[float]:
    """The passes done at the end of each section (part of a pass): section 10 of 10 in pass 1 ends at 1.0."""
    passes, sections = material.history.get("pass", []), material.history.get("section", [])
    last = max((s for s in sections if s is not None), default=1) or 1
    # Passes and sections may be numbered from 1 or from 0.
    first = min((p for p in passes if p is not None), default=1)
    start = 1 if first >= 1 else 0
    low = min((s for s in sections if s is not None), default=1)
    per_pass = last if low >= 1 else last + 1
    ends = [(s if low >= 1 else s + 1) / per_pass for s in sections if s is not None]
    return [p - start + end for p, end in zip(passes, ends, strict=False) if p is not None]


def learning_curve(material: ReportMaterial) -> Chart:
    """Training and held-out error, on a logarithmic scale."""
    x, history = passes_axis(material), material.history
    traces = [line("training", x, history.get("train_mse", []), "@muted")]
    held_out = any(v is not None for v in history.get("held_out_mse", ()))
    if held_out:
        traces.append(line("held out", x, history["held_out_mse"], "@accent"))
    return Chart(
        "learning-curve",
        "Error over the passes",
        "Mean squared error of the standardised output, on a logarithmic scale. A network that always "
        "predicts the mean has error 1. The training error is measured with dropout"
        + (
            ", so it can be above the held-out error. If the held-out line still falls, train longer. If it "
            "rises again, the network overfits."
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
    """The held-out error of each block of the output: small charts with one scale, largest error first."""
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
        traces = [line("whole output", x, history["held_out_mse"], "@muted", width=1.2)] if whole else []
        traces.append(line(name, x, blocks[name], "@accent"))
        layout = {
            "xaxis": axis("pass", rangemode="tozero"),
            "yaxis": log_axis("", every) | {"range": _log_span(every)},
            "showlegend": False,
        }
        charts.append(Chart(f"block-{i}", f"{name}, {number(last[name])}", "", traces, layout, height=190))
    return ChartGroup(
        "block-curves",
        "Held-out error of each part of the output",
        "The last value of the error is in each title, and the largest comes first. Grey is the error of the "
        "whole output. All charts have the same logarithmic scale.",
        charts,
    )


def _column_in_words(name: str) -> str:
    part = name.removeprefix("held_out_")
    return part_in_words(part) if part == name else f"held out {part_in_words(part)}"


def part_in_words(name: str) -> str:
    """A block of the output in words, such as "joint velocity" or "path position"."""
    return PATH_PARTS.get(name, name.replace("_", " "))


def _log_span(values: Sequence[float | None]) -> list[float]:
    """Range of a logarithmic axis around the values, as exponents of ten, with a small margin."""
    powers = [math.log10(v) for v in values if v is not None and v > 0] or [0.0]
    room = 0.05 * (max(powers) - min(powers)) + 0.02
    return [min(powers) - room, max(powers) + room]


def history_table(material: ReportMaterial) -> Table:
    """A row for each section (part of a pass) of training, as in history.csv."""
    names = list(material.history)
    counts = ("pass", "section", "samples")
    columns = [
        Column.count(name) if name in counts else Column.number(_column_in_words(name), 4) for name in names
    ]
    rows = list(zip(*material.history.values(), strict=False))
    return Table(f"{material.name}-history", columns, rows, "Every section (part of a pass) of training")
