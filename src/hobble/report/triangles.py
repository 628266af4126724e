"""Compiled functions for `hobble.report.raster`: they draw triangles and the ground, and finish the picture.

They release Python's global lock (GIL), so that several films can be drawn at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array


@njit(nogil=True)
def corner_normals(corners: Array, faces: Any) -> Array:  # pragma: no cover
    """Unit normals (V, 3) at the V corners of a mesh, for shading.

    corners: (V, 3) positions. faces: (T, 3) indices of the corners of each triangle. A corner's normal is the
    mean of the normals of its triangles, weighted by their areas.
    """
    out = np.zeros_like(corners)
    for f in range(len(faces)):
        i, j, k = faces[f]
        a, b, c = corners[i], corners[j], corners[k]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        # The cross product of two edges: the triangle's normal, with twice its area as length.
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for corner in (i, j, k):
            out[corner, 0] += x
            out[corner, 1] += y
            out[corner, 2] += z
    for v in range(len(out)):
        x, y, z = out[v]
        out[v] /= max(np.sqrt(x * x + y * y + z * z), 1e-12)
    return out


@njit(nogil=True)
def draw_ground(
    place: Array, seen: Array, wide: Array, x: float, z: float, cell: float, colours: Array
) -> Array:  # pragma: no cover
    """RGB (H, W, 3), from 0 to 1, of the ground with a grid of lines every `cell` cm.

    place: (H, W, 2) the point of the ground that each pixel shows, relative to (x, z), cm. seen: (H, W) share
    of the ground's colour in each pixel; the background has the remaining share. wide: (H, W) half the width
    of a line, cm. colours: (3, 3) RGB of background, ground and lines.
    """
    out = np.empty((*seen.shape, 3))
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            a, b = (place[i, j, 0] + x) / cell, (place[i, j, 1] + z) / cell
            # Distance to the nearest line, cm.
            near = cell * min(abs(a - np.round(a)), abs(b - np.round(b)))
            # The share of the line's colour. It falls smoothly to 0, so that lines have no jagged edges.
            line = 0.30 * min(max(1.4 - near / wide[i, j], 0.0), 1.0) * seen[i, j]
            for k in range(3):
                paper, ground, lines = colours[0, k], colours[1, k], colours[2, k]
                out[i, j, k] = paper + seen[i, j] * (ground - paper) + line * (lines - ground)
    return out


@njit(nogil=True, cache=False, inline="always")
def _pixel_range(a: float, b: float, c: float, size: int) -> tuple[int, int]:  # pragma: no cover
    """The first and the last pixel from the least to the greatest of a, b and c, within 0 and size - 1.

    a, b, c: x (or y) of a triangle's corners, in pixels. size: width (or height) of the picture.
    """
    return max(0, int(np.ceil(min(a, b, c)))), min(size - 1, int(np.floor(max(a, b, c))))


@njit(nogil=True, cache=False, inline="always")
def _barycentric_weights(
    a: Array, b: Array, c: Array, x: int, y: int, area: float
) -> tuple[float, float]:  # pragma: no cover
    """Barycentric weights of the corners a and b of a triangle a, b, c at pixel (x, y).

    The weight of c is 1 minus both. area: twice the signed area of the triangle.
    """
    u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
    v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
    return u, v


@njit(nogil=True)
def draw_triangles(
    points: Array, colours: Array, faces: Any, picture: Array, depth: Array
) -> None:  # pragma: no cover
    """Draw the triangles that face the camera into `picture` (H, W, 3), RGB. Nearer triangles hide others.

    points: (V, 3) x and y in pixels and depth of each corner. colours: (V, 3) RGB of each corner. faces: (T,
    3) indices of the corners of each triangle. depth: (H, W) depth of what each pixel shows; drawing updates
    it.
    """
    height, width = depth.shape
    for f in range(len(faces)):
        i, j, k = faces[f]
        a, b, c = points[i], points[j], points[k]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:  # a back face: front faces have a negative area, because y points down
            continue
        x0, x1 = _pixel_range(a[0], b[0], c[0], width)
        y0, y1 = _pixel_range(a[1], b[1], c[1], height)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u, v = _barycentric_weights(a, b, c, x, y, area)
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                deep = u * a[2] + v * b[2] + w * c[2]
                if deep < depth[y, x]:
                    depth[y, x] = deep
                    for n in range(3):
                        picture[y, x, n] = u * colours[i, n] + v * colours[j, n] + w * colours[k, n]


@njit(nogil=True)
def fill_triangles(points: Array, faces: Any, cover: Array) -> None:  # pragma: no cover
    """Set the pixels of `cover` (H, W) that a triangle covers to 1.

    points: (V, 3) corners; their first two columns are x and y in pixels. faces: (T, 3) indices of the
    corners of each triangle.
    """
    height, width = cover.shape
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        x0, x1 = _pixel_range(a[0], b[0], c[0], width)
        y0, y1 = _pixel_range(a[1], b[1], c[1], height)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u, v = _barycentric_weights(a, b, c, x, y, area)
                if u >= 0 and v >= 0 and u + v <= 1:
                    cover[y, x] = 1.0


@njit(nogil=True)
def finish_picture(picture: Array, depth: Array, background: Array, scale: int) -> Any:  # pragma: no cover
    """The finished picture: RGB bytes (H, W, 3).

    Each of its pixels is the mean of a square of `scale` by `scale` pixels of `picture`. Where nothing was
    drawn, the background shows. picture: (scale * H, scale * W, 3) RGB from 0 to 1. depth: (scale * H,
    scale * W), infinite where nothing was drawn. background: (H, W, 3) RGB from 0 to 1.
    """
    height, width = background.shape[:2]
    out = np.empty((height, width, 3), np.uint8)
    count = scale * scale
    for i in range(height):
        for j in range(width):
            drawn, red, green, blue = 0, 0.0, 0.0, 0.0
            for y in range(scale * i, scale * i + scale):
                for x in range(scale * j, scale * j + scale):
                    if depth[y, x] < np.inf:
                        drawn += 1
                        red += picture[y, x, 0]
                        green += picture[y, x, 1]
                        blue += picture[y, x, 2]
            for k, total in enumerate((red, green, blue)):
                value = total / count + (1 - drawn / count) * background[i, j, k]
                out[i, j, k] = np.uint8(min(max(np.round(255 * value), 0.0), 255.0))
    return out
