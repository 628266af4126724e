"""Compiled loops that compute heights and errors of patches.

A patch is a view of a heightmap. A cell (u, v) of the patch is counted from its middle, along the world's x
and z. Its row and column in the heightmap are A (u, v, 1), where A (2, 3) is the affine map of the patch.

The functions `view_...` and `search_views` have these arguments. heights: all heightmaps, one after another,
in one float32 array. starts: (M,) index of the first cell of each of M maps. shapes: (M, 2) rows and columns
of each map. which: (P,) index of the map of each of P patches. affine: (P, 2, 3) the A of each patch. All
arguments are arrays or numbers, or tuples of these, so that one compiled version serves all data sets. The
functions that they call get the heights of one map, its rows and columns, and `a`, the two rows of A.

All loops are in one file because numba renews the cache of a function only if the file of this function
changes. The functions that other modules call are cached. The other functions are not cached, but inlined in
their callers. If they were compiled and cached separately, they could add up sums in another order, and so
round them differently.
"""

import numpy as np

from hobble.core.compiled import njit

DOWN_WEIGHT = 0.1  # weight of the feet in contact in the error of a patch; the other terms have weight 1
JUMP_HEIGHT = 5.0  # cm; in jumps the ground should not be further than this below a foot in the air
BEAM_HEIGHT = 40.0  # cm; next to a beam the ground should be at least this far below it
FAST = {"reassoc", "contract", "nsz", "nnan"}  # LLVM flags that allow vectorised sums; heights are never nan
ONE = np.uint32(1)  # keeps indices unsigned, see `height`


@njit(fastmath=FAST, forceinline=True, cache=False)
def height(heights, rows, columns, r, c):
    """Height of one map at row r and column c (float32, inside the map), by bilinear interpolation."""
    i = min(np.int32(r), np.int32(rows - 2))
    j = min(np.int32(c), np.int32(columns - 2))
    fr = r - np.float32(i)
    fc = c - np.float32(j)
    k = np.uint32(i * np.int32(columns) + j)  # unsigned, so that numba does not test for negative indices
    below = k + np.uint32(columns)
    near = heights[k] + fc * (heights[k + ONE] - heights[k])
    far = heights[below] + fc * (heights[below + ONE] - heights[below])
    return near + fr * (far - near)


@njit(inline="always", cache=False)
def cells_of_map(heights, starts, shapes, m):
    """The heights of the cells of map m, and its numbers of rows and columns."""
    rows, columns = shapes[m, 0], shapes[m, 1]
    return heights[starts[m] : starts[m] + rows * columns], rows, columns


@njit
def view_heights(heights, starts, shapes, which, affine, mean, points):
    """Heights (P, N) of P patches, all at the same points, cm.

    points: (N, 2) u and v, inside the patches. mean: (P,) mean height of each patch, which is subtracted.
    """
    out = np.empty((len(which), len(points)), np.float32)
    for p in range(len(which)):
        cells, rows, columns = cells_of_map(heights, starts, shapes, which[p])
        a = affine[p]
        for n in range(len(points)):
            u, v = points[n, 0], points[n, 1]
            r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
            c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
            out[p, n] = height(cells, rows, columns, r, c) - mean[p]
    return out


@njit
def check_views(heights, starts, shapes, which, affine, size, highest):
    """Mean height (P,) of P views of `size` x `size` cells, and whether (P,) each view stays near its mean.

    A view passes if all its cells are within `highest` cm of the mean. A view is not read to the end once its
    heights differ by more than 2 * highest; then its mean is given as 0.
    """
    mean = np.zeros(len(which), np.float32)
    passes = np.zeros(len(which), np.bool_)
    half = size // 2
    for p in range(len(which)):
        cells, rows, columns = cells_of_map(heights, starts, shapes, which[p])
        a = affine[p]
        low, high, total = np.float32(np.inf), np.float32(-np.inf), 0.0
        for i in range(size):
            for j in range(size):
                u, v = np.float32(i - half), np.float32(j - half)
                r = a[0, 0] * u + a[0, 1] * v + a[0, 2]
                c = a[1, 0] * u + a[1, 1] * v + a[1, 2]
                h = height(cells, rows, columns, r, c)
                low, high = min(low, h), max(high, h)
                total += h
            if not high - low <= 2 * highest:
                break
        else:
            middle = total / (size * size)
            passes[p] = high - middle <= highest and middle - low <= highest
            mean[p] = middle
    return mean, passes


