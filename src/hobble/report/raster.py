"""Draws the character's body without a browser, with light, ground and shadow, as in the report page."""

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
# Colours: red, green and blue from 0 to 1. LINE: the grid on the ground. A part of the body can be coloured
# by a value, such as the severity of an injury: BODY for value 0, MIDDLE for 0.5, HIGHEST for 1.
BACKGROUND = np.array([0.953, 0.945, 0.925])
GROUND = np.array([0.905, 0.888, 0.850])
LINE = np.array([0.60, 0.61, 0.62])
BODY = np.array([0.70, 0.735, 0.765])
MIDDLE, HIGHEST = np.array([0.914, 0.725, 0.286]), np.array([0.761, 0.220, 0.169])
GRID = 50.0  # cm between the lines on the ground
# The ground fades into the background over this distance, cm. It begins to fade FADE / 4 from the point below
# the camera's target.
FADE = 700.0


@dataclass(frozen=True)
class Camera:
    """A camera that looks at `target` (3,) from `distance`, both in cm.

    yaw, pitch: direction from the target to the camera, radians; with yaw 0 the camera is at +z, with pitch 0
    at the height of the target. size: pixels on each side of the square picture. The focal length is 1.75
    times the size.
    """

    target: Array
    yaw: float = 0.75
    pitch: float = 0.2
    distance: float = 330.0
    size: int = 400

    @property
    def axes(self) -> Array:
        """(3, 3) unit vectors in world axes, one in each row: right, up, and into the picture."""
        level = np.cos(self.pitch)
        ahead = -np.array([level * np.sin(self.yaw), np.sin(self.pitch), level * np.cos(self.yaw)])
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(right, ahead), ahead])

    @property
    def eye(self) -> Array:
        """Position of the camera (3,), cm."""
        return self.target - self.distance * self.axes[2]

    def project(self, points: Array, scale: int = 1) -> Array:
        """(V, 3): x and y in pixels, y downwards, and depth in cm, of world points (V, 3).

        scale: the picture's pixels on each side, as a multiple of `size`.
        """
        across, up, depth = ((points - self.eye) @ self.axes.T).T
        depth = np.maximum(depth, 1.0)
        half, focal = scale * self.size / 2, scale * self.size * 1.75
        return np.stack([half + focal * across / depth, half - focal * up / depth, depth], axis=1)


class BodyRenderer:
    """Draws a body in any pose.

    regions: for each bone of the body, the indices of the values that colour it, in the argument `values` of
    `draw`. Without regions the body is grey.
    """

    def __init__(self, body: Mesh, regions: Sequence[Sequence[int]] = ()) -> None:
        self._body, self._faces = body, body.faces
        self._regions = [list(columns) for columns in regions] or [[] for _ in body.bones]

    def draw(
        self, places: Array, turns: Array, camera: Camera, values: Array | None = None
    ) -> NDArray[np.uint8]:
        """An RGB picture (size, size, 3).

        places, turns: positions (B, 3), cm, and rotations (B, 4) of the bones. values: 1D, from 0 to 1; the
        highest value of a bone's regions colours it. None: all values are 0.
        """
        corners = self._body.posed(places, turns)
        key_light = np.array([0.55 * np.sin(camera.yaw - 0.85), 0.78, 0.55 * np.cos(camera.yaw - 0.85)])
        key_light /= np.linalg.norm(key_light)
        rim_light = np.array([0.9 * np.sin(camera.yaw + 2.5), 0.35, 0.9 * np.cos(camera.yaw + 2.5)])
        # The shadow: the body's corners, moved along the key light to the ground.
        shadow = np.zeros((camera.size, camera.size), np.float32)
        on_ground = corners - key_light * (corners[:, 1:2] / key_light[1])
        fill_triangles(camera.project(on_ground), self._faces, shadow)
        background = _ground(camera)
        background *= 1 - 0.42 * gaussian_filter(shadow, camera.size / 130)[..., None]
        normal = corner_normals(corners, self._faces)
        # Light from the sky, weaker where the body covers itself; then the key light and the rim light.
        brightness = (
            (0.50 + 0.10 * normal[:, 1]) * (0.55 + 0.45 * self._body.shade)
            + 0.58 * np.maximum(normal @ key_light, 0)
            + 0.16 * np.maximum(normal @ rim_light, 0) ** 2
        )
        colours = self._colours(values) * brightness[:, None]
        fine = camera.size * SUPERSAMPLING
        picture, depth = np.zeros((fine, fine, 3), np.float32), np.full((fine, fine), np.inf, np.float32)
        draw_triangles(camera.project(corners, SUPERSAMPLING), colours, self._faces, picture, depth)
        return finish_picture(picture, depth, background, SUPERSAMPLING)

    def _colours(self, values: Array | None) -> Array:
        """RGB (V, 3) of the corners, from BODY (grey) over MIDDLE (amber) to HIGHEST (red)."""
        if values is None:
            return np.broadcast_to(BODY, self._body.corners.shape)
        bones = np.tile(BODY, (len(self._body.bones), 1))
        for i, columns in enumerate(self._regions):
            t = max((float(values[column]) for column in columns), default=0.0)
            if t:  # even a small value gives 35 % of the colour, so that it can be seen
                low = BODY + (MIDDLE - BODY) * min(1.0, 0.35 + 1.3 * t)
                bones[i] = low if t < 0.5 else MIDDLE + (HIGHEST - MIDDLE) * (2 * t - 1)
        return np.einsum("vk,vkc->vc", self._body.weights, bones[self._body.bones_of_corner])


@functools.lru_cache(maxsize=4)
def _ground_in_pixels(
    yaw: float, pitch: float, distance: float, size: int, height: float
) -> tuple[Array, Array, Array]:
    """What each pixel shows of the ground.

    height: of the camera's target, cm. The other arguments are those of `Camera`. Returns

    - (size, size, 2) x and z of the point on the ground, relative to the point under the target, cm;
    - (size, size) how much of the ground's colour the pixel has: 1 only ground, 0 only background;
    - (size, size) half the width of a grid line at this point, cm.

    The result does not depend on x and z of the target, so it is kept for the next frames of a film.
    """
    camera = Camera(np.array([0.0, height, 0.0]), yaw, pitch, distance, size)
    pixel = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(pixel, -pixel)
    rays = np.stack([x, y, np.full_like(x, size * 1.75)], axis=-1) @ camera.axes
    # The rays are in pixels. A ray times this factor reaches the ground.
    cm_per_pixel = camera.eye[1] / np.maximum(-rays[..., 1], 1e-6)
    place = camera.eye[[0, 2]] + rays[..., [0, 2]] * cm_per_pixel[..., None]
    seen = np.clip(1.25 - np.linalg.norm(place, axis=-1) / FADE, 0, 1)
    half_width = 0.35 + 96 * np.maximum(cm_per_pixel / size, 1e-5)
    return place, np.where(rays[..., 1] < -1e-6, seen, 0.0), half_width  # rays upwards meet no ground


def _ground(camera: Camera) -> Array:
    """RGB (size, size, 3) of the ground at height 0 with its grid, fading into the background far away."""
    x, height, z = (float(v) for v in camera.target)
    pixels = _ground_in_pixels(camera.yaw, camera.pitch, camera.distance, camera.size, height)
    return draw_ground(*pixels, x, z, GRID, np.array([BACKGROUND, GROUND, LINE]))
