"""The search for the patches that fit a cycle best: every patch is tried, most are given up early.

The error of a patch is a sum of terms that only grow as more points are looked at (the spread about the mean of
the points so far never exceeds that of all of them), so a patch whose partial sum is above the worst of the best
so far can be left: what comes out is exactly what trying every patch at every point would give.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

from hobble.core.quat import Array
from hobble.terrain.patches import Patches
from hobble.terrain.sampling import BLOCK, height

DOWN_WEIGHT = 0.1
JUMP_HEIGHT = 5.0
BEAM_HEIGHT = 40.0
NOWHERE = np.zeros((0, 3), np.float32)


@dataclass(frozen=True)
class Footing:
    """What the ground under a cycle has to fit, in patch cells from the patch's middle (u along x, v along z).

    down, up: (N, 3) u, v and height in cm of the soles of feet in contact and of the others, less the mean
    height of those in contact. jumps: whether the ground stays near the feet that are up. beside: (N, 4) u, v of a point off
    the path, and u, v of the point of the path it belongs to; empty but for beams.
    """

    down: Array = field(repr=False)
    up: Array = field(repr=False)
    jumps: bool = False
    beside: Array = field(default_factory=lambda: np.zeros((0, 4), np.float32), repr=False)


def best_patches(patches: Patches, footing: Footing, count: int) -> tuple[np.ndarray, Array]:
    """Indices (count,) of the patches of lowest error, the best first, and their errors (count,) in cm2."""
    return _search(*patches.arrays, *_tables(footing), footing.jumps, count)


def patch_errors(patches: Patches, footing: Footing) -> Array:
    """The error (P,) of every patch, in cm2: what `best_patches` finds the lowest of."""
    return _errors(*patches.arrays, *_tables(footing), footing.jumps)


def _tables(footing: Footing) -> tuple[Array, Array, Array]:
    return tuple(
        np.ascontiguousarray(table[_spread_order(len(table))], np.float32)
        for table in (footing.down, footing.up, footing.beside)
    )


def _spread_order(count: int) -> np.ndarray:
    """An order in which every first few of `count` points are spread over all of them."""
    return np.argsort((np.arange(count) * 0.6180339887498949) % 1.0, kind="stable")


@numba.njit(cache=True)
def _error(heights, start, rows, columns, a, middle, down, up, beside, jumps, limit):
    """The error of one patch, or infinity as soon as it is known to lie above `limit`."""
    total, squares = 0.0, 0.0
    error = 0.0
    n = 0
    while n < len(down):
        stop = min(n + BLOCK, len(down))
        for k in range(n, stop):
            u, v = down[k, 0], down[k, 1]
            r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
            c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
            d = height(heights, start, rows, columns, r, c) - middle - down[k, 2]
            total += d
            squares += d * d
        n = stop
        error = DOWN_WEIGHT * max(squares - total * total / n, 0.0) / len(down)
        if error > limit:
            return np.inf
    offset = np.float32(total / max(len(down), 1)) + middle
    known = error
    squares = 0.0
    n = 0
    while n < len(up):
        stop = min(n + BLOCK, len(up))
        for k in range(n, stop):
            u, v = up[k, 0], up[k, 1]
            r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
            c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
            d = height(heights, start, rows, columns, r, c) - offset - up[k, 2]
            if d > 0:
                squares += d * d
            elif jumps and d < -JUMP_HEIGHT:
                squares += (d + JUMP_HEIGHT) ** 2
        n = stop
        error = known + squares / len(up)
        if error > limit:
            return np.inf
    known = error
    squares = 0.0
    for k in range(len(beside)):
        u, v = beside[k, 0], beside[k, 1]
        r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
        c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
        d = height(heights, start, rows, columns, r, c)
        u, v = beside[k, 2], beside[k, 3]
        r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
        c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
        d -= height(heights, start, rows, columns, r, c) - BEAM_HEIGHT
        if d > 0:
            squares += d * d
            error = known + squares / len(beside)
            if error > limit:
                return np.inf
    return error


@numba.njit(cache=True)
def _errors(heights, starts, shapes, which, affine, mean, down, up, beside, jumps):
    out = np.empty(len(which))
    for p in range(len(which)):
        m = which[p]
        out[p] = _error(
            heights,
            starts[m],
            shapes[m, 0],
            shapes[m, 1],
            affine[p],
            mean[p],
            down,
            up,
            beside,
            jumps,
            np.inf,
        )
    return out


@numba.njit(cache=True)
def _search(heights, starts, shapes, which, affine, mean, down, up, beside, jumps, count):
    best = np.full(count, -1)
    errors = np.full(count, np.inf)
    for p in range(len(which)):
        m = which[p]
        error = _error(
            heights,
            starts[m],
            shapes[m, 0],
            shapes[m, 1],
            affine[p],
            mean[p],
            down,
            up,
            beside,
            jumps,
            errors[-1],
        )
        if error < errors[-1]:
            k = count - 1
            while k > 0 and errors[k - 1] > error:
                errors[k], best[k] = errors[k - 1], best[k - 1]
                k -= 1
            errors[k], best[k] = error, p
    return best, errors
