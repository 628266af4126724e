"""Writes automatic labels as files that people can correct: `_footsteps.txt`, `_gait.txt`, `.phase`.

Frames are counted from 1 at the frame rate of the clip's BVH file. `hobble.labels.read_files` reads the
label files.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from hobble.core.files import write_text
from hobble.labels.clip_labels import GAITS, Labels
from hobble.labels.read_files import SourceTime

HALF_FADE = 15  # a change of gait is faded over this many frames (at 60 Hz) before it and after it


def write_label_files(footsteps: Path, gait: Path, phase: Path, labels: Labels, time: SourceTime) -> None:
    """Write the three files of a clip. time: how the clip's frames relate to those of its source file."""
    write_text(footsteps, footsteps_text(labels, time))
    write_text(gait, gait_text(labels, time))
    write_text(phase, phase_text(labels, time))


def footsteps_text(labels: Labels, time: SourceTime) -> str:
    """Lines `right left`: the frames in which the feet land.

    A `*` marks a line that is not used for cycles. It is written where the row of footsteps is marked in the
    labels, and in the last line of a bout of walking, because the format has no other way to end a bout.
    """
    lines = []
    rows = labels.footsteps
    for number, (right, left, dropped) in enumerate(rows):
        following = rows[number + 1] if number + 1 < len(rows) else None
        if np.isnan(right) or (np.isnan(left) and following is not None):
            continue
        landings = [str(_source_frame(x, time)) for x in (right, left) if np.isfinite(x)]
        ends = following is not None and np.isnan(following[0])
        lines.append(" ".join([*landings, *(["*"] if (dropped or ends) and len(landings) == 2 else [])]))
    return "".join(f"{line}\n" for line in lines)


def gait_text(labels: Labels, time: SourceTime) -> str:
    """Lines `frame gait`, two at each change of gait: from the first to the second, the gait fades."""
    gaits = labels.gait.argmax(axis=1).tolist()
    changes = [i for i in range(1, len(gaits)) if gaits[i] != gaits[i - 1]]
    keys: list[tuple[int, int]] = [(0, gaits[0])]
    for at, following in itertools.pairwise([*changes, len(gaits)]):
        first = max(at - HALF_FADE, keys[-1][0] + 1)
        last = max(min(at + HALF_FADE, (at + following) // 2), first + 1)
        keys += [(first, gaits[at - 1]), (last, gaits[at])]
    frames = [_source_frame(frame, time) for frame, _ in keys]
    kept = [0, *(i + 1 for i, (a, b) in enumerate(itertools.pairwise(frames)) if b > a)]
    return "".join(f"{frames[i]} {GAITS[keys[i][1]]}\n" for i in kept)


def phase_text(labels: Labels, time: SourceTime) -> str:
    """One value for each frame of the source file; 0 where the phase is unknown."""
    at = np.clip((np.arange(time.frames) - time.first) / time.ratio, 0, len(labels) - 1)
    before = np.floor(at).astype(int)
    after = np.minimum(before + 1, len(labels) - 1)
    step = (labels.phase[after] - labels.phase[before] + 0.5) % 1.0 - 0.5
    values = (labels.phase[before] + (at - before) * step) % 1.0
    values[~(labels.phase_known[before] & labels.phase_known[after])] = 0.0
    return "".join(f"{value:.6f}\n" for value in np.minimum(values, 0.999999))


def _source_frame(frame: float, time: SourceTime) -> int:
    """The frame of the source file, counted from 1, that is nearest to a frame of the clip."""
    return min(max(round(frame * time.ratio + time.first) + 1, 1), time.frames)
