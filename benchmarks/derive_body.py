"""Sculpts the body that Hobble draws and exports, and writes it as src/hobble/figure/body.npz and body.jpg.

    python benchmarks/derive_body.py [--triangles 11600] [--out FOLDER]

It needs Blender as a module and a library for images, in an environment of its own with Python 3.11:
`pip install bpy scikit-image scipy numba pydantic pyyaml`.

The surface is where the distance to blended solids is zero. The left half is sculpted around the joints of
holden31 with arms and legs a little spread, reduced to the given number of triangles, and mirrored. Blender
reduces it, unwraps it and computes how much light reaches it.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image
from scipy.interpolate import CubicSpline
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import MOST_BONES, modelled_pose

ROOT = Path(__file__).parents[1]
SPACING = 0.25  # cm between the points at which distances are computed
FAR = 12.0  # cm; larger distances are not computed
TEXTURE = 1024  # pixels on each side
COLOUR = np.array([0.72, 0.70, 0.67])  # of the clay: red, green, blue, from 0 to 1

# The part of a solid that one bone moves: where it begins along the solid, cm, and the bone's role.
Owners = tuple[tuple[float, str], ...]
Point = Sequence[float]


@dataclass(frozen=True)
class Solid:
    """A part of the body. Solids are added one after another.

    blend: how wide the zone is in which the solid blends with the body so far, cm. owners: the bones that
    move it. is_cut: whether it is cut from the body instead of added.
    """

    owners: Owners
    blend: float
    is_cut: bool = field(default=False, kw_only=True)

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """Signed distances of points from the surface, cm, negative inside. The three arrays broadcast."""
        raise NotImplementedError

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner (3,) of the bounding box."""
        raise NotImplementedError

    def along(self, points: Array) -> Array:
        """(N,) position of points (N, 3) along the solid, cm, which decides who of `owners` moves them."""
        return np.zeros(len(points))


@dataclass(frozen=True)
class Swept(Solid):
    """Sections across a straight line from `start` along the unit vector `axis`.

    Each row of `sections` has the position along the line, half width along the unit vector `across`, half
    depth along the cross product of both, the section's centre in these two directions (all cm), and the
    exponent of the superellipse. Cubic splines connect the sections.
    """

    start: Array
    axis: Array
    across: Array
    sections: Array

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        rows, local = self.sections, (x - self.start[0], y - self.start[1], z - self.start[2])
        directions = (self.axis, self.across, np.cross(self.axis, self.across))
        s, u, v = (sum(part * d[i] for i, part in enumerate(local)) for d in directions)
        spline = CubicSpline(rows[:, 0], rows[:, 1:], axis=0)
        wide, deep, cu, cv, n = np.moveaxis(spline(np.clip(s, rows[0, 0], rows[-1, 0])), -1, 0)
        # Splines may swing below the values of the sections.
        wide, deep = np.maximum(wide, rows[:, 1].min() / 2), np.maximum(deep, rows[:, 2].min() / 2)
        a, b = np.abs(u - cu), np.abs(v - cv)
        # q is 1 on the outline of the section. The distance is measured along the line to the centre.
        q = ((a / wide) ** n + (b / deep) ** n) ** (1 / n) + 1e-9
        aside = np.maximum(np.hypot(a, b) * (1 - 1 / q), -np.minimum(wide, deep))
        end = np.maximum(rows[0, 0] - s, s - rows[-1, 0])  # distance beyond the nearer end, negative inside
        return np.where(end > 0, np.hypot(np.maximum(aside, 0), end), np.maximum(aside, end))

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        rows, third = self.sections, np.cross(self.axis, self.across)
        centres = self.start + rows[:, :1] * self.axis + rows[:, 3:4] * self.across + rows[:, 4:5] * third
        reach = np.maximum(rows[:, 1], rows[:, 2])[:, None]
        return (centres - reach).min(axis=0), (centres + reach).max(axis=0)

    def along(self, points: Array) -> Array:
        """As in `Solid`."""
        return (points - self.start) @ self.axis


