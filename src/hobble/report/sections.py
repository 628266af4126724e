"""The sections on training, terrain, and the time and disk space of each stage."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

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
)

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


MOST_CLIPS = 10  # at most this many clips have their ground profile drawn
# A profile is the height of the ground under the root over time. It shows at most this many rows of its clip.
# A row is a frame in a gait cycle.
MOST_ROWS = 900
FRAME_STEP = 3  # a profile has a point for every third frame


@dataclass(frozen=True)
class ShownFits:
    """The terrain fits of one clip with C gait cycles and 10 fits of each cycle, the best first.

    foot_error: (C, 10, 2) mean and largest distance of a foot in contact from the fitted ground, cm. error:
    (C, 10) fitting error, cm². frame: (S,) frames of the profile, at 60 Hz. profile: (S, K) height of the
    ground under the root in the K best fits of each frame, cm. All frames have at least K fits.
    """

    clip: str
    foot_error: Array = field(repr=False)
    error: Array = field(repr=False)
    frame: Array = field(repr=False)
    profile: Array = field(repr=False)

    @property
    def is_flat(self) -> bool:
        """Whether the clip is on flat ground. Then its cycles have only one fit."""
        return self.profile.shape[1] < 2


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
    fits_of_clips = [fit for fit in map(read_fits, paths) if not fit.is_flat and len(fit.profile)]
    if not fits_of_clips:
        return {"charts": [], "table": None}
    return {
        "charts": [profile_chart(fits_of_clips), distance_chart(fits_of_clips)],
        "table": fit_table(fits_of_clips),
    }


def profile_chart(fits_of_clips: list[ShownFits]) -> Chart:
    """Height of the ground under the root over time, for each of the first MOST_CLIPS clips and each fit."""
    options: dict[str, list[Trace]] = {}
    for fit in fits_of_clips[:MOST_CLIPS]:
        seconds = np.round(fit.frame / 60, 2)
        # Where one cycle does not follow the other, nan is inserted, which interrupts the line.
        gaps = np.flatnonzero(np.diff(fit.frame) > FRAME_STEP) + 1
        count = fit.profile.shape[1]
        traces = []
        for k in range(count - 1, -1, -1):
            height = np.insert(np.round(fit.profile[:, k].astype(float), 1), gaps, np.nan)
            colour, width = ("@accent", 2.2) if k == 0 else ("@muted", 1)
            name = "best fit" if k == 0 else f"fits 2 to {count}"
            more: dict[str, Any] = {"legendgroup": name, "showlegend": k in (0, 1), "width": width}
            times = [
                None if not np.isfinite(v) else float(t)
                for t, v in zip(np.insert(seconds, gaps, 0), height, strict=True)
            ]
            traces.append(
                line_trace(
                    name, times, [None if not np.isfinite(v) else float(v) for v in height], colour, **more
                )
            )
        options[fit.clip] = traces
    return Chart(
        "terrain-profiles",
        "The ground under the path",
        "Several grounds are fitted to each gait cycle, and the network is trained on all of them. The lines "
        "are the heights of these grounds under the root. They agree where a foot is on the ground and "
        "differ elsewhere. Each cycle has its own fits, so the lines may jump from one cycle to the next.",
        layout={"xaxis": axis("seconds"), "yaxis": axis("height, cm")},
        choose="Clip",
        options=options,
    )


def distance_chart(fits_of_clips: list[ShownFits]) -> Chart:
    """Distance of feet in contact from the fitted ground, for each clip."""
    traces: list[Trace] = [
        {
            "type": "box",
            "name": fit.clip,
            "x": np.round(fit.foot_error[:, :, 0].ravel(), 3).tolist(),
            "orientation": "h",
            "boxpoints": False,
            "line": {"color": "@accent", "width": 1.4},
            "fillcolor": "@accent-wash",
        }
        for fit in fits_of_clips[::-1]
    ]
    return Chart(
        "terrain-feet",
        "Distance of the feet from the ground",
        "The fitted ground was corrected to meet the feet. The chart shows the mean distance that remains "
        "between the ground and a foot in contact. Each box covers the cycles and fits of a clip. A distance "
        "of less than a centimetre is invisible.",
        traces,
        {
            "xaxis": axis("cm", rangemode="tozero"),
            "yaxis": {"type": "category", "automargin": True},
            "showlegend": False,
        },
        height=max(260, 110 + 26 * len(fits_of_clips)),
    )


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
    rows = [
        [
            fit.clip,
            len(fit.error),
            float(fit.error[:, 0].mean()),
            float(fit.error[:, -1].mean()),
            float(fit.foot_error[:, :, 0].mean()),
            float(fit.foot_error[:, :, 1].max()),
        ]
        for fit in fits_of_clips
    ]
    return Table("terrain", columns, rows)


def stage_charts(material: ReportMaterial) -> list[Chart]:
    """Two charts: the seconds and the bytes of each stage."""
    # Plotly draws the first category at the bottom, so the order is reversed.
    stages = list(material.pipeline.get("stages") or ())[::-1]
    names = [stage["stage"] for stage in stages]
    charts = []
    key: Literal["seconds", "bytes"]
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
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
            "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": names},
            "showlegend": False,
        }
        charts.append(Chart(f"stage-{key}", title, caption, [trace], layout, 80 + 30 * len(names)))
    return charts


def log_range(values: Sequence[float]) -> list[float]:
    """The two ends of a logarithmic axis for `values`, as exponents of ten.

    It begins with the whole decade below the smallest positive value. Beyond the largest value there is room
    for a text.
    """
    powers = [math.log10(value) for value in values if value > 0] or [0.0, 1.0]
    return [math.floor(min(powers)), max(powers) + 0.4 * (max(powers) - math.floor(min(powers)) + 1)]


def stage_table(material: ReportMaterial) -> Table:
    """A table of times and sizes: a row for each stage.

    It has columns of published times and sizes if there are any for this configuration.
    """
    published = {
        row["stage"]: row for row in material.published["stages"] if row["configuration"] == material.name
    }
    columns = [
        Column("stage"),
        Column.count("jobs"),
        Column("time of all jobs", lambda v: format_duration(float(v)), "n"),
        Column("longest job", lambda v: format_duration(float(v)), "n"),
        Column("peak memory", lambda v: f"{format_number(v)} MB", "n"),
        Column.count("files"),
        Column("size", lambda v: format_bytes(float(v)), "n"),
    ]
    if published:
        columns.append(Column("published time", lambda v: format_duration(float(v)), "n"))
        columns.append(Column("published size", lambda v: format_bytes(float(v)), "n"))
    rows = [
        [
            stage["stage"],
            stage.get("jobs"),
            stage.get("seconds"),
            stage.get("longest"),
            stage.get("max_rss_mb"),
            stage.get("files"),
            stage.get("bytes"),
            *(
                (published.get(stage["stage"], {}).get(key) for key in ("seconds", "bytes"))
                if published
                else ()
            ),
        ]
        for stage in material.pipeline.get("stages") or ()
    ]
    return Table(f"{material.name}-pipeline", columns, rows)
