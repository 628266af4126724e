"""The surface of blended solids as one closed mesh, by the method of surface nets (Gibson, 1998)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array
from hobble.figure.solids import Solid, smooth_difference, smooth_union

LARGEST_DISTANCE = 12.0  # cm; larger distances to the surface are clipped to this
# A solid changes distances only within this many cm of its bounding box. `Solid.blend` must be smaller.
SOLID_REACH = 7.0
# The corners of a cell of the grid, and the cell's edges as pairs of indices of CORNERS.
CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if (CORNERS[a] != CORNERS[b]).sum() == 1]

# A box in which the grid is finer: its lowest and highest corner (3,), and the grid's spacing there, cm.
FineBox = tuple[Array, Array, float]


def surface_distances(solids: Sequence[Solid], points: Array) -> Array:
    """(N,) signed distance of points (N, 3) from the surface of the blended solids, cm.

    It is negative inside and at most LARGEST_DISTANCE.
    """
    out = np.full(len(points), LARGEST_DISTANCE)
    x, y, z = (np.ascontiguousarray(part) for part in points.T)
    for solid in solids:
        low, high = solid.bounds()
        low, high = low - SOLID_REACH, high + SOLID_REACH
        near = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]) & (z > low[2]) & (z < high[2])
        chosen = np.flatnonzero(near)
        if len(chosen):
            found = solid.distance(x[chosen], y[chosen], z[chosen])
            combine = smooth_difference if solid.is_subtracted else smooth_union
            out[chosen] = combine(out[chosen], found, solid.blend)
    return out


def grid_lines(low: float, high: float, spacing: float, bands: Sequence[tuple[float, float, float]]) -> Array:
    """Coordinates of grid lines from `low` to `high` along one axis, usually `spacing` cm apart.

    bands: (from, to, spacing) of each range in which the lines are closer together.
    """
    lines, at = [low], low
    while at < high:
        at += min([spacing, *(_largest_spacing(at, band) for band in bands)])
        lines.append(at)
    return np.array(lines)


def _largest_spacing(at: float, band: tuple[float, float, float]) -> float:
    """The spacing that a band allows at `at`: the band's own, plus a quarter of the distance from it."""
    low, high, spacing = band
    return spacing + 0.25 * max(low - at, at - high, 0.0)


def distance_grid(solids: Sequence[Solid], axes: Sequence[Array]) -> Array:
    """(X, Y, Z) signed distances from the blended solids at the points of a grid, cm.

    axes: coordinates of the grid lines along x, y, z. Far from all solids the distance is LARGEST_DISTANCE.
    """
    out = np.full([len(axis) for axis in axes], LARGEST_DISTANCE, np.float64)
    for solid in solids:
        low, high = solid.bounds()
        reach = max(solid.blend, 2.0) + 1.5
        # The part of the grid near the solid: a slice along each axis.
        parts = tuple(
            slice(
                max(0, int(np.searchsorted(axis, low[i] - reach)) - 1),
                int(np.searchsorted(axis, high[i] + reach)) + 1,
            )
            for i, axis in enumerate(axes)
        )
        grid = np.meshgrid(
            *(axis[part] for axis, part in zip(axes, parts, strict=True)), indexing="ij", sparse=True
        )
        combine = smooth_difference if solid.is_subtracted else smooth_union
        out[parts] = combine(out[parts], solid.distance(*grid), solid.blend)
    return out


def surface_mesh(
    solids: Sequence[Solid], spacing: float, fine: Sequence[FineBox] = ()
) -> tuple[Array, NDArray[np.int64]]:
    """The closed surface: vertices (V, 3), cm, and triangles (T, 3), counter-clockwise seen from outside.

    spacing: cm between points of the grid on which the surface is found. fine: boxes with a finer grid.
    """
    added = [solid for solid in solids if not solid.is_subtracted]
    low = np.min([solid.bounds()[0] for solid in added], axis=0) - 3 * spacing
    high = np.max([solid.bounds()[1] for solid in added], axis=0) + 3 * spacing
    axes = [grid_lines(low[i], high[i], spacing, [(a[i], b[i], s) for a, b, s in fine]) for i in range(3)]
    values = without_touching_sheets(distance_grid(solids, axes))
    vertices, triangles = surface_net(values, axes)
    for _ in range(2):  # move the vertices closer to the surface
        vertices = vertices - vectors_from_surface(solids, vertices, 0.35 * spacing)
    return vertices, triangles


def vectors_from_surface(solids: Sequence[Solid], points: Array, longest: float) -> Array:
    """(N, 3) vectors from the surface to points (N, 3), estimated from the slope of the distance.

    Vectors longer than `longest` cm are shortened to this length.
    """
    slope, distance = distance_slopes(solids, points)
    squared_slope = (slope * slope).sum(axis=1)
    vectors = (distance / np.maximum(squared_slope, 0.25))[:, None] * slope
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(length, 1e-9))