@dataclass(frozen=True)
class Ball(Solid):
    """An ellipsoid around `centre` with half axes `radii` (3,), cm, along x, y and z."""

    centre: Array
    radii: Array

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`: k0 - 1, which is 0 on the surface, divided by the slope of k0, which is k1 / k0."""
        local = [p - c for p, c in zip((x, y, z), self.centre, strict=True)]
        k0 = np.sqrt(sum((p / r) ** 2 for p, r in zip(local, self.radii, strict=True)))
        k1 = np.sqrt(sum((p / r**2) ** 2 for p, r in zip(local, self.radii, strict=True)))
        return np.where(k1 > 1e-9, k0 * (k0 - 1) / np.maximum(k1, 1e-9), -self.radii.min())

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        return self.centre - self.radii, self.centre + self.radii


@dataclass(frozen=True)
class Rod(Solid):
    """A rod with round ends. Its radius changes from `thick` at `start` to `thin` at `end`, cm."""

    start: Array
    end: Array
    thick: float
    thin: float

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        way, local = self.end - self.start, (x - self.start[0], y - self.start[1], z - self.start[2])
        # Share of the way from start to end at which the rod is nearest to the point.
        t = np.clip(sum(p * way[i] for i, p in enumerate(local)) / (way @ way), 0, 1)
        from_axis = np.sqrt(sum((p - t * way[i]) ** 2 for i, p in enumerate(local)))
        return from_axis - (self.thick + (self.thin - self.thick) * t)

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        reach = max(self.thick, self.thin)
        return np.minimum(self.start, self.end) - reach, np.maximum(self.start, self.end) + reach


def blended(a: Array, b: Array, solid: Solid) -> Array:
    """Distance to the body with a solid added or cut, from the distances `a` to the body and `b` to it.

    Where the two differ by less than the solid's `blend`, the edge between them is rounded.
    """
    sign = -1.0 if solid.is_cut else 1.0
    near = np.maximum(solid.blend - np.abs(sign * a - b), 0) / solid.blend
    return sign * (np.minimum(sign * a, b) - 0.25 * solid.blend * near * near)


# The figure. All numbers are cm. Each row of a table is one section, see `Swept`.

# height above the root; half width; half depth; how far the centre is ahead of the spine; exponent
TRUNK = (
    (-18.5, 3.5, 4.5, 0.2, 2.0),
    (-16.5, 7.0, 7.0, 0.0, 2.0),
    (-13.0, 12.6, 9.6, -0.3, 2.1),
    (-8.0, 15.2, 10.6, -0.5, 2.2),
    (-3.0, 15.3, 10.6, -0.4, 2.2),
    (3.0, 14.0, 9.9, -0.1, 2.2),
    (9.0, 12.6, 9.0, 0.3, 2.2),
    (16.0, 12.9, 9.2, 0.6, 2.2),
    (22.0, 14.4, 10.2, 0.6, 2.3),
    (27.0, 15.8, 10.7, 0.4, 2.35),
    (31.0, 16.2, 10.0, 0.0, 2.3),
    (34.5, 14.4, 8.4, -0.6, 2.2),
    (38.0, 9.4, 6.8, -1.0, 2.1),
    (41.0, 6.4, 6.0, -1.0, 2.0),
    (44.0, 5.5, 5.7, -0.7, 2.0),
    (49.0, 5.2, 5.5, -0.1, 2.0),
    (54.0, 4.2, 4.6, 0.4, 2.0),
)
# position along thigh (0 to 1) and shank (1 to 2); half width; half depth; how far the centre is ahead
LEG = (
    (-0.3, 1.2, 1.6, -0.4),
    (-0.2, 4.0, 5.2, -0.4),
    (-0.1, 6.8, 8.0, -0.2),
    (0.0, 8.4, 9.5, 0.0),
    (0.2, 8.6, 9.3, 0.4),
    (0.45, 7.6, 8.3, 0.6),
    (0.72, 6.1, 6.7, 0.4),
    (0.9, 5.2, 5.8, 0.3),
    (1.0, 5.0, 5.7, 0.3),
    (1.1, 4.8, 5.5, -0.4),
    (1.28, 5.4, 6.1, -1.4),
    (1.45, 4.9, 5.5, -1.2),
    (1.66, 3.8, 4.3, -0.7),
    (1.86, 3.1, 3.7, -0.3),
    (1.97, 3.1, 3.7, -0.2),
    (2.06, 2.9, 3.3, -0.2),
)
# position along upper arm (0 to 1) and forearm (1 to 2); half width, from front to back; half depth
ARM = (
    (-0.26, 0.9, 0.9),
    (-0.19, 2.9, 2.7),
    (-0.09, 4.8, 4.5),
    (0.04, 5.7, 5.4),
    (0.18, 5.4, 5.2),
    (0.36, 4.8, 4.6),
    (0.62, 4.3, 4.0),
    (0.86, 3.7, 3.5),
    (1.0, 3.6, 3.45),
    (1.16, 4.1, 3.7),
    (1.35, 3.9, 3.4),
    (1.68, 3.15, 2.5),
    (1.93, 2.75, 1.95),
    (2.10, 2.75, 1.75),
    (2.24, 2.4, 1.3),
)
# cm from the wrist; half width; half thickness; how far the centre is towards the thumb
PALM = (
    (-2.5, 1.9, 1.3, 0.0),
    (-0.5, 2.6, 1.75, 0.05),
    (1.5, 3.1, 1.8, 0.15),
    (4.0, 3.85, 1.75, 0.25),
    (7.0, 4.1, 1.5, 0.1),
    (9.2, 3.9, 1.25, 0.0),
    (10.2, 3.3, 0.95, 0.0),
)
# how far the finger's root is towards the thumb; how far it is from the wrist; length; half width
FINGERS = ((3.05, 8.7, 7.0, 0.84), (1.0, 9.2, 7.8, 0.86), (-1.05, 8.9, 7.2, 0.83), (-3.0, 8.1, 5.6, 0.74))
CURL = (0.16, 0.30, 0.26)  # radians, bend of each finger joint, from the knuckle on
# Place along the foot as the sum of two numbers, a share of the way from ankle to ball and cm; half width;
# height; how far the centre is towards the other foot
FOOT = (
    (0.0, -6.0, 2.4, 4.6, 0.0),
    (0.0, -5.0, 3.2, 6.8, 0.0),
    (0.0, -3.0, 3.6, 8.6, 0.0),
    (0.0, 0.5, 3.7, 9.6, 0.0),
    (0.25, 0.0, 3.8, 8.7, 0.0),
    (0.55, 0.0, 4.1, 6.9, 0.2),
    (0.85, 0.0, 4.6, 5.3, 0.4),
    (1.0, 1.0, 4.7, 4.5, 0.5),
    (1.0, 4.0, 4.4, 3.7, 0.8),
    (1.0, 6.5, 3.6, 3.1, 1.0),
    (1.0, 8.0, 2.6, 2.5, 1.1),
    (1.0, 8.9, 1.2, 1.8, 1.1),
)
TOE_HEIGHT = 2.5  # of the ball of the foot above the sole


def unit(v: Array) -> Array:
    """The vector with length 1."""
    return np.asarray(v, float) / np.linalg.norm(v)


def solids(at: dict[str, Array]) -> Iterator[Solid]:
    """The solids of the left half, in the order in which they are added. at: role -> place of its joint."""
    yield from _trunk(at)
    yield from _limbs(at)
    yield from _foot(at)
    yield from _hand(at)
    yield from _head(at["head"])


def _trunk(at: dict[str, Array]) -> Iterator[Solid]:
    spine = np.array([at[role] for role in ("left_hip", "spine", "chest", "neck", "head")])

    def middle(y: float) -> float:
        """Depth (z) of the spine at a height."""
        return float(np.interp(y, spine[:, 1], spine[:, 2]))

    rows = np.array([(y, w, d, 0.0, middle(y) + f, n) for y, w, d, f, n in TRUNK])
    owners = ((-np.inf, "hips"), (7.7, "spine"), (20.2, "chest"), (40.0, "neck"), (49.0, "head"))
    yield Swept(owners, 0.1, np.zeros(3), np.array([0.0, 1, 0]), np.array([-1.0, 0, 0]), rows)
    for role, blend, centre, radii in (
        ("chest", 5.0, (6.8, 28.0, 6.2), (7.0, 5.2, 3.9)),  # breast
        ("chest", 4.0, (7.6, 29.0, -6.2), (6.4, 7.5, 3.3)),  # shoulder blade
        ("hips", 6.0, (6.6, -9.5, -4.8), (6.8, 7.6, 6.6)),  # seat
    ):
        x, y, z = centre
        yield Ball(((-np.inf, role),), blend, np.array([x, y, z + middle(y)]), np.array(radii))
    outer = at["left_shoulder"] + np.array([-1.5, 1.6, -0.2])
    yield Rod(((-np.inf, "chest"),), 5.5, np.array([2.6, 41.0, -2.2]), outer, 2.8, 3.4)  # from the neck
    # The chest and the back reach to the arm below the shoulder.
    below = at["left_shoulder"]
    yield Ball(((-np.inf, "chest"),), 5.0, below + np.array([-4.6, -4.5, 1.0]), np.array([4.6, 5.6, 5.6]))


def _limbs(at: dict[str, Array]) -> Iterator[Solid]:
    def limb(roles: tuple[str, str, str], ahead: Array, table: Sequence[Point], blend: float) -> Swept:
        """A solid along two bones in one line. ahead: the direction of a section's depth."""
        a, b, c = (at[f"left_{role}"] for role in roles)
        axis = unit(c - a)
        first, second = float((b - a) @ axis), float((c - b) @ axis)
        across = unit(np.cross(ahead, axis))
        rows = [
            (t * first if t < 1 else first + (t - 1) * second, wide, deep, 0.0, (more or (0.0,))[0], 2.0)
            for t, wide, deep, *more in table
        ]
        above = "chest" if roles[0] == "shoulder" else "hips"
        owners = ((-np.inf, above), (-1.5, f"left_{roles[0]}"), (first, f"left_{roles[1]}"))
        return Swept(owners, blend, a, axis, across, np.array(rows))

    yield limb(("hip", "knee", "heel"), np.array([0.0, 0, 1]), LEG, 3.5)
    kneecap = at["left_knee"] + np.array([0.0, 0.4, 4.2])
    yield Ball(((-np.inf, "left_knee"),), 3.0, kneecap, np.array([2.6, 3.4, 1.8]))
    # The depth of an arm is measured outward, towards the back of the hand, and the width from front to back.
    yield limb(("shoulder", "elbow", "wrist"), np.array([1.0, 0.6, 0]), ARM, 8.0)
    deltoid = at["left_shoulder"] + np.array([1.4, -2.4, 0.2])
    yield Ball(((-np.inf, "left_shoulder"),), 5.0, deltoid, np.array([4.3, 6.4, 5.3]))


def _foot(at: dict[str, Array]) -> Iterator[Solid]:
    ankle, ball = at["left_heel"], at["left_toe"]
    sole, way = ball[1] - TOE_HEIGHT, (ball - ankle) * [1.0, 0.0, 1.0]
    length, ahead, up = float(np.linalg.norm(way)), unit(way), np.array([0.0, 1, 0])
    # The section reaches from 0.28 of its height below the sole to its height above it.
    rows = [
        (t * length + cm, wide, 0.64 * high, aside, 0.36 * high, 2.3) for t, cm, wide, high, aside in FOOT
    ]
    owners = ((-np.inf, "left_heel"), (length - 0.5, "left_toe"))
    across = np.cross(up, ahead) * -1  # towards the other foot
    start = np.array([ankle[0], sole, ankle[2]])
    if np.cross(ahead, across) @ up < 0:
        across = -across
        rows = [(s, wide, deep, -aside, middle, n) for s, wide, deep, aside, middle, n in rows]
    yield Swept(owners, 2.5, start, ahead, across, np.array(rows))
    below = start + ahead * 0.6 * length - 10 * up  # a ball so flat that it cuts along the sole
    yield Ball(owners[:1], 1.0, below, np.array([80.0, 10.0, 80.0]), is_cut=True)


def _hand(at: dict[str, Array]) -> Iterator[Solid]:
    wrist = at["left_wrist"]
    ahead = unit(wrist - at["left_elbow"])
    thumb = unit(np.array([0.0, 0, 1]) - ahead * ahead[2])
    palm = np.cross(ahead, thumb)  # out of the palm
    owner = ((-np.inf, "left_wrist"),)

    def place(out: float, aside: float, deep: float) -> Array:
        """The point `out` along the hand from the wrist, `aside` to the thumb and `deep` out of the palm."""
        return wrist + out * ahead + aside * thumb + deep * palm

    rows = np.array([(out, wide, deep, aside, 0.0, 2.5) for out, wide, deep, aside in PALM])
    yield Swept(owner, 2.4, wrist, ahead, thumb, rows)
    yield Ball(owner, 2.0, place(3.4, 1.9, 1.3), np.array([2.0, 2.6, 2.0]))  # the thumb's muscle
    for aside, begin, length, thick in FINGERS:
        joint, bend = place(begin, aside, 0.0), 0.0
        # Each finger has three segments with these shares of its length.
        for segment, (share, joint_bend) in enumerate(zip((0.42, 0.32, 0.26), CURL, strict=True)):
            bend += joint_bend
            way = unit(np.cos(bend) * ahead + np.sin(bend) * palm + 0.05 * aside * thumb)
            tip = joint + share * length * way
            a, b = thick * (1 - 0.08 * segment), thick * (1 - 0.08 * (segment + 1))
            yield Rod(owner, 0.5, joint, tip, a, b)
            joint = tip
    root, joint, tip = place(2.4, 2.4, 0.6), place(5.8, 4.7, 1.5), place(9.1, 5.9, 2.2)
    yield Rod(owner, 1.4, root, joint, 1.5, 1.12)
    yield Rod(owner, 0.5, joint, tip, 1.12, 0.86)


def _head(base: Array) -> Iterator[Solid]:
    """The solids of the head. Their places are cm from the head joint."""
    owner = ((-np.inf, "head"),)

    def ball(blend: float, centre: Point, radii: Point, *, is_cut: bool = False) -> Ball:
        return Ball(owner, blend, base + np.array(centre), np.array(radii, float), is_cut=is_cut)

    def rod(blend: float, a: Point, b: Point, thick: float, thin: float, *, is_cut: bool = False) -> Rod:
        return Rod(owner, blend, base + np.array(a), base + np.array(b), thick, thin, is_cut=is_cut)

    yield ball(2.0, (0, 9.5, 0.2), (7.2, 8.6, 9.0))  # skull
    yield ball(4.0, (0, 2.9, 3.8), (5.0, 7.2, 5.5))  # face
    yield ball(3.0, (0, -3.3, 7.0), (2.1, 1.7, 1.8))  # chin
    yield rod(3.5, (4.3, 1.0, 1.4), (1.3, -3.0, 6.2), 1.25, 1.2)  # jaw
    yield ball(3.5, (3.5, 4.0, 6.2), (1.9, 1.7, 1.7))  # cheekbone
    yield rod(2.6, (0.6, 8.7, 8.7), (4.3, 8.6, 7.2), 0.85, 0.7)  # brow
    yield ball(2.2, (3.0, 6.7, 10.9), (1.9, 1.15, 2.1), is_cut=True)  # eye socket
    yield ball(0.4, (2.95, 6.65, 7.75), (1.3, 1.15, 1.15))  # eye
    yield ball(1.0, (7.1, 6.0, -0.4), (0.9, 2.9, 1.7))  # ear
    yield ball(0.6, (8.2, 6.4, 0.1), (0.75, 1.7, 0.85), is_cut=True)
    yield rod(1.6, (0, 8.0, 8.9), (0, 4.4, 10.9), 0.7, 0.95)  # nose
    yield ball(0.9, (0, 3.95, 11.1), (1.15, 0.85, 1.0))
    yield ball(0.8, (1.2, 3.7, 10.1), (0.7, 0.7, 0.95))
    yield ball(2.4, (0, 0.6, 7.9), (2.8, 2.3, 1.7))  # mouth
    yield rod(0.8, (0.45, 1.45, 9.5), (2.3, 0.8, 8.65), 0.5, 0.25)  # upper lip
    yield rod(0.8, (0, 0.05, 9.35), (1.8, 0.45, 8.7), 0.54, 0.32)  # lower lip
    yield rod(0.6, (0, 0.80, 10.2), (2.4, 0.72, 9.15), 0.28, 0.24, is_cut=True)  # between the lips


# From solids to a surface.


def distances(parts: Sequence[Solid], points: Array) -> Array:
    """(N,) signed distance of points (N, 3) from the body, cm, at most FAR. Both halves are alike."""
    out, (x, y, z) = np.full(len(points), FAR), points.T
    x = np.abs(x)
    for part in parts:
        low, high = (corner[:, None] for corner in part.bounds())
        where = np.array([x, y, z])
        near = np.flatnonzero(((where > low - 13) & (where < high + 13)).all(axis=0))
        if len(near):
            out[near] = blended(out[near], part.distance(x[near], y[near], z[near]), part)
    return out


def slopes(parts: Sequence[Solid], points: Array, h: float = 0.06) -> tuple[Array, Array]:
    """Slope (N, 3) of the distance at points (N, 3), from the corners of a tetrahedron, and distance (N,)."""
    slope, away = np.zeros_like(points), np.zeros(len(points))
    for corner in np.array([[1.0, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]]):
        found = distances(parts, points + h * corner)
        slope += found[:, None] * corner / (4 * h)
        away += found / 4
    return slope, away


def left_half(parts: Sequence[Solid]) -> tuple[Array, Array]:
    """A fine mesh of the half at x >= 0, open at x = 0: corners (V, 3) and faces (T, 3)."""
    added = [part for part in parts if not part.is_cut]
    low = np.min([part.bounds()[0] for part in added], axis=0) - 2.0
    high = np.max([part.bounds()[1] for part in added], axis=0) + 2.0
    low[0] = 0.0
    axes = [np.arange(low[i], high[i], SPACING) for i in range(3)]
    values = np.full([len(axis) for axis in axes], FAR)
    for part in parts:
        box, reach = part.bounds(), 2 * part.blend + 1.0
        cut = tuple(
            slice(max(0, np.searchsorted(axis, box[0][i] - reach)), np.searchsorted(axis, box[1][i] + reach))
            for i, axis in enumerate(axes)
        )
        grid = np.meshgrid(*(axis[c] for axis, c in zip(axes, cut, strict=True)), indexing="ij", sparse=True)
        values[cut] = blended(values[cut], part.distance(*grid), part)
    corners, faces, _, _ = marching_cubes(values, 0.0, spacing=(SPACING,) * 3)
    return corners + low, faces


def blender_mesh(name: str, corners: Array, faces: Array) -> Any:
    """An object of Blender with this mesh, made active."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners.tolist(), [], faces.tolist())
    made = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    made.select_set(True)
    return made


def arrays(made: Any) -> tuple[Array, Array]:
    """Corners (V, 3) and triangles (T, 3) of an object."""
    mesh = made.data
    corners = np.array([v.co for v in mesh.vertices], float)
    return corners, np.array([p.vertices for p in mesh.polygons])


def reduced(
    parts: Sequence[Solid], corners: Array, faces: Array, count: int, keep: Array
) -> tuple[Array, Array]:
    """The same half with `count` triangles. keep: (V,) 0 to 1, how much finer than others a part stays."""
    made = blender_mesh("half", corners, faces)
    group = made.vertex_groups.new(name="keep")
    for step in np.unique(np.round(keep, 2)):
        group.add(np.flatnonzero(np.round(keep, 2) == step).tolist(), 1.0 - float(step), "REPLACE")
    modifier = made.modifiers.new("reduce", "DECIMATE")
    modifier.ratio, modifier.use_collapse_triangulate = count / len(faces), True
    modifier.vertex_group, modifier.vertex_group_factor = "keep", 1.0
    bpy.ops.object.modifier_apply(modifier="reduce")
    corners, faces = arrays(made)
    bpy.data.objects.remove(made)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    found, times = np.unique(edges, axis=0, return_counts=True)
    seam = np.unique(found[times == 1])  # the corners in the middle of the body
    for _ in range(2):  # reducing has moved the corners off the surface
        corners[seam, 0] = 0.0
        slope, away = slopes(parts, corners)
        step = (away / np.maximum((slope * slope).sum(axis=1), 0.25))[:, None] * slope
        corners -= step * np.minimum(
            1.0, 0.15 / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9)
        )
    corners[seam, 0] = 0.0
    return corners, faces


def mirrored(corners: Array, faces: Array) -> tuple[Array, Array]:
    """Both halves as one closed mesh, from the left one."""
    free = corners[:, 0] != 0
    other = np.arange(len(corners))
    other[free] = len(corners) + np.arange(free.sum())
    return np.concatenate([corners, corners[free] * [-1, 1, 1]]), np.concatenate(
        [faces, other[faces][:, ::-1]]
    )


# What the mesh carries: weights of bones, light, texture.


def owners_of(parts: Sequence[Solid], points: Array) -> NDArray[np.str_]:
    """(N,) the role of the bone that moves the solid nearest to each point (N, 3)."""
    out, nearest = np.full(len(points), "hips", dtype="<U16"), np.full(len(points), np.inf)
    mirrored_points = points * [-1, 1, 1]
    left = np.where(points[:, :1] < 0, mirrored_points, points)
    for part in parts:
        if part.is_cut:
            continue
        distance = part.distance(*left.T)
        nearer, along = distance < nearest, part.along(left)
        for begin, role in part.owners:
            out[nearer & (along >= begin)] = role
        nearest = np.minimum(nearest, distance)
    is_right = (points[:, 0] < 0) & np.char.startswith(out, "left_")
    out[is_right] = np.char.replace(out[is_right], "left_", "right_")
    return out


def spread_weights(parts: Sequence[Solid], corners: Array, faces: Array) -> tuple[list[str], Array]:
    """Roles (B,) and weights (V, B) of their bones, which sum to 1.

    At first each corner has weight 1 for its owner. Then the weights spread like heat, only along the
    surface, and so never from a thigh to a hand beside it.
    """
    owner = owners_of(parts, corners)
    roles = sorted(set(owner.tolist()))
    shares = (owner[:, None] == np.array(roles)).astype(float)
    reach = np.full(len(corners), 4.2)  # cm over which the weights of two bones blend
    for word, narrow in (("wrist", 1.2), ("head", 2.6), ("neck", 2.6), ("heel", 1.8), ("toe", 1.8)):
        reach[[word in role for role in owner]] = narrow
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    a, b = np.unique(edges, axis=0).T
    length = np.maximum(np.linalg.norm(corners[a] - corners[b], axis=1), 0.05)
    flow = (np.minimum(reach[a], reach[b]) / length) ** 2 / 6  # the more, the farther the weights spread
    count = len(corners)
    graph = coo_array((np.r_[flow, flow], (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr()
    # Implicit steps of the heat equation; after one step the weights still have a kink at a joint.
    solve = splu((diags_array(1 + np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()).solve
    return roles, solve(solve(shares))


def largest_weights(weights: Array) -> tuple[NDArray[np.uint8], Array]:
    """The MOST_BONES largest of weights (V, B) as bones and weights, both (V, 4). They sum to 1."""
    order = np.argsort(-weights, axis=1)[:, :MOST_BONES]
    # A bone that is fourth at one corner and fifth at the next would suddenly lose its weight. So all weights
    # are lowered a little.
    kept = np.maximum(np.take_along_axis(weights, order, axis=1) - 0.01, 0)
    return order.astype(np.uint8), kept / kept.sum(axis=1, keepdims=True)


def light(parts: Sequence[Solid], points: Array, normals: Array) -> Array:
    """(N,) brightness: 1 if the body covers none of a point's surroundings, 0.15 if it covers them all."""
    out = np.ones(len(points))
    for height, weight in ((1.5, 0.30), (4.0, 0.30), (9.0, 0.25)):
        # If nothing else is near, the distance of a point above the surface is its height.
        free = np.clip(distances(parts, points + height * normals), 0, height)
        out -= weight * (1 - free / height)
    return np.clip(out, 0, 1)


def charts(at: dict[str, Array], corners: Array, faces: Array, owner: NDArray[np.str_]) -> NDArray[np.str_]:
    """(T,) the chart of the texture to which each triangle belongs: a part of the body, front or back."""
    middle, part, a, b, c = corners[faces].mean(axis=1), owner[faces[:, 0]], *corners[faces].swapaxes(0, 1)
    side = np.where(middle[:, 0] < 0, "right", "left")
    up = np.array([0.0, 1, 0])
    ahead = unit(at["left_wrist"] - at["left_elbow"])
    palm = np.cross(ahead, np.array([0.0, 0, 1]))
    normal = np.cross(b - a, c - a)
    normal *= np.where(side == "left", 1, -1)[:, None] * [1, 0, 0] + [0, 1, 1]  # as on the left side
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    front = middle[:, 2] > np.where(part == "head", at["head"][2] - 1.0, -1.0)
    name = np.where(part == "head", "head", "trunk").astype("<U16")
    for words, chart, half in (
        (("shoulder", "elbow"), "arm", front),
        (("hip", "knee"), "leg", front),
        (("wrist",), "hand", normal @ palm > 0),
        (("heel", "toe"), "foot", normal @ up < -0.5),
    ):
        chosen = np.isin(part, [f"{s}_{word}" for s in ("left", "right") for word in words])
        name[chosen], front = np.char.add(side[chosen], f" {chart}"), np.where(chosen, half, front)
    chart = np.char.add(name, np.where(front, " front", " back"))
    names, found = np.unique(chart, return_inverse=True)
    # Straighten the borders: each triangle takes the chart of most of its neighbours, a few times.
    count = len(corners)
    touch = coo_array(
        (np.ones(faces.size), (np.repeat(np.arange(len(faces)), 3), faces.ravel())), (len(faces), count)
    )
    near = ((touch @ touch.T) >= 2).astype(float)  # triangles with a common edge, and each with itself
    for _ in range(6):
        found = (near @ np.eye(len(names))[found]).argmax(axis=1)
    return names[found]


def unwrapped(corners: Array, faces: Array, chart: NDArray[np.str_]) -> Array:
    """(T, 3, 2) places of the corners of all triangles in the texture, from 0 to 1, upwards."""
    made = blender_mesh("body", corners, faces)
    made.data.uv_layers.new(name="uv")
    of_edge: dict[frozenset[int], set[str]] = {}
    for face, name in zip(faces.tolist(), chart.tolist(), strict=True):
        for k in range(3):
            of_edge.setdefault(frozenset((face[k], face[k - 1])), set()).add(name)
    for edge in made.data.edges:
        edge.use_seam = len(of_edge[frozenset(edge.vertices)]) > 1
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.unwrap(method="ANGLE_BASED", margin=0.004)
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.average_islands_scale()
    bpy.ops.uv.pack_islands(rotate=True, margin=0.006)
    bpy.ops.object.mode_set(mode="OBJECT")
    return np.array([place.vector for place in made.data.uv_layers["uv"].uv]).reshape(len(faces), 3, 2)


def texture(
    parts: Sequence[Solid], corners: Array, normals: Array, faces: Array, uv: Array
) -> NDArray[np.uint8]:
    """(TEXTURE, TEXTURE, 3) RGB: the clay, darker where less light reaches it."""
    place = np.full((TEXTURE, TEXTURE, 3), np.nan)
    normal = np.zeros_like(place)
    for face, spots in zip(faces, uv * TEXTURE - 0.5, strict=True):
        low, high = np.floor(spots.min(axis=0)).astype(int), np.ceil(spots.max(axis=0)).astype(int) + 1
        x, y = np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)))
        edges = np.linalg.inv(np.stack([spots[1] - spots[0], spots[2] - spots[0]], axis=1) + 1e-9 * np.eye(2))
        v, w = edges @ (np.stack([x.ravel(), y.ravel()]) - spots[0][:, None])
        inside = (v > -0.02) & (w > -0.02) & (v + w < 1.02)
        share = np.stack([1 - v - w, v, w], axis=1)[inside]
        rows, columns = np.clip(TEXTURE - 1 - y.ravel()[inside], 0, TEXTURE - 1), x.ravel()[inside]
        place[rows, columns], normal[rows, columns] = share @ corners[face], share @ normals[face]
    drawn = ~np.isnan(place[..., 0])
    bright = np.ones((TEXTURE, TEXTURE))
    bright[drawn] = light(parts, place[drawn], normal[drawn])
    # Pixels beside the charts take the colour of the nearest pixel of a chart.
    nearest = distance_transform_edt(~drawn, return_distances=False, return_indices=True)
    bright = gaussian_filter(bright[tuple(nearest)], 1.0)
    return np.round(255 * COLOUR * (0.45 + 0.55 * bright[..., None])).astype(np.uint8)


def parts_to_keep(head: Array, corners: Array) -> Array:
    """(V,) how much finer than elsewhere the surface stays: the face, and a little the ears."""
    face = np.linalg.norm((corners - head - [0, 3, 9]) / [5, 7, 6], axis=1)
    ear = np.linalg.norm((corners - head - [7.3, 6, -0.4]) / [1.6, 3.3, 2.4], axis=1)
    return np.maximum(0.75 * np.clip(1.6 - face, 0, 1), 0.5 * np.clip(1.5 - ear, 0, 1))


def main() -> None:
    """Write the body's files."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--triangles", type=int, default=11600)
    parser.add_argument("--out", type=Path, default=ROOT / "src/hobble/figure")
    options = parser.parse_args()
    data = yaml.safe_load((ROOT / "config/skeletons/holden31.yaml").read_text())
    skeleton = Skeleton.from_dict({"name": "holden31", **{k: v for k, v in data.items() if k != "maps"}})
    at = modelled_pose(skeleton).position_of
    parts = list(solids(at))
    fine = left_half(parts)
    corners, faces = reduced(parts, *fine, options.triangles // 2, parts_to_keep(at["head"], fine[0]))
    corners, faces = mirrored(corners, faces)
    # Weights spread evenly on a finer mesh with equal triangles.
    even = mirrored(*reduced(parts, *fine, 30000, np.full(len(fine[0]), 0.5)))
    roles, even_weights = spread_weights(parts, *even)
    away, near = cKDTree(even[0]).query(corners, k=4)
    share = 1 / (away + 0.05)
    weights = np.einsum("vk,vkb->vb", share / share.sum(axis=1, keepdims=True), even_weights[near])
    bones, weights = largest_weights(weights)
    slope, _ = slopes(parts, corners)
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    uv = unwrapped(corners, faces, charts(at, corners, faces, owners_of(parts, corners)))
    picture = texture(parts, corners, normals, faces, uv)
    Image.fromarray(picture).save(options.out / "body.jpg", quality=88)
    np.savez_compressed(
        options.out / "body.npz",
        corners=corners.astype(np.float32),
        normals=normals.astype(np.float32),
        faces=faces.astype(np.uint16),
        shade=np.round(255 * light(parts, corners, normals)).astype(np.uint8),
        uv=np.round(65535 * (uv * [1, -1] + [0, 1])).astype(np.uint16),  # downwards
        roles=np.array(roles),
        bones=bones,
        weights=weights.astype(np.float32),
        joints=np.array([at[role] for role in roles], np.float32),
    )


if __name__ == "__main__":
    main()
