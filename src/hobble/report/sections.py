"""The sections on training, terrain, and the time and disk space of each stage."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Chart,
    ChartGroup,
    Column,
    Table,
    Trace,
    axis,
    format_bytes,
    format_duration,
    format_number,
    line_trace,
    log_axis,
    log_range,
)

# The network's output consists of blocks. The names of these blocks do not say that they belong to the path,
# so the page uses other names.
PATH_PARTS = {"position": "path position", "direction": "path direction"}
MOST_CLIPS = 10  # at most this many clips have their ground profile drawn
# A profile is the height of the ground under the root over time. It shows at most this many rows of its clip.
# A row is a frame in a gait cycle.
MOST_ROWS = 900
FRAME_STEP = 3  # a profile has a point for every third frame


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


def learning_curve(material: ReportMaterial) -> Chart:
    """The training error and, if clips were held out, the held-out error, on a logarithmic scale."""
    history = material.history
    x = passes_axis(history)
    traces = [line_trace("training", x, history.get("train_mse", []), "@muted")]
    more = ". No clips were held out, so there is no held-out error."
    if any(v is not None for v in history.get("held_out_mse", ())):
        traces.append(line_trace("held out", x, history["held_out_mse"], "@accent"))
        more = (
            ", so it can be above the held-out error. If the held-out error still falls at the end, train "
            "longer. If it rises again, the network overfits."
        )
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
    return Chart("learning-curve", "Error over the passes", caption, traces, layout)


def block_curves(material: ReportMaterial) -> ChartGroup | None:
    """The held-out error of each block of the output, in small charts that share a scale.

    The block with the largest error comes first. None if there is no held-out error.
    """
    x, history = passes_axis(material.history), material.history
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
    powers = [math.log10(v) for v in every if v is not None and v > 0] or [0.0]
    margin = 0.05 * (max(powers) - min(powers)) + 0.02
    layout = {
        "xaxis": axis("pass", rangemode="tozero"),
        "yaxis": log_axis("", every) | {"range": [min(powers) - margin, max(powers) + margin]},
        "showlegend": False,
    }
    grey = [line_trace("whole output", x, history["held_out_mse"], "@muted", width=1.2)] if whole else []
    charts = []
    for i, name in enumerate(sorted(blocks, key=lambda name: last[name], reverse=True)):
        traces = [*grey, line_trace(name, x, blocks[name], "@accent")]
        title = f"{name}, {format_number(last[name])}"
        charts.append(Chart(f"block-{i}", title, "", traces, layout, height=190))
    caption = (
        "Each title gives the error at the end of training, and the largest comes first. The grey line is "
        "the error of the whole output. All charts have the same logarithmic scale."
    )
    return ChartGroup("block-curves", "Held-out error of each part of the output", caption, charts)


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


@dataclass(frozen=True)
class ShownFits:
    """The terrain fits of one clip with C gait cycles and 10 fits of each cycle, the best first.

    A fit is a ground that suits a cycle. foot_error: (C, 10, 2) mean and largest distance of a foot in
    contact from it, cm. error: (C, 10) fitting error, cm². frame: (S,) frames of the profile, at 60 Hz.
    profile: (S, K) height of the ground under the root in the K best fits of each frame, cm; all frames have
    at least K fits. A clip on flat ground has only one fit.
    """

    clip: str
    foot_error: Array = field(repr=False)
    error: Array = field(repr=False)
    frame: Array = field(repr=False)
    profile: Array = field(repr=False)


def read_fits(path: str | Path) -> ShownFits:
    """Read `terrain/clips/<clip>.npz`. Raises InputError if an array is missing or lengths disagree.

    In the file, `fits` is the number of fits of each row, and `heights` (sum of fits, 36) has the heights of
    the ground around the root for each of them.
    """
    try:
        file = ArrayParts(path)
        fits, frame = file.read_whole("fits"), file.read_rows("frame", 0, MOST_ROWS)
        fewest = int(fits.min()) if len(fits) else 1
        first = (np.cumsum(fits) - fits)[:MOST_ROWS:FRAME_STEP]  # row of each frame's first fit in `heights`
        heights = file.read_rows("heights", 0, int(first[-1]) + fewest if len(fits) else 0)
        # Columns: heights along the path on its left, on it, and on its right. The middle one is at the root.
        present = heights.shape[1] // 3 + heights.shape[1] // 6
        profile = heights[:, present][first[:, None] + np.arange(fewest)] if len(fits) else np.zeros((0, 1))
        errors = file.read_whole("foot_error"), file.read_whole("error")
        return ShownFits(Path(path).stem, *errors, frame[::FRAME_STEP], profile)
    except (ValueError, IndexError) as error:
        raise InputError(
            path, f"not the terrain of a clip ({error})", fix="Delete the file; the workflow makes it again."
        ) from error


def terrain_section(paths: Iterable[str | Path]) -> dict[str, Any]:
    """Charts and a table of the fits. Clips on flat ground are left out. paths: files of terrain fits."""
    uneven = [fit for fit in map(read_fits, paths) if fit.profile.shape[1] > 1 and len(fit.profile)]
    if not uneven:
        return {"charts": [], "table": None}
    return {"charts": [profile_chart(uneven), distance_chart(uneven)], "table": fit_table(uneven)}


def profile_chart(fits_of_clips: list[ShownFits]) -> Chart:
    """Height of the ground under the root over time, for each of the first MOST_CLIPS clips and each fit."""
    caption = (
        "Several grounds are fitted to each gait cycle, and the network is trained on all of them. The lines "
        "are the heights of these grounds under the root. They agree where a foot is on the ground and "
        "differ elsewhere. Each cycle has its own fits, so the lines may jump from one cycle to the next."
    )
    return Chart(
        "terrain-profiles",
        "The ground under the path",
        caption,
        layout={"xaxis": axis("seconds"), "yaxis": axis("height, cm")},
        choose="Clip",
        options={fit.clip: _profile_traces(fit) for fit in fits_of_clips[:MOST_CLIPS]},
    )


def _profile_traces(fit: ShownFits) -> list[Trace]:
    """A line for each fit. Where one cycle does not follow the other, None interrupts the line."""
    gaps, count = np.flatnonzero(np.diff(fit.frame) > FRAME_STEP) + 1, fit.profile.shape[1]
    seconds = np.insert(np.round(fit.frame / 60, 2), gaps, 0).tolist()
    traces = []
    for k in range(count - 1, -1, -1):
        heights = np.insert(np.round(fit.profile[:, k].astype(float), 1), gaps, np.nan).tolist()
        points = [(t, h) if math.isfinite(h) else (None, None) for t, h in zip(seconds, heights, strict=True)]
        colour, width = ("@accent", 2.2) if k == 0 else ("@muted", 1)
        name = "best fit" if k == 0 else f"fits 2 to {count}"
        more: dict[str, Any] = {"legendgroup": name, "showlegend": k in (0, 1), "width": width}
        traces.append(line_trace(name, [t for t, _ in points], [h for _, h in points], colour, **more))
    return traces


def distance_chart(fits_of_clips: list[ShownFits]) -> Chart:
    """Distance of feet in contact from the fitted ground, for each clip."""
    style = {"type": "box", "orientation": "h", "boxpoints": False, "fillcolor": "@accent-wash"}
    style["line"] = {"color": "@accent", "width": 1.4}
    traces: list[Trace] = [
        {"name": fit.clip, "x": np.round(fit.foot_error[:, :, 0].ravel(), 3).tolist(), **style}
        for fit in fits_of_clips[::-1]
    ]
    layout = {
        "xaxis": axis("cm", rangemode="tozero"),
        "yaxis": {"type": "category", "automargin": True},
        "showlegend": False,
    }
    caption = (
        "The fitted ground was corrected to meet the feet. The chart shows the mean distance that remains "
        "between the ground and a foot in contact. Each box covers the cycles and fits of a clip. A distance "
        "of less than a centimetre is invisible."
    )
    height = max(260, 110 + 26 * len(fits_of_clips))
    return Chart("terrain-feet", "Distance of the feet from the ground", caption, traces, layout, height)


def fit_table(fits_of_clips: list[ShownFits]) -> Table:
    """The errors and distances of the fits, with a row for each clip."""
    columns = [
        Column("clip"),
        Column.count("cycles"),
        Column.number("mean fitting error of the best ground of each cycle, cm²"),
        Column.number("mean fitting error of the worst ground used, cm²"),
        Column.number("mean distance of a foot, cm"),
        Column.number("largest distance, cm"),
    ]
    rows = []
    for fit in fits_of_clips:
        errors = fit.error[:, 0].mean(), fit.error[:, -1].mean()
        distances = fit.foot_error[:, :, 0].mean(), fit.foot_error[:, :, 1].max()
        rows.append([fit.clip, len(fit.error), *map(float, (*errors, *distances))])
    return Table("terrain", columns, rows)


def stage_charts(material: ReportMaterial) -> list[Chart]:
    """Two charts: the seconds and the bytes of each stage."""
    # Plotly draws the first category at the bottom, so the order is reversed.
    stages = list(material.pipeline.get("stages") or ())[::-1]
    names = [stage["stage"] for stage in stages]
    charts = []
    for key, title, label, as_text, caption in (
        ("seconds", "Time of each stage", "seconds, sum over all jobs", format_duration,
         "The sum over all jobs of a stage. Jobs run in parallel, so the run itself takes less time. The "
         "scale is logarithmic."),
        ("bytes", "Size of each stage", "bytes", format_bytes,
         "The files that each stage writes. The scale is logarithmic."),
    ):  # fmt: skip
        values = [stage.get(key) or 0 for stage in stages]
        trace = {
            "type": "scatter",
            "mode": "markers+text",
            "y": names,
            "x": [value or None for value in values],
            "text": [f"  {as_text(value)}" for value in values],
            "textposition": "middle right",
            "textfont": {"size": 11.5, "color": "@soft"},
            "marker": {"color": "@accent", "size": 10},
            "hovertemplate": "%{y}: %{text}<extra></extra>",
            "cliponaxis": False,
        }
        layout = {**stage_axes(label, values, names), "showlegend": False}
        charts.append(Chart(f"stage-{key}", title, caption, [trace], layout, 80 + 30 * len(names)))
    return charts


def stage_axes(label: str, values: Iterable[float], names: Sequence[str]) -> dict[str, Any]:
    """The axes of a chart of stages. label: of the x axis. names: of the stages, from bottom to top."""
    return {
        "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
        "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": names},
    }


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
