"""Draws the body of the page's character without a browser, with light, ground and shadow."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from hobble.core.quat import Array
from hobble.figure.mesh import Mesh
from hobble.report.triangles import (
    corner_normals,
    draw_ground,
    draw_triangles,
    fill_triangles,
    finish_picture,
)

SUPERSAMPLING = 2  # rendered pixels per picture pixel, in each direction
# Colours: red, green and blue from 0 to 1. PAPER: background. LINE: grid on the ground. BODY: parts of the
# body with value 0. HURT_LOW: parts with value 0.5. HURT_HIGH: parts with value 1.
PAPER = np.array([0.953, 0.945, 0.925])
GROUND = np.array([0.905, 0.888, 0.850])
LINE = np.array([0.60, 0.61, 0.62])
BODY = np.array([0.70, 0.735, 0.765])
HURT_LOW, HURT_HIGH = np.array([0.914, 0.725, 0.286]), np.array([0.761, 0.220, 0.169])
GRID = 50.0  # cm between the lines on the ground
FADE = 700.0  # cm over which the ground fades into the background; this begins FADE / 4 from the target


@dataclass(frozen=True)
class Camera:
    """A camera that looks at `target` from `distance` (cm).

    yaw, pitch: radians. size: pixels on each side of the square picture.
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
        """Pixel x, pixel y and depth in cm, (V, 3), of world points (V, 3). scale: enlarges the picture."""
        across, up, deep = ((points - self.eye) @ self.axes.T).T
        deep = np.maximum(deep, 1.0)
        half, zoom = scale * self.size / 2, scale * self.size * 1.75
        return np.stack([half + zoom * across / deep, half - zoom * up / deep, deep], axis=1)


class BodyRenderer:
    """Draws a body in any pose. regions: for each bone, the indices of the channel columns that colour it."""

    def __init__(self, body: Mesh, regions: Sequence[Sequence[int]] = ()) -> None:
        self._body, self._faces = body, body.faces
        self._regions = [list(columns) for columns in regions] or [[] for _ in body.bones]

    def draw(
        self, places: Array, turns: Array, camera: Camera, values: Array | None = None
    ) -> NDArray[np.uint8]:
        """An RGB picture (size, size, 3).

        places, turns: positions (B, 3), cm, and rotations (B, 4) of the bones. values: (columns,) from 0 to
        1, drawn as colours.
        """
        corners = self._body.posed(places, turns)
        key_light = np.array([0.55 * np.sin(camera.yaw - 0.85), 0.78, 0.55 * np.cos(camera.yaw - 0.85)])
        key_light /= np.linalg.norm(key_light)
        rim_light = np.array([0.9 * np.sin(camera.yaw + 2.5), 0.35, 0.9 * np.cos(camera.yaw + 2.5)])
        fine = camera.size * SUPERSAMPLING
        cover = np.zeros((camera.size, camera.size), np.float32)
        fill_triangles(
            camera.project(corners - key_light * (corners[:, 1:2] / key_light[1])), self._faces, cover
        )
        background = _ground(camera)
        background *= 1 - 0.42 * gaussian_filter(cover, camera.size / 130)[..., None]
        facing = corner_normals(corners, self._faces)
        tone = (
            (0.50 + 0.10 * facing[:, 1]) * (0.55 + 0.45 * self._body.shade)
            + 0.58 * np.maximum(facing @ key_light, 0)
            + 0.16 * np.maximum(facing @ rim_light, 0) ** 2
        )
        colours = self._colours(values) * tone[:, None]
        picture, depth = np.zeros((fine, fine, 3), np.float32), np.full((fine, fine), np.inf, np.float32)
        draw_triangles(camera.project(corners, SUPERSAMPLING), colours, self._faces, picture, depth)
        return finish_picture(picture, depth, background, SUPERSAMPLING)

    def _colours(self, values: Array | None) -> Array:
        """RGB of every corner: from grey for value 0 over amber to red for value 1."""
        if values is None:
            return np.broadcast_to(BODY, self._body.corners.shape)
        bones = np.tile(BODY, (len(self._body.bones), 1))
        for i, columns in enumerate(self._regions):
            t = max((float(values[column]) for column in columns), default=0.0)
            if t:
                low = BODY + (HURT_LOW - BODY) * min(1.0, 0.35 + 1.3 * t)
                bones[i] = low if t < 0.5 else HURT_LOW + (HURT_HIGH - HURT_LOW) * (2 * t - 1)
        return np.einsum("vk,vkc->vc", self._body.weights, bones[self._body.bones_of_corner])


@functools.lru_cache(maxsize=4)
def _ground_in_pixels(
    yaw: float, pitch: float, distance: float, size: int, height: float
) -> tuple[Array, Array, Array]:
    """What each pixel (size, size) shows of the ground.

    The arguments are those of `Camera`, with the height of its target, cm. Returns the point of the ground,
    (size, size, 2), relative to the point under the target, cm; the share of the ground's colour, the rest
    being background; and half the width of a grid line, cm.
    """
    camera = Camera(np.array([0.0, height, 0.0]), yaw, pitch, distance, size)
    pixel = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(pixel, -pixel)
    rays = np.stack([x, y, np.full_like(x, size * 1.75)], axis=-1) @ camera.axes
    far = camera.eye[1] / np.maximum(-rays[..., 1], 1e-6)
    place = camera.eye[[0, 2]] + rays[..., [0, 2]] * far[..., None]
    seen = np.clip(1.25 - np.linalg.norm(place, axis=-1) / FADE, 0, 1)
    return place, np.where(rays[..., 1] < -1e-6, seen, 0.0), 0.35 + 96 * np.maximum(far / size, 1e-5)


def _ground(camera: Camera) -> Array:
    """RGB (size, size, 3) of the ground at height 0 with its grid, fading into the background far away."""
    x, height, z = (float(v) for v in camera.target)
    pixels = _ground_in_pixels(camera.yaw, camera.pitch, camera.distance, camera.size, height)
    return draw_ground(*pixels, x, z, GRID, np.array([PAPER, GROUND, LINE]))
