"""Draws the character's body without a browser, with light, ground and shadow, as in the report page.

The triangles are drawn by a compiled function. It releases Python's global lock (GIL), so that several films
can be drawn at once.
"""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.runtime.generated import restore_bone_lengths

Picture = NDArray[np.uint8]  # (height, width, 3) RGB
FPS = 60  # frames a second of the motion
FRAME_STEP = 2  # every second frame of the motion becomes a picture of a film


def corner_normals(corners: Array, faces: Any) -> Array:
    """Unit normals (V, 3) at the V corners of a mesh, for shading.

    corners: (V, 3) positions. faces: (T, 3) indices of the corners of each triangle. A corner's normal is the
    mean of the normals of its triangles, weighted by their areas.
    """
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    # The cross product of two edges: the triangle's normal, with twice its area as length.
    normal = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    out = np.stack([np.bincount(faces.ravel(), axis, len(corners)) for axis in normal.T], axis=1)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


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
        left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        top, bottom = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        for y in range(max(0, int(np.ceil(top))), min(height - 1, int(np.floor(bottom))) + 1):
            for x in range(max(0, int(np.ceil(left))), min(width - 1, int(np.floor(right))) + 1):
                # Barycentric weights of the corners.
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                deep = u * a[2] + v * b[2] + w * c[2]
                if deep < depth[y, x]:
                    depth[y, x] = deep
                    for n in range(3):
                        picture[y, x, n] = u * colours[i, n] + v * colours[j, n] + w * colours[k, n]


SUPERSAMPLING = 2  # rendered pixels per picture pixel, in each direction
# Colours: red, green and blue from 0 to 1. LINE: the grid on the ground. A part of the body can be coloured
# by a value, such as the severity of an injury: BODY for value 0, MIDDLE for 0.5, HIGHEST for 1.
BACKGROUND = np.array([0.953, 0.945, 0.925], np.float32)
GROUND = np.array([0.905, 0.888, 0.850], np.float32)
LINE = np.array([0.60, 0.61, 0.62], np.float32)
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
    """Draws the body of a skeleton in any pose.

    regions: for each bone of the body, the indices of the values that colour it, in the argument `values` of
    `draw`. Without regions the body is grey.
    """

    def __init__(self, skeleton: Skeleton, regions: Sequence[Sequence[int]] = ()) -> None:
        self._skeleton, self._body = skeleton, body_mesh(skeleton)
        self._regions = [list(columns) for columns in regions] or [[] for _ in self._body.bones]

    def film(
        self, positions: Array, rotations: Array, camera: Callable[[int], Camera], values: Array | None = None
    ) -> list[Picture]:
        """A picture of every FRAME_STEP-th frame of a motion, as many as fit a whole number of times.

        positions, rotations: (F, J, 3), cm, and (F, J, 4) of the joints in the world. camera: of each frame.
        values: see `draw`.
        """
        bones = self._body.bones  # indices of the joints that move the body
        turns, places = restore_bone_lengths(self._skeleton, positions, rotations)
        frames = range(0, len(places) - len(places) % FRAME_STEP, FRAME_STEP)
        return [self.draw(places[f, bones], turns[f, bones], camera(f), values) for f in frames]

    def draw(self, places: Array, turns: Array, camera: Camera, values: Array | None = None) -> Picture:
        """An RGB picture (size, size, 3).

        places, turns: positions (B, 3), cm, and rotations (B, 4) of the bones. values: 1D, from 0 to 1; the
        highest value of a bone's regions colours it. None: all values are 0.
        """
        corners = self._body.posed(places, turns)
        key_light = np.array([0.55 * np.sin(camera.yaw - 0.85), 0.78, 0.55 * np.cos(camera.yaw - 0.85)])
        key_light /= np.linalg.norm(key_light)
        rim_light = np.array([0.9 * np.sin(camera.yaw + 2.5), 0.35, 0.9 * np.cos(camera.yaw + 2.5)])
        # The shadow: the body's corners, moved along the key light to the ground. The body is closed, so the
        # triangles on one side of it cover all of its shadow.
        on_ground, size = corners - key_light * (corners[:, 1:2] / key_light[1]), camera.size
        dark, depth = np.zeros((size, size, 3), np.float32), np.full((size, size), np.inf, np.float32)
        draw_triangles(camera.project(on_ground), np.zeros_like(corners), self._body.faces, dark, depth)
        shadow = gaussian_filter(np.isfinite(depth).astype(np.float32), size / 130)
        background = _ground(camera) * (1 - 0.42 * shadow[..., None])
        normal = corner_normals(corners, self._body.faces)
        # Light from the sky, weaker where the body covers itself; then the key light and the rim light.
        brightness = (
            (0.50 + 0.10 * normal[:, 1]) * (0.55 + 0.45 * self._body.shade)
            + 0.58 * np.maximum(normal @ key_light, 0)
            + 0.16 * np.maximum(normal @ rim_light, 0) ** 2
        )
        colours = np.minimum(self._colours(values) * brightness[:, None], 1.0)
        picture = np.repeat(np.repeat(background, SUPERSAMPLING, axis=0), SUPERSAMPLING, axis=1)
        depth = np.full(picture.shape[:2], np.inf, np.float32)
        draw_triangles(camera.project(corners, SUPERSAMPLING), colours, self._body.faces, picture, depth)
        fine = Image.fromarray(np.uint8(255 * picture + 0.5))
        return np.array(fine.reduce(SUPERSAMPLING))

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


