"""The section on the ground that was fitted to the clips: its shape, and its distance from the feet.

Several grounds, the fits, are fitted to each gait cycle of a clip.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.report.charts import Chart, Trace, axis, line_trace
from hobble.report.tables import Column, Table

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


def section(paths: Iterable[str | Path]) -> dict[str, Any]:
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
