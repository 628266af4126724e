"""Pictures of the figure without a browser: the body that the page draws, lit, on ground with its shadow."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.figure.mesh import Mesh

FINE = 2  # pixels of the body to a pixel of the picture, a side
PAPER = np.array([0.953, 0.945, 0.925])
GROUND = np.array([0.905, 0.888, 0.850])
LINE = np.array([0.60, 0.61, 0.62])
BODY = np.array([0.70, 0.735, 0.765])
HURT_LOW, HURT_HIGH = np.array([0.914, 0.725, 0.286]), np.array([0.761, 0.220, 0.169])
GRID = 50.0  # cm between lines
REACH = 700.0  # cm at which the ground has faded into the paper


@dataclass(frozen=True)
class Camera:
    """Looks at `target` (cm) from `distance`, turned by `yaw` and raised by `pitch`; pixels wide and high."""

    target: Array
    yaw: float = 0.75
    pitch: float = 0.2
    distance: float = 330.0
    size: int = 400

    @property
    def axes(self) -> Array:
        """Rows: to the right, up, and into the picture."""
        c = np.cos(self.pitch)
        ahead = -np.array([c * np.sin(self.yaw), np.sin(self.pitch), c * np.cos(self.yaw)])
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(right, ahead), ahead])

    @property
    def eye(self) -> Array:
        """Where the camera is."""
        return self.target - self.distance * self.axes[2]

    def project(self, points: Array, scale: int = 1) -> Array:
        """Pixels x, y and the depth in cm of world points (V, 3)."""
        across, up, deep = ((points - self.eye) @ self.axes.T).T
        deep = np.maximum(deep, 1.0)
        half, zoom = scale * self.size / 2, scale * self.size * 1.75
        return np.stack([half + zoom * across / deep, half - zoom * up / deep, deep], axis=1)


class Studio:
    """Draws one body in any pose; `regions`: for each of its bones the columns that colour it."""

    def __init__(self, body: Mesh, regions: Sequence[Sequence[int]] = ()) -> None:
        self._body, self._faces = body, body.faces
        self._regions = [list(columns) for columns in regions] or [[] for _ in body.bones]

    def draw(
        self, places: Array, turns: Array, camera: Camera, told: Array | None = None
    ) -> NDArray[np.uint8]:
        """An RGB picture (size, size, 3). places (B, 3), cm, and turns (B, 4) of the bones; told:
        (columns,) from 0 to 1, as colours."""
        corners = self._body.posed(places, turns)
        key = np.array([0.55 * np.sin(camera.yaw - 0.85), 0.78, 0.55 * np.cos(camera.yaw - 0.85)])
        key /= np.linalg.norm(key)
        rim = np.array([0.9 * np.sin(camera.yaw + 2.5), 0.35, 0.9 * np.cos(camera.yaw + 2.5)])
        ground = _ground(camera)
        shadow = corners - key * (corners[:, 1:2] / key[1])
        fine = camera.size * FINE
        cover = np.zeros((camera.size, camera.size))
        _fill(camera.project(shadow), self._faces, cover)
        ground *= 1 - 0.42 * gaussian_filter(cover, camera.size / 130)[..., None]
        normals = _normals(corners, self._faces)
        tone = (
            (0.50 + 0.10 * normals[:, 1]) * (0.55 + 0.45 * self._body.shade)
            + 0.58 * np.maximum(normals @ key, 0)
            + 0.16 * np.maximum(normals @ rim, 0) ** 2
        )
        colours = self._colours(told) * tone[:, None]
        picture, depth = np.zeros((fine, fine, 3)), np.full((fine, fine), np.inf)
        _shade(camera.project(corners, FINE), colours, self._faces, picture, depth)
        share = _coarse(np.isfinite(depth).astype(float))[..., None]
        return np.clip(np.round(255 * (_coarse(picture) + (1 - share) * ground)), 0, 255).astype(np.uint8)

    def _colours(self, told: Array | None) -> Array:
        """RGB of every corner: grey where it is told nothing, over amber to red where it is told the most."""
        bones = np.tile(BODY, (len(self._body.bones), 1))
        if told is not None:
            for i, columns in enumerate(self._regions):
                t = max((float(told[column]) for column in columns), default=0.0)
                if t:
                    low = BODY + (HURT_LOW - BODY) * min(1.0, 0.35 + 1.3 * t)
                    bones[i] = low if t < 0.5 else HURT_LOW + (HURT_HIGH - HURT_LOW) * (2 * t - 1)
        return np.einsum("vk,vkc->vc", self._body.share, bones[self._body.bone])


@functools.lru_cache(maxsize=4)
def _sheet(yaw: float, pitch: float, distance: float, size: int, height: float) -> tuple[Array, Array, Array]:
    """Of each pixel: where it sees the ground, from under the target; how much of the ground, rather than
    the paper, is seen there; half the width (cm) that a line is drawn with."""
    camera = Camera(np.array([0.0, height, 0.0]), yaw, pitch, distance, size)
    pixel = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(pixel, -pixel)
    rays = np.stack([x, y, np.full_like(x, size * 1.75)], axis=-1) @ camera.axes
    far = camera.eye[1] / np.maximum(-rays[..., 1], 1e-6)
    place = camera.eye[[0, 2]] + rays[..., [0, 2]] * far[..., None]
    seen = np.clip(1.25 - np.linalg.norm(place, axis=-1) / REACH, 0, 1)
    return place, np.where(rays[..., 1] < -1e-6, seen, 0.0), 0.35 + 96 * np.maximum(far / size, 1e-5)


def _ground(camera: Camera) -> Array:
    """RGB (size, size, 3) of the ground at height 0 with its grid, fading into the paper far away."""
    x, height, z = (float(v) for v in camera.target)
    place, seen, wide = _sheet(camera.yaw, camera.pitch, camera.distance, camera.size, height)
    near = np.full(seen.shape, np.inf)
    for axis, moved in enumerate((x, z)):
        turns = (place[..., axis] + moved) / GRID
        near = np.minimum(near, np.abs(turns - np.round(turns)) * GRID)
    share = 0.30 * np.clip(1.4 - near / wide, 0, 1) * seen
    return PAPER + seen[..., None] * (GROUND - PAPER) + share[..., None] * (LINE - GROUND)


def _coarse(fine: Array) -> Array:
    """Means over squares of FINE by FINE pixels."""
    out = np.zeros_like(fine[::FINE, ::FINE])
    for i in range(FINE):
        for j in range(FINE):
            out += fine[i::FINE, j::FINE]
    return out / FINE**2


def _normals(corners: Array, faces: NDArray[np.int64]) -> Array:
    a, b, c = corners[faces].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    out = np.zeros_like(corners)
    for k in range(3):
        np.add.at(out, faces[:, k], across)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


@njit
def _shade(
    points: Array, colours: Array, faces: Any, picture: Array, depth: Array
) -> None:  # pragma: no cover
    """Fill triangles of corners (V, 3) in pixels with their colours, the nearest in front."""
    height, width = depth.shape
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:  # seen from behind: y points down, so fronts have a negative area
            continue
        x0, x1 = max(0, int(min(a[0], b[0], c[0]))), min(width - 1, int(max(a[0], b[0], c[0])) + 1)
        y0, y1 = max(0, int(min(a[1], b[1], c[1]))), min(height - 1, int(max(a[1], b[1], c[1])) + 1)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                z = u * a[2] + v * b[2] + w * c[2]
                if z < depth[y, x]:
                    depth[y, x] = z
                    for k in range(3):
                        picture[y, x, k] = (
                            u * colours[faces[f, 0], k]
                            + v * colours[faces[f, 1], k]
                            + w * colours[faces[f, 2], k]
                        )


@njit
def _fill(points: Array, faces: Any, cover: Array) -> None:  # pragma: no cover
    """Set to 1 what triangles of corners (V, 3) in pixels cover, from whichever side."""
    height, width = cover.shape
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        x0, x1 = max(0, int(min(a[0], b[0], c[0]))), min(width - 1, int(max(a[0], b[0], c[0])) + 1)
        y0, y1 = max(0, int(min(a[1], b[1], c[1]))), min(height - 1, int(max(a[1], b[1], c[1])) + 1)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                if u >= 0 and v >= 0 and u + v <= 1:
                    cover[y, x] = 1.0
