"""Compiled functions for `hobble.report.raster`: they draw triangles and the ground, and finish the picture.

They release Python's global lock (GIL), so that several films can be drawn at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array


@njit(nogil=True)
def normals(corners: Array, faces: Any) -> Array:  # pragma: no cover
    """Unit normals (V, 3) of corners (V, 3). faces: (T, 3) corners of each triangle.

    A corner's normal is the mean over its triangles, weighted by area.
    """
    out = np.zeros_like(corners)
    for f in range(len(faces)):
        i, j, k = faces[f]
        a, b, c = corners[i], corners[j], corners[k]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
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
def grid(
    place: Array, seen: Array, wide: Array, x: float, z: float, cell: float, colours: Array
) -> Array:  # pragma: no cover
    """RGB (H, W, 3) of a ground with lines every `cell` cm.

    place: (H, W, 2) points of the ground relative to (x, z), cm. seen: (H, W), share of the ground's
    colour, the rest being background. wide: (H, W), half the width of a line, cm. colours: (3, 3),
    of background, ground and lines.
    """
    out = np.empty((*seen.shape, 3))
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            a, b = (place[i, j, 0] + x) / cell, (place[i, j, 1] + z) / cell
            near = cell * min(abs(a - np.round(a)), abs(b - np.round(b)))
            line = 0.30 * min(max(1.4 - near / wide[i, j], 0.0), 1.0) * seen[i, j]
            for k in range(3):
                paper, ground, lines = colours[0, k], colours[1, k], colours[2, k]
                out[i, j, k] = paper + seen[i, j] * (ground - paper) + line * (lines - ground)
    return out


@njit(nogil=True, cache=False, inline="always")
def _range(a: float, b: float, c: float, size: int) -> tuple[int, int]:  # pragma: no cover
    """First and last whole number between the least and the greatest of a, b and c, within 0 and size - 1."""
    return max(0, int(np.ceil(min(a, b, c)))), min(size - 1, int(np.floor(max(a, b, c))))


@njit(nogil=True, cache=False, inline="always")
def _weights(
    a: Array, b: Array, c: Array, x: int, y: int, area: float
) -> tuple[float, float]:  # pragma: no cover
    """Barycentric weights of corners a and b at pixel (x, y). area: twice the signed area."""
    u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
    v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
    return u, v


@njit(nogil=True)
def shade(
    points: Array, colours: Array, faces: Any, picture: Array, depth: Array
) -> None:  # pragma: no cover
    """Draw triangles `faces` (T, 3) into `picture` (H, W, 3), with a depth buffer `depth` (H, W).

    points: (V, 3) corners, x and y in pixels, and depth. colours: (V, 3) of the corners.
    """
    height, width = depth.shape
    for f in range(len(faces)):
        i, j, k = faces[f]
        a, b, c = points[i], points[j], points[k]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:  # back face: y points down, so front faces have a negative area
            continue
        x0, x1 = _range(a[0], b[0], c[0], width)
        y0, y1 = _range(a[1], b[1], c[1], height)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u, v = _weights(a, b, c, x, y, area)
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                deep = u * a[2] + v * b[2] + w * c[2]
                if deep < depth[y, x]:
                    depth[y, x] = deep
                    for n in range(3):
                        picture[y, x, n] = u * colours[i, n] + v * colours[j, n] + w * colours[k, n]


@njit(nogil=True)
def fill(points: Array, faces: Any, cover: Array) -> None:  # pragma: no cover
    """Set the pixels of `cover` (H, W) under triangles to 1. points: (V, 3) corners, in pixels."""
    height, width = cover.shape
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        x0, x1 = _range(a[0], b[0], c[0], width)
        y0, y1 = _range(a[1], b[1], c[1], height)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u, v = _weights(a, b, c, x, y, area)
                if u >= 0 and v >= 0 and u + v <= 1:
                    cover[y, x] = 1.0


@njit(nogil=True)
def averaged(picture: Array, depth: Array, background: Array, scale: int) -> Any:  # pragma: no cover
    """RGB bytes (H, W, 3): means over squares of `scale` by `scale` pixels, with the background behind.

    picture: (scale H, scale W, 3). depth: (scale H, scale W), infinite where nothing was drawn.
    background: (H, W, 3).
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