def _ground(camera: Camera) -> Array:
    """RGB (size, size, 3) of the ground at height 0 with its grid, fading into the background far away."""
    pixel = np.arange(camera.size, dtype=np.float32) + 0.5 - camera.size / 2
    rays = np.stack(
        [*np.meshgrid(pixel, -pixel), np.full((camera.size,) * 2, 1.75 * camera.size, np.float32)]
    )
    x, y, z = np.tensordot(camera.axes.T.astype(np.float32), rays, axes=1)
    # The rays are in pixels. A ray times this factor reaches the ground; rays upwards meet no ground.
    eye, cm_per_pixel = camera.eye.astype(np.float32), np.float32(camera.eye[1]) / np.maximum(-y, 1e-6)
    x, z = eye[0] + x * cm_per_pixel, eye[2] + z * cm_per_pixel
    away = np.hypot(x - np.float32(camera.target[0]), z - np.float32(camera.target[2]))
    seen = np.where(y < -1e-6, np.clip(1.25 - away / FADE, 0, 1), 0)[
        ..., None
    ]  # share of the ground's colour
    to_line = np.minimum(*(np.abs(way - GRID * np.round(way / GRID)) for way in (x, z)))
    # The share of the line's colour. It falls smoothly to 0, so that lines have no jagged edges.
    half_width = 0.35 + 96 * np.maximum(cm_per_pixel / camera.size, 1e-5)
    line = 0.30 * np.clip(1.4 - to_line / half_width, 0, 1)[..., None] * seen
    return BACKGROUND + seen * (GROUND - BACKGROUND) + line * (LINE - GROUND)


def webp(pictures: Sequence[Picture], loop: int, quality: int, effort: int) -> bytes:
    """A film as an animated WebP.

    loop: how often it plays, 0: endlessly. quality: 0 to 100. effort: of the encoder, 0 to 6.
    """
    # Whole milliseconds, rounded so that they add up to the true duration.
    ends = np.round(1000 * FRAME_STEP / FPS * np.arange(len(pictures) + 1)).astype(int)
    out, (first, *others) = io.BytesIO(), map(Image.fromarray, pictures)
    options = {"duration": np.diff(ends).tolist(), "loop": loop, "quality": quality, "method": effort}
    first.save(out, "WEBP", save_all=True, append_images=others, **options)
    return out.getvalue()
