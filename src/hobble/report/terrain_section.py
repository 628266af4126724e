"""The ground fitted to the clips: its distance from the feet, and its shape along the path."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.report.charts import Chart, Trace, axis, line
from hobble.report.tables import Column, Table

MOST_CLIPS = 10  # at most this many clips have their ground profile drawn
MOST_ROWS = 900  # a profile shows at most this many rows (frames of gait cycles) of its clip
FRAME_STEP = 3  # a profile has a point for every third frame


@dataclass(frozen=True)
class ShownFits:
    """The terrain fits of one clip with C gait cycles and 10 fits of each cycle.

    foot_error: (C, 10, 2) mean and largest distance of a foot in contact from the fitted ground, cm. error:
    (C, 10) fitting error, cm². frame: (S,) frames of the profile. profile: (S, K) height of the ground under
    the root in the first K fits of each frame, cm. K: the number of fits of the frame with the fewest.
    """

    clip: str
    foot_error: Array = field(repr=False)
    error: Array = field(repr=False)
    frame: Array = field(repr=False)
    profile: Array = field(repr=False)

    @property
    def flat(self) -> bool:
        """Whether the clip has only one, flat fit."""
        return self.profile.shape[1] < 2


def read_fits(path: str | Path) -> ShownFits:
    """Read `terrain/clips/<clip>.npz`. Raises InputError if an array is missing or lengths disagree."""
    try:
        file = ArrayParts(path)
        fits, frame = file.whole("fits"), file.rows("frame", 0, MOST_ROWS)
        fewest = int(fits.min()) if len(fits) else 1
        first = (np.cumsum(fits) - fits)[:MOST_ROWS:FRAME_STEP]  # row of each frame's first fit in `heights`
        heights = file.rows("heights", 0, int(first[-1]) + fewest if len(fits) else 0)
        # Columns: samples of the path on the left, in the centre, on the right. The present is in the middle.
        present = heights.shape[1] // 3 + heights.shape[1] // 6
        profile = heights[:, present][first[:, None] + np.arange(fewest)] if len(fits) else np.zeros((0, 1))
        errors = file.whole("foot_error"), file.whole("error")
        return ShownFits(Path(path).stem, *errors, frame[::FRAME_STEP], profile)
    except (ValueError, IndexError) as error:
        raise InputError(
            path, f"not the terrain of a clip ({error})", fix="Delete the file; the workflow makes it again."
        ) from error


def section(paths: Iterable[str | Path]) -> dict[str, Any]:
    """Charts and a table of the fits. paths: files of terrain fits."""
    fits_of_clips = [fit for fit in map(read_fits, paths) if not fit.flat and len(fit.profile)]
    if not fits_of_clips:
        return {"charts": [], "table": None}
    return {"charts": [profiles(fits_of_clips), distances(fits_of_clips)], "table": fit_table(fits_of_clips)}


def profiles(fits_of_clips: list[ShownFits]) -> Chart:
    """Height of the ground under the root along each clip, for all its fits."""
    options: dict[str, list[Trace]] = {}
    for fit in fits_of_clips[:MOST_CLIPS]:
        x = np.round(fit.frame / 60, 2)
        # No line between cycles that are not consecutive.
        gaps = np.flatnonzero(np.diff(fit.frame) > FRAME_STEP) + 1
        count = fit.profile.shape[1]
        traces = []
        for k in range(count - 1, -1, -1):
            y = np.insert(np.round(fit.profile[:, k].astype(float), 1), gaps, np.nan)
            colour, width = ("@accent", 2.2) if k == 0 else ("@muted", 1)
            name = "best fit" if k == 0 else f"fits 2 to {count}"
            more: dict[str, Any] = {"legendgroup": name, "showlegend": k in (0, 1), "width": width}
            times = [
                None if not np.isfinite(v) else float(t)
                for t, v in zip(np.insert(x, gaps, 0), y, strict=True)
            ]
            traces.append(
                line(name, times, [None if not np.isfinite(v) else float(v) for v in y], colour, **more)
            )
        options[fit.clip] = traces
    return Chart(
        "terrain-profiles",
        "The ground under the path",
        "Several grounds are fitted to each cycle, and the network is trained on all of them. The lines are "
        "their heights under the root. They agree where a foot is on the ground and differ elsewhere. Each "
        "cycle has its own fits, so the lines may jump from one cycle to the next.",
        layout={"xaxis": axis("seconds"), "yaxis": axis("height, cm")},
        choose="Clip",
        options=options,
    )


def distances(fits_of_clips: list[ShownFits]) -> Chart:
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
        "The fitted ground was corrected to meet the feet. This is the mean distance that remains between it "
        "and a foot in contact. Each box covers the cycles and fits of a clip. Less than a "
        "centimetre is invisible.",
        traces,
        {
            "xaxis": axis("cm", rangemode="tozero"),
            "yaxis": {"type": "category", "automargin": True},
            "showlegend": False,
        },
        height=max(260, 110 + 26 * len(fits_of_clips)),
    )


def fit_table(fits_of_clips: list[ShownFits]) -> Table:
    """A row for each clip."""
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