@njit(fastmath=FAST, forceinline=True, cache=False)
def _down_means(heights, rows, columns, a, points):
    """Returns `first`, the mean of d - first, and the mean of (d - first)², over all feet in contact.

    d is the height of the patch above a foot, cm, and `first` is the d of the first foot. The differences are
    small numbers, so single precision is enough. points: u, v and height of each foot.
    """
    u, v, foot = points
    (ru, rv, r0), (cu, cv, c0) = a
    first = height(heights, rows, columns, ru * u[0] + rv * v[0] + r0, cu * u[0] + cv * v[0] + c0)
    first -= foot[0]
    total, squares = np.float32(0), np.float32(0)
    for k in range(len(u)):
        r = ru * u[k] + rv * v[k] + r0
        c = cu * u[k] + cv * v[k] + c0
        d = height(heights, rows, columns, r, c) - first - foot[k]
        total += d
        squares += d * d
    return first, total / len(u), squares / len(u)


@njit(fastmath=FAST, forceinline=True, cache=False)
def _up_sum(heights, rows, columns, a, offset, points, jumps):
    """Sum of squared heights, cm², of the ground above feet in the air.

    Ground below a foot does not count. In jumps, ground more than JUMP_HEIGHT below a foot counts by the
    square of the excess. offset: mean height of the patch above the feet in contact, which is subtracted.
    points: u, v and height of each foot.
    """
    u, v, foot = points
    (ru, rv, r0), (cu, cv, c0) = a
    lowest = -np.float32(JUMP_HEIGHT) if jumps else -np.float32(1e9)
    squares = np.float32(0)
    for k in range(len(u)):
        r = ru * u[k] + rv * v[k] + r0
        c = cu * u[k] + cv * v[k] + c0
        d = height(heights, rows, columns, r, c) - offset - foot[k]
        d = max(d, np.float32(0)) + min(d - lowest, np.float32(0))
        squares += d * d
    return squares


@njit(fastmath=FAST, forceinline=True, cache=False)
def _beam_side_sum(heights, rows, columns, a, points):
    """Sum of squares, over points beside the path, of how far the ground is too high there, cm².

    It is too high if it is less than BEAM_HEIGHT below the path. points: u and v of each point, and u and v
    of the path beside it.
    """
    u, v, path_u, path_v = points
    (ru, rv, r0), (cu, cv, c0) = a
    squares = np.float32(0)
    for k in range(len(u)):
        r = ru * u[k] + rv * v[k] + r0
        c = cu * u[k] + cv * v[k] + c0
        d = height(heights, rows, columns, r, c) + np.float32(BEAM_HEIGHT)
        r = ru * path_u[k] + rv * path_v[k] + r0
        c = cu * path_u[k] + cv * path_v[k] + c0
        d = max(d - height(heights, rows, columns, r, c), np.float32(0))
        squares += d * d
    return squares


@njit(forceinline=True, cache=False)
def _error(heights, rows, columns, a, tables, jumps, limit):
    """The error of one patch, cm², or infinity as soon as it is known to exceed `limit`.

    The error is DOWN_WEIGHT times the variance of the patch's height above feet in contact, plus the mean
    squares of `_up_sum` and `_beam_side_sum`.

    tables: four tables, each as a tuple of its columns. 1: feet in contact (u, v, height). 2: feet in the air
    that are tried first (u, v, height). 3: the other feet in the air (u, v, height). 4: points beside a beam
    (u, v, and u, v of the path). jumps: whether the ground must not be far below feet in the air.
    """
    down, up_first, up_rest, beam_sides = tables
    first, offset, squares = _down_means(heights, rows, columns, a, down)
    error = DOWN_WEIGHT * max(squares - offset * offset, 0.0)
    if error > limit:
        return np.inf
    offset = np.float32(first + offset)
    count = len(up_first[0]) + len(up_rest[0])
    if count:
        squares = _up_sum(heights, rows, columns, a, offset, up_first, jumps)
        if error + squares / count > limit:
            return np.inf
        squares += _up_sum(heights, rows, columns, a, offset, up_rest, jumps)
        error += squares / count
    if len(beam_sides[0]) and error <= limit:
        error += _beam_side_sum(heights, rows, columns, a, beam_sides) / len(beam_sides[0])
    return error


@njit(inline="always", cache=False)
def _rows_as_tuples(a):
    """The two rows of A, as tuples of numbers."""
    return (a[0, 0], a[0, 1], a[0, 2]), (a[1, 0], a[1, 1], a[1, 2])


@njit
def search_views(heights, starts, shapes, which, affine, tables, jumps, count):
    """Indices (count,) and errors (count,), cm², of the patches with the lowest errors, best first.

    Of two patches with equal errors, the one with the lower index is first. tables, jumps: see `_error`.
    """
    best = np.full(count, -1)
    errors = np.full(count, np.inf)
    for p in range(len(which)):
        cells, rows, columns = cells_of_map(heights, starts, shapes, which[p])
        error = _error(cells, rows, columns, _rows_as_tuples(affine[p]), tables, jumps, errors[-1])
        if error < errors[-1]:
            k = count - 1
            while k > 0 and errors[k - 1] > error:
                errors[k], best[k] = errors[k - 1], best[k - 1]
                k -= 1
            errors[k], best[k] = error, p
    return best, errors
