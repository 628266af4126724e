"""Compiled loops over patches: bilinear heights, the extent of a patch, the error of a fit.

A patch is a view of a heightmap. Its cell (u, v), counted from the middle of the patch along the world's x and z,
shows the map at row, column = A (u, v, 1). Maps of any size lie one after another in one float32 array; `starts`
and `shapes` say where. All loops are over plain arrays, so that one compiled version serves every data set.
"""

from __future__ import annotations

import numba
import numpy as np

BLOCK = 16


@numba.njit(cache=True, inline="always")
def height(heights, start, rows, columns, r, c):
    """Bilinear height at row r, column c (floats inside the map)."""
    i = min(int(r), rows - 2)
    j = min(int(c), columns - 2)
    fr = r - np.float32(i)
    fc = c - np.float32(j)
    k = start + i * columns + j
    near = heights[k] + fc * (heights[k + 1] - heights[k])
    k += columns
    far = heights[k] + fc * (heights[k + 1] - heights[k])
    return near + fr * (far - near)


@numba.njit(cache=True)
def view_heights(heights, starts, shapes, which, affine, mean, points):
    """Heights (P, N) of P patches at the same N points (N, 2), in cells from the middle, inside the patch."""
    out = np.empty((len(which), len(points)), np.float32)
    for p in range(len(which)):
        m = which[p]
        start, rows, columns = starts[m], shapes[m, 0], shapes[m, 1]
        a = affine[p]
        for n in range(len(points)):
            u, v = points[n, 0], points[n, 1]
            r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
            c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
            out[p, n] = height(heights, start, rows, columns, r, c) - mean[p]
    return out


@numba.njit(cache=True)
def view_extents(heights, starts, shapes, which, affine, size, highest):
    """Mean height of each of P views over its `size` x `size` cells, and whether no cell is further from it
    than `highest`. A view that shows a hole of the map (nan) does not pass.

    Returns mean (P,), passes (P,). A view whose coarse cells differ by more than twice `highest` cannot pass
    and is not looked at any further; its mean is 0.
    """
    mean = np.zeros(len(which), np.float32)
    passes = np.zeros(len(which), np.bool_)
    half = size // 2
    cells = np.empty(size * size, np.float32)
    for p in range(len(which)):
        m = which[p]
        start, rows, columns = starts[m], shapes[m, 0], shapes[m, 1]
        a = affine[p]
        low, high = np.float32(np.inf), np.float32(-np.inf)
        for i in range(0, size, 8):
            for j in range(0, size, 8):
                u, v = np.float32(i - half), np.float32(j - half)
                r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
                c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
                h = height(heights, start, rows, columns, r, c)
                low, high = min(low, h), max(high, h)
        if not high - low <= 2 * highest:
            continue
        total = 0.0
        n = 0
        for i in range(size):
            for j in range(size):
                u, v = np.float32(i - half), np.float32(j - half)
                r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
                c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
                cells[n] = height(heights, start, rows, columns, r, c)
                total += cells[n]
                n += 1
        middle = total / n
        passes[p] = True
        for k in range(n):
            if not abs(cells[k] - middle) <= highest:
                passes[p] = False
                break
        mean[p] = middle
    return mean, passes
