"""Converts footsteps to phase and back, and finds locomotion cycles.

The right foot lands at phase 0 and the left one at .5, as in Holden et al. (2017). (`hobble.labels.label`
shifts the phase by half a cycle if the option `phase_zero` is `left`.)

Footsteps are an array (N, 3). Each row holds the frame in which the right foot lands, the next frame in which
the left foot lands, and a mark: 1 if the frames from this row's right landing to the next row's must not be
used, else 0. An unknown landing is nan. A row without landings ends a bout of walking.
"""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.quat import Array
from hobble.labels.read_files import whole_frame

BREAK = (np.nan, np.nan, 1.0)  # the row that ends a bout of walking
IDLE_RATE = 0.0017  # cycles a frame: a tenth of the usual rate, as for a standing character at run time
FASTEST = 0.25  # cycles a frame: a larger change of a hand-made phase is a jump, not movement
# Option `margins` -> least number of frames that a clip must have before a cycle. After the cycle it must
# have this number plus one.
# With "extend", cycles near an end of the clip are used too, because the path can be extended past the end.
# With "drop" they are left out.
MARGINS = {"extend": 1, "drop": 60}


def phase_of_footsteps(footsteps: Array, frames: int) -> tuple[Array, np.ndarray]:
    """Phase (frames,) in 0..1, 0 as the right foot lands, and (frames,) bool, whether it is known.

    The phase is known and linear between the landings of a bout of walking. Elsewhere it advances at
    IDLE_RATE; between two bouts this rate is adjusted, so that the phase has the right value at the next
    landing.
    """
    when, value, joined = _landings(footsteps)
    frame = np.arange(frames)
    if not len(when):
        return (frame * IDLE_RATE) % 1.0, np.zeros(frames, bool)
    unwrapped = _unwrapped(when, value, joined)
    phase = np.interp(frame, when, unwrapped)
    phase = np.where(frame < when[0], unwrapped[0] - (when[0] - frame) * IDLE_RATE, phase)
    phase = np.where(frame > when[-1], unwrapped[-1] + (frame - when[-1]) * IDLE_RATE, phase)
    after = np.searchsorted(when, frame, side="right") - 1
    known = (after >= 0) & (frame <= when[-1])
    gap = np.append(~joined, True)[after]
    known &= ~gap | (frame == when[after])
    phase %= 1.0
    return np.where(phase > 1 - 1e-9, 0.0, phase), known


def dropped_frames(footsteps: Array, frames: int) -> np.ndarray:
    """(frames,) bool: frames that must not be used, because their row of footsteps is marked."""
    out = np.zeros(frames, bool)
    for row, following in itertools.pairwise(footsteps):
        if row[2] and np.isfinite(row[0]) and np.isfinite(following[0]):
            out[whole_frame(row[0]) : whole_frame(following[0])] = True
    return out


def footsteps_of_phase(phase: Array) -> tuple[Array, np.ndarray]:
    """The footsteps (N, 3) of a hand-made phase (F,), and (F,) bool, whether the phase changes in each frame.

    A foot lands where the phase passes 0 or .5.
    """
    step = np.diff(phase) % 1.0
    moving = np.concatenate([[False], (step > 0) & (step < FASTEST), [False]])
    edges = np.flatnonzero(np.diff(moving))
    known = np.zeros(len(phase), bool)
    events: list[tuple[float, int]] = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        known[first : last + 1] = True
        unwrapped = phase[first] + np.concatenate([[0.0], np.cumsum(step[first:last])])
        halves = np.arange(np.ceil(2 * unwrapped[0] - 1e-6), np.floor(2 * unwrapped[-1] + 1e-6) + 1)
        at = np.interp(halves / 2, unwrapped, np.arange(first, last + 1))
        events += [(float(frame), int(half) % 2) for frame, half in zip(at, halves, strict=True)]
        events.append((np.nan, -1))
    return rows_of_landings(events), known


