"""Converts footsteps to phase and back, and finds locomotion cycles.

The right foot lands at phase 0 and the left foot at phase .5, as in Holden et al. (2017). (If the option
`phase_zero` is `left`, `hobble.labels.label` shifts the phase by half a cycle.)

Footsteps are an array (N, 3). A row holds the frame in which the right foot lands, the next frame in which
the left foot lands, and a mark. The mark is 1 if the frames from the right landing of this row to the right
landing of the next row must not be used, else 0. An unknown landing is nan. A row without landings ends a
bout of walking. In a bout, the feet land in turn, without a long rest.
"""

import itertools

import numpy as np

from hobble.core.quat import Array
from hobble.core.smooth import true_runs
from hobble.labels.label_files import whole_frame

END_OF_BOUT_ROW = (np.nan, np.nan, 1.0)  # the row that ends a bout of walking
# Cycles a frame. At this rate the phase advances where nobody walks: a tenth of the usual rate, as for a
# standing character at run time.
IDLE_RATE = 0.0017
FASTEST_PHASE = 0.25  # cycles a frame: a larger change of a hand-made phase is a jump, not movement
# Value of the option `margins` -> the least number of frames that a clip must have before a cycle. After the
# cycle it must have one frame more. With "extend", cycles near an end of the clip are used, because the path
# can be continued past the end. With "drop", they are left out.
MARGINS = {"extend": 1, "drop": 60}
PIECE = 60  # frames of a piece between gait cycles


def phase_of_footsteps(footsteps: Array, frames: int) -> tuple[Array, np.ndarray]:
    """The phase (frames,), 0 to 1, and for each frame whether the phase is known, bool (frames,).

    Between the landings of a bout of walking, the phase is known and linear. Elsewhere it advances at
    IDLE_RATE. Between two bouts this rate is adjusted, so that the phase has the right value at the next
    landing.
    """
    when, unwrapped, joined = _unwrapped_landings(footsteps)
    frame = np.arange(frames)
    if not len(when):
        return (frame * IDLE_RATE) % 1.0, np.zeros(frames, bool)
    phase = np.interp(frame, when, unwrapped)
    phase = np.where(frame < when[0], unwrapped[0] - (when[0] - frame) * IDLE_RATE, phase)
    phase = np.where(frame > when[-1], unwrapped[-1] + (frame - when[-1]) * IDLE_RATE, phase)
    last_landing = np.searchsorted(when, frame, side="right") - 1  # index of the last landing before a frame
    known = (last_landing >= 0) & (frame <= when[-1])
    between_bouts = np.append(~joined, True)[last_landing]
    known &= ~between_bouts | (frame == when[last_landing])
    phase %= 1.0
    return np.where(phase > 1 - 1e-9, 0.0, phase), known


def dropped_frames(footsteps: Array, frames: int) -> np.ndarray:
    """(frames,) bool: True for the frames that must not be used, because their row of footsteps is marked."""
    out = np.zeros(frames, bool)
    for row, following in itertools.pairwise(footsteps):
        if row[2] and np.isfinite(row[0]) and np.isfinite(following[0]):
            out[whole_frame(row[0]) : whole_frame(following[0])] = True
    return out


def footsteps_of_phase(phase: Array) -> tuple[Array, np.ndarray]:
    """The footsteps (N, 3) of a hand-made phase (F,), and whether the phase is known, bool (F,).

    A foot lands where the phase passes 0 or .5. The phase is known in the frames in which it moves on. It is
    not known where it stands still or jumps.
    """
    step = np.diff(phase) % 1.0
    known = np.zeros(len(phase), bool)
    events: list[tuple[float, int]] = []
    for first, last in true_runs((step > 0) & (step < FASTEST_PHASE)):
        known[first : last + 1] = True
        unwrapped = phase[first] + np.concatenate([[0.0], np.cumsum(step[first:last])])
        halves = np.arange(np.ceil(2 * unwrapped[0] - 1e-6), np.floor(2 * unwrapped[-1] + 1e-6) + 1)
        at = np.interp(halves / 2, unwrapped, np.arange(first, last + 1))
        events += [(float(frame), int(half) % 2) for frame, half in zip(at, halves, strict=True)]
        events.append((np.nan, -1))
    return rows_of_landings(events), known


def rows_of_landings(events: list[tuple[float, int]]) -> Array:
    """The footsteps (N, 3) of events (frame, foot) in order of time. foot: 0 right, 1 left, -1 neither.

    A bout of walking ends at an event with the foot -1. It also ends between two successive landings of the
    same foot.
    """
    rows: list[list[float]] = []
    last = -1
    for when, foot in events:
        if foot == -1 or foot == last:
            if rows and not np.isnan(rows[-1][:2]).all():
                rows.append(list(END_OF_BOUT_ROW))
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


