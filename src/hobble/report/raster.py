"""Renders the page's body without a browser, with light, ground and shadow."""

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

SUPERSAMPLING = 2  # rendered pixels per picture pixel, in each direction
PAPER = np.array([0.953, 0.945, 0.925])
GROUND = np.array([0.905, 0.888, 0.850])
LINE = np.array([0.60, 0.61, 0.62])
BODY = np.array([0.70, 0.735, 0.765])
HURT_LOW, HURT_HIGH = np.array([0.914, 0.725, 0.286]), np.array([0.761, 0.220, 0.169])
GRID = 50.0  # cm between the lines on the ground
REACH = 700.0  # cm from the target over which the ground fades into the background


@dataclass(frozen=True)
class Camera:
    """A camera that looks at `target` from `distance` (cm).

    yaw, pitch: radians. size: pixels of each side.
    """

    target: Array
    yaw: float = 0.75
    pitch: float = 0.2
    distance: float = 330.0
    size: int = 400

    @property
    def axes(self) -> Array:
        """(3, 3), rows: right, up, and into the picture."""
        c = np.cos(self.pitch)
        ahead = -np.array([c * np.sin(self.yaw), np.sin(self.pitch), c * np.cos(self.yaw)])
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(right, ahead), ahead])

    @property
    def eye(self) -> Array:
        """Position of the camera (3,), cm."""
        return self.target - self.distance * self.axes[2]

    def project(self, points: Array, scale: int = 1) -> Array:
        """(V, 3): pixels x, y and depth in cm of world points (V, 3)."""
        across, up, deep = ((points - self.eye) @ self.axes.T).T
        deep = np.maximum(deep, 1.0)
        half, zoom = scale * self.size / 2, scale * self.size * 1.75
        return np.stack([half + zoom * across / deep, half - zoom * up / deep, deep], axis=1)


class BodyRenderer:
    """Draws one body in any pose. regions: for each bone, the indices of the columns that colour it."""

    def __init__(self, body: Mesh, regions: Sequence[Sequence[int]] = ()) -> None:
        self._body, self._faces = body, body.faces
        self._regions = [list(columns) for columns in regions] or [[] for _ in body.bones]

    def draw(
        self, places: Array, turns: Array, camera: Camera, values: Array | None = None
    ) -> NDArray[np.uint8]:
        """An RGB picture (size, size, 3). places (B, 3), cm, and turns (B, 4) of the bones.

        values: (columns,) from 0 to 1, drawn as colours."""
        corners = self._body.posed(places, turns)
        key = np.array([0.55 * np.sin(camera.yaw - 0.85), 0.78, 0.55 * np.cos(camera.yaw - 0.85)])
        key /= np.linalg.norm(key)
        rim = np.array([0.9 * np.sin(camera.yaw + 2.5), 0.35, 0.9 * np.cos(camera.yaw + 2.5)])
        ground = _ground(camera)
        shadow = corners - key * (corners[:, 1:2] / key[1])
        fine = camera.size * SUPERSAMPLING
        cover = np.zeros((camera.size, camera.size))
        _fill(camera.project(shadow), self._faces, cover)
        ground *= 1 - 0.42 * gaussian_filter(cover, camera.size / 130)[..., None]
        normals = _normals(corners, self._faces)
        tone = (
            (0.50 + 0.10 * normals[:, 1]) * (0.55 + 0.45 * self._body.shade)
            + 0.58 * np.maximum(normals @ key, 0)
            + 0.16 * np.maximum(normals @ rim, 0) ** 2
        )
        colours = self._colours(values) * tone[:, None]
        picture, depth = np.zeros((fine, fine, 3)), np.full((fine, fine), np.inf)
        _shade(camera.project(corners, SUPERSAMPLING), colours, self._faces, picture, depth)
        share = _coarse(np.isfinite(depth).astype(float))[..., None]
        return np.clip(np.round(255 * (_coarse(picture) + (1 - share) * ground)), 0, 255).astype(np.uint8)

    def _colours(self, values: Array | None) -> Array:
        """RGB of every corner: grey for value 0, then amber, then red for value 1."""
        bones = np.tile(BODY, (len(self._body.bones), 1))
        if values is not None:
            for i, columns in enumerate(self._regions):
                t = max((float(values[column]) for column in columns), default=0.0)
                if t:
                    low = BODY + (HURT_LOW - BODY) * min(1.0, 0.35 + 1.3 * t)
                    bones[i] = low if t < 0.5 else HURT_LOW + (HURT_HIGH - HURT_LOW) * (2 * t - 1)
        return np.einsum("vk,vkc->vc", self._body.share, bones[self._body.bone])


@functools.lru_cache(maxsize=4)
def _sheet(yaw: float, pitch: float, distance: float, size: int, height: float) -> tuple[Array, Array, Array]:
    """For each pixel: the point of the ground that it shows, relative to the point under the target (cm); the
    share of ground colour over background; half the width of a grid line (cm)."""
    camera = Camera(np.array([0.0, height, 0.0]), yaw, pitch, distance, size)
    pixel = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(pixel, -pixel)
    rays = np.stack([x, y, np.full_like(x, size * 1.75)], axis=-1) @ camera.axes
    far = camera.eye[1] / np.maximum(-rays[..., 1], 1e-6)
    place = camera.eye[[0, 2]] + rays[..., [0, 2]] * far[..., None]
    seen = np.clip(1.25 - np.linalg.norm(place, axis=-1) / REACH, 0, 1)
    return place, np.where(rays[..., 1] < -1e-6, seen, 0.0), 0.35 + 96 * np.maximum(far / size, 1e-5)


def _ground(camera: Camera) -> Array:
    """RGB (size, size, 3) of the ground at height 0 with its grid, fading into the background far away."""
    x, height, z = (float(v) for v in camera.target)
    place, seen, wide = _sheet(camera.yaw, camera.pitch, camera.distance, camera.size, height)
    near = np.full(seen.shape, np.inf)
    for axis, moved in enumerate((x, z)):
        turns = (place[..., axis] + moved) / GRID
        near = np.minimum(near, np.abs(turns - np.round(turns)) * GRID)
    share = 0.30 * np.clip(1.4 - near / wide, 0, 1) * seen
    return PAPER + seen[..., None] * (GROUND - PAPER) + share[..., None] * (LINE - GROUND)


def _coarse(fine: Array) -> Array:
    """Means over squares of SUPERSAMPLING by SUPERSAMPLING pixels."""
    out = np.zeros_like(fine[::SUPERSAMPLING, ::SUPERSAMPLING])
    for i in range(SUPERSAMPLING):
        for j in range(SUPERSAMPLING):
            out += fine[i::SUPERSAMPLING, j::SUPERSAMPLING]
    return out / SUPERSAMPLING**2


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
    """Draw triangles with corners (V, 3) in pixels and colours (V, 3), with a depth buffer."""
    height, width = depth.shape
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:  # back face: y points down, so front faces have a negative area
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
    """Set pixels to 1 that triangles with corners (V, 3) in pixels cover, seen from either side."""
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