def rows_of_landings(events: list[tuple[float, int]]) -> Array:
    """Footsteps (N, 3) of landings (frame, foot) in order of time. Foot 0 is right, 1 left.

    A bout of walking ends at an event with the foot -1, and between two successive landings of the same foot.
    """
    rows: list[list[float]] = []
    last = -1
    for when, foot in events:
        if foot == -1 or foot == last:
            if rows and not np.isnan(rows[-1][:2]).all():
                rows.append(list(BREAK))
            last = -1
        if foot == 0:
            rows.append([when, np.nan, 0.0])
        elif foot == 1 and last == 0:
            rows[-1][1] = when
        elif foot == 1:
            rows.append([np.nan, when, 0.0])
        last = foot
    while rows and np.isnan(rows[-1][:2]).all():
        rows.pop()
    return np.array(rows, float).reshape(-1, 3)


def find_cycles(footsteps: Array, frames: int, zero: str, margins: str) -> tuple[np.ndarray, int]:
    """First and last frame (C, 2) of each cycle that is used, and the number of cycles left out.

    A cycle is the time between two landings of the foot `zero`. A marked row leaves out its cycle and the one
    before, as in Holden et al. (2017). A cycle that is too near an end of the clip is left out, too. With
    `margins` "drop", the clip must have 60 frames before the cycle and 61 after it, as in Holden et al.
    (2017). With "extend", one before and two after are enough.
    """
    margin = MARGINS[margins]
    column = 0 if zero == "right" else 1
    kept, dropped = [], 0
    for row, following in itertools.pairwise(footsteps):
        between = row[1] if zero == "right" else following[0]
        if not row[column] < between < following[column]:
            continue
        first, last = whole_frame(row[column]), whole_frame(following[column])
        if row[2] or following[2] or first < margin or frames - last <= margin + 1:
            dropped += 1
        else:
            kept.append((first, last))
    return np.array(kept, int).reshape(-1, 2), dropped


def mirrored_footsteps(footsteps: Array) -> Array:
    """The footsteps (M, 3) of the mirrored clip, with left and right exchanged.

    A row of the mirrored clip starts with a right landing, which is a left landing of the clip before
    mirroring. The new row takes its mark from the old row with that left landing.
    """
    landings: list[tuple[float, int]] = []
    marks: list[float] = []
    for right, left, dropped in footsteps:
        for when, foot in ((right, 1), (left, 0)):
            if np.isfinite(when):
                landings.append((when, foot))
                if foot == 0:
                    marks.append(dropped)
        if np.isnan(right) and np.isnan(left):
            landings.append((np.nan, -1))
    rows = rows_of_landings(landings)
    has_right = np.isfinite(rows[:, 0])
    rows[has_right, 2] = marks
    return rows


def _landings(footsteps: Array) -> tuple[Array, Array, np.ndarray]:
    """Frame (n,) and phase (n,), 0 or .5, of each of the n landings, and which of them are joined.

    That is bool (n - 1,): whether a landing and the next one are in the same bout of walking.
    """
    when: list[float] = []
    value: list[float] = []
    joined: list[bool] = []
    apart = True
    for right, left, _ in footsteps:
        if np.isnan(right) and np.isnan(left):
            apart = True
        for landing, phase in ((right, 0.0), (left, 0.5)):
            if np.isfinite(landing):
                if when:
                    joined.append(not apart and value[-1] != phase)
                when.append(landing)
                value.append(phase)
                apart = False
    return np.array(when, float), np.array(value, float), np.array(joined, bool)


def _unwrapped(when: Array, value: Array, joined: np.ndarray) -> Array:
    """(n,) phase of each landing, not wrapped to 0..1: it only rises.

    It rises by half a cycle in each step of a bout, and by about IDLE_RATE per frame between two bouts.
    """
    unwrapped = [value[0]]
    for i, together in enumerate(joined):
        if together:
            unwrapped.append(unwrapped[-1] + 0.5)
            continue
        least = (value[i + 1] - unwrapped[-1]) % 1.0
        spare = (when[i + 1] - when[i]) * IDLE_RATE - least
        unwrapped.append(unwrapped[-1] + least + max(0, round(spare)))
    return np.array(unwrapped)
