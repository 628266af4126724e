"""Inertialisation: smooth transitions between clips, with offsets in the character's memory.

Motion matching plays frames of clips. Their rows are in a table with one row for each frame, in runs of
consecutive frames. At a transition, playback jumps to another row. The differences in pose and velocity are
stored as offsets and added to the following poses. So no joint jumps. The offsets decay like a critically
damped spring (Bollo, Inertialization, GDC 2018; closed form after Holden, Spring-It-On, 2021). A cross-fade
would need two poses of the clips in each frame; this needs one.

A rotation is a vector: its axis times half its angle, as in the network's output Y. Positions are in root
coordinates, in cm; speeds are per frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit

# Indices in the memory of a character, an array of numbers that is 0 before its first frame.
ROW = 0  # 1 + the last row shown; 0 before the first frame
SINCE = 1  # frames since the last search
OFFSETS = 2  # the first of the offsets
# A joint has offsets of position, velocity, rotation and rotation speed, in this order, three numbers each.
OFFSETS_PER_JOINT = 12
# Indices in `at`, the array with the first columns in Y of the joints' positions, velocities and rotations,
# and the column of the change of phase.
POSITION, VELOCITY, ROTATION, PHASE_CHANGE = 0, 1, 2, 3
FASTEST_PULL = 0.002  # cycles per frame: the phase is corrected toward the clip's phase by at most this


def memory_size(joints: int) -> int:
    """How many numbers the memory of one character has."""
    return OFFSETS + OFFSETS_PER_JOINT * joints


@njit
def find_following(memory: Any, remaining: Any, every: int, before: Any, following: Any, due: Any) -> None:
    """Find the next row of each character's run, and whether the character needs a search.

    memory: (C, M) for C characters. remaining: (R,) how many frames follow each row in its run. every: frames
    between two searches.

    Writes three arrays (C,). before: the last row shown, or -1 if there is none. following: the row after
    `before`, or -1 if the run ends or `before` is -1. due: whether to search.
    """
    rows = len(remaining)
    for c in range(len(memory)):
        row = memory[c, ROW]
        valid = 1 <= row <= rows
        before[c] = np.int64(row) - 1 if valid else -1
        following[c] = before[c] + 1 if valid and remaining[before[c]] > 0 else -1
        # `not <` and not `>=`, so that a NaN in the memory leads to a search.
        due[c] = following[c] < 0 or not memory[c, SINCE] + 1 < every


# Each of these types is a tuple of arguments of `show_rows`. The comment names its items in their order.
#
# frames: (R, Y), the poses divided by `scale`. scale: (Y,). phases: (R,).
Table = tuple[Any, Any, Any]
# before, following, due: from `find_following`. shown: (C,) the row that each character shows now.
Choice = tuple[Any, Any, Any, Any]
# joints: number of joints. at: (4,) columns in Y, see POSITION. halflife: of the offsets, in frames.
Shape = tuple[int, Any, float]


@njit(error_model="numpy")
def show_rows(memory: Any, table: Table, choice: Choice, phase: Any, shape: Shape, out: Any) -> None:
    """Write the pose of each character, the row to show plus the offsets, into `out` (C, Y).

    Updates memory (C, M). phase: (C,) the characters' phases; the change of phase in `out` is corrected, so
    that the character's phase approaches that of the row. If the row to show is not the following one, a
    transition starts. The row should then not be the first of a run, because its rotation speed is computed
    from the row before it.
    """
    frames, scale, phases = table
    before, following, due, shown = choice
    joints, at, halflife = shape
    # As in Holden's article. After `halflife` frames, 60 % is left of an offset that was at rest.
    damping = 2.0 * np.log(2.0) / halflife
    for c in range(len(memory)):
        row = shown[c]
        out[c] = frames[row] * scale
        if before[c] < 0:
            memory[c] = 0.0
        else:
            if row != following[c]:
                _start_transition(memory[c], frames, scale, before[c], following[c], row, joints, at)
            _decay_offsets(memory[c, OFFSETS:], damping)
            _add_offsets(memory[c, OFFSETS:], joints, at, out[c])
            lag = phases[row] - phase[c]
            lag -= np.floor(lag + 0.5)  # at most half a cycle, forwards or backwards
            out[c, at[PHASE_CHANGE]] += min(max(lag, -FASTEST_PULL), FASTEST_PULL)
        memory[c, ROW] = row + 1
        memory[c, SINCE] = 0 if due[c] else memory[c, SINCE] + 1


@njit(forceinline=True, cache=False)
def _start_transition(
    memory: Any, frames: Any, scale: Any, before: int, following: int, row: int, joints: int, at: Any
) -> None:
    """Add the difference between two poses to the offsets: the pose that would have come next, minus `row`'s.

    If the old run has ended (`following` is -1), the last pose shown takes the place of the next one.
    """
    offsets = memory[OFFSETS:]
    old, new = frames[following if following >= 0 else before] * scale, frames[row] * scale
    # A joint's rotation speed is its rotation from one row to the next of the same run.
    before_old, before_new = frames[before] * scale, frames[max(row - 1, 0)] * scale
    q, p, r = np.empty(4), np.empty(4), np.empty(3)  # two quaternions and a rotation vector
    for j in range(joints):
        k = OFFSETS_PER_JOINT * j
        for i in range(3):
            offsets[k + i] += old[at[POSITION] + 3 * j + i] - new[at[POSITION] + 3 * j + i]
            offsets[k + 3 + i] += old[at[VELOCITY] + 3 * j + i] - new[at[VELOCITY] + 3 * j + i]
        column = at[ROTATION] + 3 * j
        _exp(old, column, q)
        _exp(new, column, p)
        _rotation_between(q, p, r)
        _exp(offsets, k + 6, p)
        _exp(r, 0, q)
        _log_of_product(p, q, offsets, k + 6)
        if following >= 0:
            _rotation_since(before_old, old, column, r)
            for i in range(3):
                offsets[k + 9 + i] += r[i]
            _rotation_since(before_new, new, column, r)
            for i in range(3):
                offsets[k + 9 + i] -= r[i]


@njit(forceinline=True, cache=False)
def _decay_offsets(offsets: Any, damping: float) -> None:
    """Advance the offsets and their speeds by one frame.

    An offset x with the damping d follows x'' = -2 d x' - d^2 x. The solution is x = e^(-d t) (x0 + j t), and
    x' = e^(-d t) (v0 - d j t), with j = v0 + d x0.
    """
    fade = np.exp(-damping)
    for k in range(0, len(offsets), 6):  # three offsets, then their three speeds
        for i in range(k, k + 3):
            j = offsets[i + 3] + offsets[i] * damping
            offsets[i], offsets[i + 3] = fade * (offsets[i] + j), fade * (offsets[i + 3] - j * damping)


@njit(forceinline=True, cache=False)
def _add_offsets(offsets: Any, joints: int, at: Any, y: Any) -> None:
    """Add the offsets to the pose in the row y (Y,)."""
    q, p = np.empty(4), np.empty(4)
    for j in range(joints):
        k, column = OFFSETS_PER_JOINT * j, at[ROTATION] + 3 * j
        for i in range(3):
            y[at[POSITION] + 3 * j + i] += offsets[k + i]
            y[at[VELOCITY] + 3 * j + i] += offsets[k + 3 + i]
        _exp(offsets, k + 6, q)
        _exp(y, column, p)
        _log_of_product(q, p, y, column)


@njit(forceinline=True, cache=False)
def _exp(v: Any, i: int, q: Any) -> None:
    """Write the quaternion (w, x, y, z) of the rotation vector v[i : i + 3] into q."""
    half_angle = np.sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2])
    scale = np.sin(half_angle) / half_angle if half_angle > 1e-8 else 1.0
    q[0], q[1], q[2], q[3] = np.cos(half_angle), v[i] * scale, v[i + 1] * scale, v[i + 2] * scale


@njit(forceinline=True, cache=False)
def _log_of_product(a: Any, b: Any, v: Any, i: int) -> None:
    """Write the rotation vector of the quaternion product a b into v[i : i + 3], the shorter way round."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    length = np.sqrt(x * x + y * y + z * z)
    scale = np.arctan2(length, w) / length if length > 1e-8 else 1.0
    v[i], v[i + 1], v[i + 2] = x * scale, y * scale, z * scale


@njit(forceinline=True, cache=False)
def _rotation_between(a: Any, b: Any, v: Any) -> None:
    """Write the rotation vector from b to a, that of a b^-1, into v. Replaces b by its inverse."""
    b[1], b[2], b[3] = -b[1], -b[2], -b[3]
    _log_of_product(a, b, v, 0)


@njit(forceinline=True, cache=False)
def _rotation_since(earlier: Any, now: Any, column: int, v: Any) -> None:
    """Write the rotation vector of a joint from row `earlier` to row `now` into v.

    column: the first column of the joint's rotation.
    """
    q, p = np.empty(4), np.empty(4)
    _exp(now, column, q)
    _exp(earlier, column, p)
    _rotation_between(q, p, v)