def distance_slopes(solids: Sequence[Solid], points: Array, h: float = 0.06) -> tuple[Array, Array]:
    """Slope (N, 3) of the distance from the surface at points (N, 3), and the distance (N,) itself.

    The slope points away from the surface. Both are estimated from the distances at the corners of a
    tetrahedron around each point. h: how far the corners are from the point along each axis, cm.
    """
    slope, away = np.zeros_like(points), np.zeros(len(points))
    for corner in np.array([[1.0, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]]):
        found = surface_distances(solids, points + h * corner)
        slope += found[:, None] * corner / (4 * h)
        away += found / 4
    return slope, away


def without_touching_sheets(values: Array) -> Array:
    """The distances `values` (X, Y, Z), changed so that two sheets of the surface never touch along an edge.

    Two sheets touch at a square of the grid if two opposite corners are inside the body and the other two are
    outside. There the outside corner that is nearer to the surface is put inside, which joins the two sheets.
    """
    values = values.copy()
    while True:
        inside, touching = values < 0, 0
        for u, v in ((0, 1), (1, 2), (2, 0)):  # the axes of the square's sides
            # For each of the four corners of a square: the values at this corner of all squares.
            views = []
            for du in (0, 1):
                for dv in (0, 1):
                    view = [slice(None)] * 3
                    view[u], view[v] = slice(du, -1 if du == 0 else None), slice(dv, -1 if dv == 0 else None)
                    views.append(tuple(view))
            a, b, c, d = (inside[view] for view in views)
            # first, second: the corners outside, as indices of `views`
            for first, second, sheets_touch in ((1, 2, a & d & ~b & ~c), (0, 3, b & c & ~a & ~d)):
                squares = np.argwhere(sheets_touch)
                touching += len(squares)
                both = [values[view][tuple(squares.T)] for view in (views[first], views[second])]
                for corner, is_nearer in ((first, both[0] <= both[1]), (second, both[0] > both[1])):
                    values[views[corner]][tuple(squares[is_nearer].T)] = -1e-3  # cm, just inside
        if not touching:
            return values


def surface_net(values: Array, axes: Sequence[Array]) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (T, 3) of the surface where `values` (X, Y, Z) on a grid change sign.

    axes: coordinates of the grid lines along x, y, z. Each cell of the grid that the surface crosses gets one
    vertex of the mesh: the mean of the points in which the surface crosses the edges of the cell. Around each
    edge of the grid that the surface crosses are four such cells. Their vertices form two triangles.
    """
    inside = values < 0
    shape = np.array(values.shape) - 1
    corners_inside = np.zeros(shape, np.int8)
    for corner in CORNERS:
        corners_inside += inside[tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))]
    cells = np.argwhere((corners_inside > 0) & (corners_inside < 8))
    index = np.full(shape, -1, np.int64)
    index[tuple(cells.T)] = np.arange(len(cells))
    total, crossed = np.zeros((len(cells), 3)), np.zeros((len(cells), 1))
    for a, b in EDGES:
        first, second = cells + CORNERS[a], cells + CORNERS[b]
        va, vb = values[tuple(first.T)], values[tuple(second.T)]
        cross = (va < 0) != (vb < 0)
        # Share of the edge, from a to b, at which the value is 0.
        t = np.where(cross, va / np.where(cross, va - vb, 1.0), 0.0)[:, None]
        pa, pb = (np.stack([axes[i][p[:, i]] for i in range(3)], axis=1) for p in (first, second))
        total += np.where(cross[:, None], pa + t * (pb - pa), 0.0)
        crossed += cross[:, None]
    return total / crossed, _triangles(inside, index)


def _triangles(inside: NDArray[np.bool_], index: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (T, 3), two for each edge of the grid that the surface crosses.

    inside: (X, Y, Z) whether each point of the grid is in the body. index: (X - 1, Y - 1, Z - 1) the vertex
    of each cell, -1 for a cell without one.
    """
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        # Both ends of each grid edge along `axis`. Edges on the border of the grid are left out.
        a = inside[tuple(slice(0, -1) if i == axis else slice(1, -1) for i in range(3))]
        b = inside[tuple(slice(1, None) if i == axis else slice(1, -1) for i in range(3))]
        for is_crossed, flip in ((a & ~b, False), (~a & b, True)):
            edges = np.argwhere(is_crossed)
            edges[:, u] += 1
            edges[:, v] += 1
            around = []  # the vertices of the four cells around each edge
            for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                cells = edges.copy()
                cells[:, u] += du
                cells[:, v] += dv
                around.append(index[tuple(cells.T)])
            p, q, r, s = around
            if flip:  # keeps the triangles counter-clockwise seen from outside
                q, s = s, q
            faces += [np.stack([p, q, r], 1), np.stack([p, r, s], 1)]
    return np.concatenate(faces)
