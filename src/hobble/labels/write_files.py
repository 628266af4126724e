"""Writes automatic labels as files that people can correct: `_footsteps.txt`, `_gait.txt`, `.phase`.

The files count frames from 1, at the frame rate of the clip's BVH file (its source file). Labels count them
from 0, at 60 Hz. `hobble.labels.read_files` reads the label files.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from hobble.core.files import write_text
from hobble.labels.clip_labels import GAITS, Labels
from hobble.labels.read_files import SourceTime

HALF_FADE = 15  # frames at 60 Hz; a fade begins this long before a change of gait and ends this long after it


def write_label_files(footsteps: Path, gait: Path, phase: Path, labels: Labels, time: SourceTime) -> None:
    """Write the three label files of a clip.

    footsteps, gait, phase: their paths. time: how the clip's frames relate to those of its source file.
    """
    write_text(footsteps, footsteps_text(labels, time))
    write_text(gait, gait_text(labels, time))
    write_text(phase, phase_text(labels, time))


def footsteps_text(labels: Labels, time: SourceTime) -> str:
    """The content of `_footsteps.txt`: lines `right left`, the frames in which the right and left foot land.

    Rows of `labels.footsteps` that lack a landing are left out, except a last row that lacks only the left
    one. A `*` at the end of a line says that no cycle uses the frames from this line's right landing to the
    next line's. It is written for rows that are marked in the labels. It is also written before a row that is
    left out, because the next line then begins another bout of walking and the file has no other way to say
    so. If a bout ends with a landing of the right foot, its last cycle is lost.
    """
    lines = []
    rows = labels.footsteps
    written = np.isfinite(rows[:, 0]) & (np.isfinite(rows[:, 1]) | (np.arange(len(rows)) == len(rows) - 1))
    for number in np.flatnonzero(written):
        right, left, dropped = rows[number]
        landings = [str(_source_frame(x, time)) for x in (right, left) if np.isfinite(x)]
        next_is_left_out = not written[number + 1 : number + 2].all()
        marked = (dropped or next_is_left_out) and len(landings) == 2
        lines.append(" ".join([*landings, *(["*"] if marked else [])]))
    return "".join(f"{line}\n" for line in lines)


def gait_text(labels: Labels, time: SourceTime) -> str:
    """The content of `_gait.txt`: lines `frame gait`, for the first frame and for each change of gait.

    A change has two lines: one with the old gait where the fade to the new gait begins, and one with the new
    gait where the fade ends.
    """
    gaits = labels.gait.argmax(axis=1).tolist()
    changes = [i for i in range(1, len(gaits)) if gaits[i] != gaits[i - 1]]
    keys: list[tuple[int, int]] = [(0, gaits[0])]  # (frame of the clip, index of the gait in GAITS)
    for change, next_change in itertools.pairwise([*changes, len(gaits)]):
        # A fade begins after the fade before it, and ends by the middle between this change and the next.
        first = max(change - HALF_FADE, keys[-1][0] + 1)
        last = max(min(change + HALF_FADE, (change + next_change) // 2), first + 1)
        keys += [(first, gaits[change - 1]), (last, gaits[change])]
    frames = [_source_frame(frame, time) for frame, _ in keys]
    # At a low frame rate several keys may fall on the same source frame. Only the first of them is written.
    kept = [0, *(i + 1 for i, (a, b) in enumerate(itertools.pairwise(frames)) if b > a)]
    return "".join(f"{frames[i]} {GAITS[keys[i][1]]}\n" for i in kept)


def phase_text(labels: Labels, time: SourceTime) -> str:
    """The content of `.phase`: a line with the phase for each source frame; 0 where it is unknown."""
    # The frame of the clip, not rounded, at each source frame.
    clip_frame = np.clip((np.arange(time.frames) - time.first) / time.ratio, 0, len(labels) - 1)
    before = np.floor(clip_frame).astype(int)
    after = np.minimum(before + 1, len(labels) - 1)
    # The change of phase the shorter way round the cycle, -.5 to .5.
    step = (labels.phase[after] - labels.phase[before] + 0.5) % 1.0 - 0.5
    values = (labels.phase[before] + (clip_frame - before) * step) % 1.0
    values[~(labels.phase_known[before] & labels.phase_known[after])] = 0.0
    # The limit keeps six digits from rounding up to 1.
    return "".join(f"{value:.6f}\n" for value in np.minimum(values, 0.999999))


def _source_frame(frame: float, time: SourceTime) -> int:
    """The source frame, counted from 1, nearest to a frame of the clip, which may lie between two frames."""
    return min(max(round(frame * time.ratio + time.first) + 1, 1), time.frames)
