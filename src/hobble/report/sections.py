"""The sections on training, terrain, and the time and disk space of each stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Chart,
    Column,
    Table,
    axis,
    dot_trace,
    format_bytes,
    format_duration,
    format_number,
    line_trace,
    log_axis,
    log_range,
    ordered_axis,
)

# The network's output consists of blocks. The names of these blocks do not say that they belong to the path,
# so the page uses other names.
PATH_PARTS = {"position": "path position", "direction": "path direction"}


def passes_axis(history: Mapping[str, Sequence[float | None]]) -> list[float]:
    """How many passes were done at the end of each section of training: section 5 of 10 in pass 2 is at 1.5.

    A pass goes over the training data once, and is divided into sections. history: column of history.csv ->
    values. Passes and sections may be numbered from 1 or from 0.
    """
    passes, sections = history.get("pass", ()), [s for s in history.get("section", ()) if s is not None]
    first_pass = min((p for p in passes if p is not None), default=1)
    first, last = min(sections, default=1), max(sections, default=1) or 1
    start, shift = min(first_pass, 1), 0 if first >= 1 else 1
    return [
        p - start + (s + shift) / (last + shift)
        for p, s in zip(passes, sections, strict=False)
        if p is not None
    ]


def published_curve(published: Mapping[str, Any], configuration: str) -> tuple[list[float], list[float]]:
    """(passes, mean squared errors) of Tables A.6 to A.9 of Segerstedt (2021); empty if none has the network.

    He counts each of 20 passes a hundred times: ten sections, ten times each. Every tenth of these "epochs"
    is printed. The curve of HOLDEN-XT begins after the 20 passes of HOLDEN.
    """
    errors = published["curves"].get(configuration, [])
    before = 20 if configuration == "holden-xt" else 0
    return [before + (n + 1) / 10 for n in range(len(errors))], errors


BLOCK_COLOURS = ("@g1", "@g2", "@g3", "@g4", "@g5", "@g0", "@predicted")


def learning_curve(material: ReportMaterial) -> Chart:
    """The training error and, if clips were held out, the held-out error, on a logarithmic scale.

    Thin lines: the held-out error of each block of the output, the one with the largest error first.
    """
    history = material.history
    x = passes_axis(history)
    traces = [line_trace("training", x, history.get("train_mse", []), "@muted")]
    more = ". No clips were held out, so there is no held-out error."
    if any(v is not None for v in history.get("held_out_mse", ())):
        traces.append(line_trace("held out", x, history["held_out_mse"], "@accent", width=3))
        more = (
            ", so it can be above the held-out error. If the held-out error still falls at the end, train "
            "longer. If it rises again, the network overfits. Thin lines: held-out error of each part of the "
            "output, with its value at the end of training."
        )
    last = {
        name: next(v for v in history[name][::-1] if v is not None)
        for name in material.blocks
        if any(v is not None for v in history[name])
    }
    for i, name in enumerate(sorted(last, key=lambda name: last[name], reverse=True)):
        words = part_in_words(name.removeprefix("held_out_").removesuffix("_mse"))
        colour = BLOCK_COLOURS[i % len(BLOCK_COLOURS)]
        label = f"{words}, {format_number(last[name])}"
        traces.append(line_trace(label, x, history[name], colour, width=1.1))
    caption = (
        "Mean squared error of the standardised output, on a logarithmic scale. A network that always "
        f"predicts the mean has error 1. The training error is measured with dropout{more}"
    )
    passes, errors_of_his = published_curve(material.published, material.name)
    if passes:
        traces.append(line_trace("published", passes, errors_of_his, "@g2", dash="dot", width=1.4))
        caption += " Dotted: the training error of Segerstedt (2021), on other data."
    errors = log_axis("mean squared error", [v for t in traces for v in t["y"]])
    layout = {"xaxis": axis("pass", rangemode="tozero"), "yaxis": errors}
    return Chart("learning-curve", "Error over the passes", caption, traces, layout, 440)


def part_in_words(name: str) -> str:
    """A block of the output in words, such as "joint velocity" or "path position"."""
    return PATH_PARTS.get(name, name.replace("_", " "))


def history_table(material: ReportMaterial) -> Table:
    """A row for each section (part of a pass) of training, as in history.csv."""

    def column(name: str) -> Column:
        if name in ("pass", "section", "samples"):
            return Column.count(name)
        held_out = "held out " if name.startswith("held_out_") else ""
        return Column.number(held_out + part_in_words(name.removeprefix("held_out_")), 4)

    rows = list(zip(*material.history.values(), strict=False))
    title = "Every section (part of a pass) of training"
    return Table(f"{material.name}-history", [column(name) for name in material.history], rows, title)


def fit_table(paths: Iterable[str | Path]) -> Table | None:
    """The errors of the terrain fits, with a row for each clip on uneven ground; None without any.

    paths: files `terrain/clips/<clip>.npz`. A fit is a ground that suits a gait cycle. C cycles of a clip
    have K fits each, the best first; a clip on flat ground has only one. Raises InputError if an array is
    missing.
    """
    columns = [
        Column("clip"),
        Column.count("cycles"),
        Column.number("mean distance of a foot, cm"),
        Column.number("largest distance, cm"),
        Column.number("mean fitting error of the best ground of each cycle, cm²"),
        Column.number("mean fitting error of the worst ground used, cm²"),
    ]
    rows: list[list[Any]] = []
    for path in paths:
        try:
            # (C, K, 2) mean and largest distance of a foot in contact, cm; (C, K) fitting error, cm².
            feet, error = load_npz(path, ("foot_error", "error")).values()
            if error.shape[1] > 1 and len(error):
                distances = float(feet[:, :, 0].mean()), float(feet[:, :, 1].max())
                errors = float(error[:, 0].mean()), float(error[:, -1].mean())
                rows.append([Path(path).stem, len(error), *distances, *errors])
        except (ValueError, IndexError) as problem:
            fix = "Delete the file; the workflow makes it again."
            raise InputError(path, f"not the terrain of a clip ({problem})", fix=fix) from problem
    rows.sort(key=lambda row: -row[2])
    return Table("terrain", columns, rows, "Distance of the feet from the fitted ground") if rows else None


def stage_charts(
    stages: Mapping[str, Sequence[Mapping[str, Any]]], prefix: str, caption: str, colours: Mapping[str, str]
) -> list[Chart]:
    """Two charts: the seconds and the bytes of each stage.

    stages: configuration -> its stages, from pipeline.json. prefix: of the charts' names. caption: a sentence
    on the times. colours: configuration -> colour.
    """
    # Plotly draws the first category at the bottom, so the order is reversed.
    names = list(dict.fromkeys(stage["stage"] for each in stages.values() for stage in each))[::-1]
    charts = []
    for key, title, label, as_text, words in (
        ("seconds", "Time of each stage", "seconds, sum over all jobs", format_duration, f"{caption} "),
        ("bytes", "Size of each stage", "bytes on disk", format_bytes, "The files that each stage writes. "),
    ):
        traces, values = [], []
        for name, each in stages.items():
            rows = [stage for stage in each if stage.get(key)]
            x, y = [stage[key] for stage in rows], [stage["stage"] for stage in rows]
            values += x
            trace = dot_trace(name, x, y, colours[name], "%{y}: %{text}") | {"cliponaxis": False}
            trace["text"] = [f"  {as_text(value)}" for value in x]
            if len(stages) == 1:
                trace |= {"mode": "markers+text", "textposition": "middle right"}
                trace["textfont"] = {"size": 11.5, "color": "@soft"}
            traces.append(trace)
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
            "yaxis": ordered_axis(names),
            "showlegend": len(stages) > 1,
        }
        height = (80 if len(stages) == 1 else 110) + 31 * len(names)
        text = f"{words}The scale is logarithmic."
        charts.append(Chart(f"{prefix}-{key}", title, text, traces, layout, height))
    return charts


def stage_table(material: ReportMaterial) -> Table:
    """A table of times and sizes: a row for each stage.

    It has columns of published times and sizes if there are any for this configuration.
    """
    columns = {
        "stage": Column("stage"),
        "jobs": Column.count("jobs"),
        "seconds": Column.duration("time of all jobs"),
        "longest": Column.duration("longest job"),
        "max_rss_mb": Column("peak memory", lambda v: f"{format_number(v)} MB", "n"),
        "files": Column.count("files"),
        "bytes": Column.size("size"),
    }
    published = {
        row["stage"]: {"published_seconds": row.get("seconds"), "published_bytes": row.get("bytes")}
        for row in material.published["stages"]
        if row["configuration"] == material.name
    }
    if published:
        columns |= {"published_seconds": Column.duration("published time")}
        columns |= {"published_bytes": Column.size("published size")}
    stages = material.pipeline.get("stages") or ()
    records = [{**stage, **published.get(stage["stage"], {})} for stage in stages]
    return Table.of(f"{material.name}-pipeline", columns, records)
