"""Inertialisation: smooth transitions between clips, with offsets kept in the character's memory.

At a transition, playback jumps to another frame of the clips. The differences in pose and velocity are stored
as offsets and added to the following poses. They decay like a critically damped spring (Bollo,
Inertialization, GDC 2018; closed form after Holden, Spring-It-On, 2021). So no joint jumps. A cross-fade
would need two poses of the clips in each frame; this needs one.

A rotation is a vector: its axis times half its angle, as in Y. Positions are in root coordinates, in cm;
speeds are per frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit

# Indices in the memory of a character.
ROW = 0  # 1 + the last row shown; 0 before the first frame
SINCE = 1  # frames since the last search
OFFSETS = 2  # the first of the offsets
OFFSETS_PER_JOINT = 12  # offsets of position, velocity, rotation and rotation speed, three numbers each
FASTEST_PULL = 0.002  # cycles per frame: the phase is corrected toward the clip's phase by at most this


def memory_size(joints: int) -> int:
    """How many numbers the memory of one character has."""
    return OFFSETS + OFFSETS_PER_JOINT * joints


@njit
def find_following(memory: Any, remaining: Any, every: int, before: Any, following: Any, due: Any) -> None:
    """Find the next row of each character's run, and mark the characters that need a search.

    A run is a sequence of consecutive frames of a clip. memory: (C, M) for C characters. remaining: (R,) how
    many frames follow each row in its run. every: frames between two searches.

    Writes three arrays (C,). before: the last row shown, or -1 if there is none. following: the row after
    `before`, or -1 if the run ends. due: whether to search.
    """
    rows = len(remaining)
    for c in range(len(memory)):
        row = memory[c, ROW]
        valid = 1 <= row <= rows
        before[c] = np.int64(row) - 1 if valid else -1
        following[c] = before[c] + 1 if valid and remaining[before[c]] > 0 else -1
        due[c] = following[c] < 0 or not memory[c, SINCE] + 1 < every


# Groups of arguments of `show_rows`, with their names in the order of the tuple.
#
# frames: (R, Y), in units of `scale`. scale: (Y,). phases: (R,).
Table = tuple[Any, Any, Any]
# before, following, due: from `find_following`. shown: (C,) the row that each character shows now.
Choice = tuple[Any, Any, Any, Any]
# joints: their number. at: (4,) the first columns in Y of the joints' positions, velocities and rotations,
# and the column of the change of phase. halflife: of the offsets, in frames.
Shape = tuple[int, Any, float]


@njit(error_model="numpy")
def show_rows(memory: Any, table: Table, choice: Choice, phase: Any, shape: Shape, out: Any) -> None:
    """Write the row to show plus the offsets of each character into `out` (C, Y), and update the memory.

    memory: (C, M). phase: (C,). If the row to show is not the following one, a transition starts. This row
    must not be the first of a run, because its rotation speed is computed from the row before it.
    """
    frames, scale, phases = table
    before, following, due, shown = choice
    joints, at, halflife = shape
    damping = 2.0 * np.log(2.0) / halflife
    for c in range(len(memory)):
        row = shown[c]
        out[c] = frames[row] * scale
        if before[c] < 0:
            memory[c] = 0.0
        else:
            if row != following[c]:
                _start_transition(memory[c], frames, scale, before[c], following[c], row, joints, at)
            _decay(memory[c, OFFSETS:], damping)
            _add(memory[c, OFFSETS:], joints, at, out[c])
            lag = phases[row] - phase[c]
            lag -= np.floor(lag + 0.5)
            out[c, at[3]] += min(max(lag, -FASTEST_PULL), FASTEST_PULL)
        memory[c, ROW] = row + 1
        memory[c, SINCE] = 0 if due[c] else memory[c, SINCE] + 1


@njit(forceinline=True, cache=False)
def _start_transition(
    memory: Any, frames: Any, scale: Any, before: int, following: int, row: int, joints: int, at: Any
) -> None:
    """Add to the offsets the difference between the pose that would have come next and that of `row`.

    If the run ends, no pose would have come next, and the last pose shown is used.
    """
    o = memory[OFFSETS:]
    old, new = frames[following if following >= 0 else before] * scale, frames[row] * scale
    # A joint's rotation speed is its rotation from one row to the next of the same run.
    before_old, before_new = frames[before] * scale, frames[max(row - 1, 0)] * scale
    q, p, r = np.empty(4), np.empty(4), np.empty(3)
    for j in range(joints):
        k = OFFSETS_PER_JOINT * j
        for i in range(3):
            o[k + i] += old[at[0] + 3 * j + i] - new[at[0] + 3 * j + i]
            o[k + 3 + i] += old[at[1] + 3 * j + i] - new[at[1] + 3 * j + i]
        column = at[2] + 3 * j
        _exp(old, column, q)
        _exp(new, column, p)
        _between(q, p, r)
        _exp(o, k + 6, p)
        _exp(r, 0, q)
        _log(p, q, o, k + 6)
        if following >= 0:
            _rotation_since(before_old, old, column, r)
            for i in range(3):
                o[k + 9 + i] += r[i]
            _rotation_since(before_new, new, column, r)
            for i in range(3):
                o[k + 9 + i] -= r[i]


@njit(forceinline=True, cache=False)
def _decay(o: Any, damping: float) -> None:
    """Advance the offsets and their speeds by one frame of x'' = -2 d x' - d^2 x, with d the damping."""
    fade = np.exp(-damping)
    for k in range(0, len(o), 6):
        for i in range(k, k + 3):
            j = o[i + 3] + o[i] * damping
            o[i], o[i + 3] = fade * (o[i] + j), fade * (o[i + 3] - j * damping)