def find_cycles(
    footsteps: Array, frames: int, zero: str, margins: str, fill: bool = False
) -> tuple[np.ndarray, int]:
    """First and last frame (C, 2) of each of the C cycles that are used, and the number of cycles left out.

    A cycle is the time between two successive landings of the foot `zero` ("right" or "left"), with a landing
    of the other foot between them. If the row of its first or of its last landing is marked, the cycle is
    left out, as in Holden et al. (2017). A cycle that is too near an end of the clip is left out, too.
    margins: a key of MARGINS. With "drop", the clip must have 60 frames before the cycle and 61 frames after
    it, as in Holden et al. (2017). With "extend", one frame before and two frames after are enough. fill:
    whether `fill_between` adds the frames between the cycles; then no cycle counts as left out.
    """
    margin = MARGINS[margins]
    column = 0 if zero == "right" else 1
    used, left_out = [], 0
    for row, following in itertools.pairwise(footsteps):
        between = row[1] if zero == "right" else following[0]
        if not row[column] < between < following[column]:
            continue
        first, last = whole_frame(row[column]), whole_frame(following[column])
        if row[2] or following[2] or first < margin or frames - last <= margin + 1:
            left_out += 1
        else:
            used.append((first, last))
    cycles = np.array(used, int).reshape(-1, 2)
    return (fill_between(cycles, frames, margins), 0) if fill else (cycles, left_out)


def fill_between(cycles: np.ndarray, frames: int, margins: str) -> np.ndarray:
    """Cycles (D, 2), and the frames before, between and after them, in pieces of a second or a little more.

    margins: as for `find_cycles`.

    >>> fill_between(np.array([[100, 160]]), 230, "extend").tolist()
    [[1, 100], [100, 160], [160, 227]]
    """
    margin = MARGINS[margins]
    pieces = [list(pair) for pair in cycles.tolist()]
    edges = [margin, *cycles.ravel().tolist(), frames - margin - 2]
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        count = max(1, (last - first) // PIECE)
        if last > first:
            at = np.linspace(first, last, count + 1).astype(int).tolist()
            pieces += [list(pair) for pair in itertools.pairwise(at)]
    return np.array(sorted(pieces), int).reshape(-1, 2)


def mirrored_footsteps(footsteps: Array) -> Array:
    """The footsteps (M, 3) of the mirrored clip. footsteps: (N, 3) of the original clip.

    A right landing of the mirrored clip is a left landing of the original. So a new row, which begins with a
    right landing, gets the mark of the original row with this left landing.
    """
    landings: list[tuple[float, int]] = []
    for right, left, _ in footsteps:
        # In the mirrored clip, foot 0 is the right one, which was the left one.
        landings += [(when, foot) for when, foot in ((right, 1), (left, 0)) if np.isfinite(when)]
        if np.isnan(right) and np.isnan(left):
            landings.append((np.nan, -1))
    rows = rows_of_landings(landings)
    rows[np.isfinite(rows[:, 0]), 2] = footsteps[np.isfinite(footsteps[:, 1]), 2]
    return rows


def _unwrapped_landings(footsteps: Array) -> tuple[Array, Array, np.ndarray]:
    """The n landings in order: frames (n,), phases (n,) that never fall, and which are joined, bool (n - 1,).

    Two successive landings are joined if they are in the same bout of walking. The phase is not wrapped to
    0..1. It rises by half a cycle between them, and by about IDLE_RATE a frame between two bouts.
    """
    when: list[float] = []
    unwrapped: list[float] = []
    joined: list[bool] = []
    bout_ended, last = True, np.nan  # the phase of the last landing
    for right, left, _ in footsteps:
        bout_ended |= bool(np.isnan(right) and np.isnan(left))
        for landing, phase in ((right, 0.0), (left, 0.5)):
            if not np.isfinite(landing):
                continue
            rise = phase
            if when:
                joined.append(not bout_ended and last != phase)
                # The smallest rise to this phase, plus whole cycles if the time allows them.
                least = (phase - unwrapped[-1]) % 1.0
                spare = (landing - when[-1]) * IDLE_RATE - least
                rise = unwrapped[-1] + (0.5 if joined[-1] else least + max(0, round(spare)))
            when.append(landing)
            unwrapped.append(rise)
            bout_ended, last = False, phase
    return np.array(when, float), np.array(unwrapped, float), np.array(joined, bool)