@njit(forceinline=True, cache=False)
def _add(o: Any, joints: int, at: Any, y: Any) -> None:
    """Add the offsets to a row Y."""
    q, p = np.empty(4), np.empty(4)
    for j in range(joints):
        k, column = OFFSETS_PER_JOINT * j, at[2] + 3 * j
        for i in range(3):
            y[at[0] + 3 * j + i] += o[k + i]
            y[at[1] + 3 * j + i] += o[k + 3 + i]
        _exp(o, k + 6, q)
        _exp(y, column, p)
        _log(q, p, y, column)


@njit(forceinline=True, cache=False)
def _exp(v: Any, at: int, q: Any) -> None:
    """Write into q the quaternion of the vector v[at : at + 3], an axis times half an angle."""
    half = np.sqrt(v[at] * v[at] + v[at + 1] * v[at + 1] + v[at + 2] * v[at + 2])
    scale = np.sin(half) / half if half > 1e-8 else 1.0
    q[0], q[1], q[2], q[3] = np.cos(half), v[at] * scale, v[at + 1] * scale, v[at + 2] * scale


@njit(forceinline=True, cache=False)
def _log(a: Any, b: Any, v: Any, at: int) -> None:
    """Write into v[at : at + 3] the axis times half the angle of the product a b, along the shorter way."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    length = np.sqrt(x * x + y * y + z * z)
    scale = np.arctan2(length, w) / length if length > 1e-8 else 1.0
    v[at], v[at + 1], v[at + 2] = x * scale, y * scale, z * scale


@njit(forceinline=True, cache=False)
def _between(a: Any, b: Any, v: Any) -> None:
    """Write into v the rotation from b to a: axis times half the angle of a b^-1. Inverts b."""
    b[1], b[2], b[3] = -b[1], -b[2], -b[3]
    _log(a, b, v, 0)


@njit(forceinline=True, cache=False)
def _rotation_since(earlier: Any, now: Any, column: int, v: Any) -> None:
    """Write into v a joint's rotation from row `earlier` to row `now`. column: where it begins in Y."""
    q, p = np.empty(4), np.empty(4)
    _exp(now, column, q)
    _exp(earlier, column, p)
    _between(q, p, v)
