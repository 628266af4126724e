"""The shape of a person: solids around the joints of a skeleton.

Each solid gives the signed distance to its surface: cm, negative inside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from hobble.core.quat import Array

SIDES = ("left", "right")


@dataclass(frozen=True)
class BindPose:
    """World positions (J, 3) in cm and rotations (J, 4) of all joints.

    joint_of: role -> index of the joint that moves the part of the body below it. For "left_knee", this part
    is the shank. If the skeleton has no joint for a role, the index is that of a joint near by. position_of:
    role -> position (3,) of its joint, cm. It is estimated if the skeleton has no joint for the role.
    """

    positions: Array
    rotations: Array
    joint_of: dict[str, int]
    position_of: dict[str, Array]


# The part of a solid that one bone moves: (where this part starts along the solid, cm; the bone's role in the
# skeleton, such as "left_knee").
Owner = tuple[float, str]


@dataclass(frozen=True)
class Solid:
    """A part of a body. Solids are added one after another; each is blended with the body so far.

    blend: how wide the zone is in which the solid blends with the body, cm. owners: the bones that move the
    solid, in order along its length. is_subtracted: whether the solid is cut from the body instead of added
    to it.
    """

    blend: float
    owners: tuple[Owner, ...]
    is_subtracted: bool = field(default=False, kw_only=True)

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """Signed distances of the points (x, y, z), cm. The three arrays broadcast."""
        raise NotImplementedError

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner (3,) of the bounding box."""
        raise NotImplementedError

    def along(self, points: Array) -> Array:
        """(N,) position of points (N, 3) along the solid, cm. It decides which of `owners` moves the point.

        0 for a solid with only one owner.
        """
        return np.zeros(len(points))


@dataclass(frozen=True)
class SweptSolid(Solid):
    """A solid with given sections across a straight line from `start` along the unit vector `axis`.

    The third direction is the cross product of `axis` and the unit vector `across`. Each row of `sections`
    has the position along the line, the half width along `across`, the half depth along the third direction,
    and the position of the section's centre along `across` and along the third direction, all in cm. The last
    number is the exponent of the superellipse (2 is an ellipse). Cubic splines connect the sections, so that
    no section is visible as an edge.
    """

    start: Array
    axis: Array
    across: Array
    sections: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        rows = np.array(self.sections, float)
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_section_at", CubicSpline(rows[:, 0], rows[:, 1:], axis=0))
        object.__setattr__(self, "_third", np.cross(self.axis, self.across))

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        rows: Array = self._rows  # type: ignore[attr-defined]
        local = [x - self.start[0], y - self.start[1], z - self.start[2]]
        # Coordinates of the points along `axis`, `across` and the third direction.
        s, u, v = (
            sum(part * direction[i] for i, part in enumerate(local))
            for direction in (self.axis, self.across, self._third)  # type: ignore[attr-defined]
        )
        values = self._section_at(np.clip(s, rows[0, 0], rows[-1, 0]))  # type: ignore[attr-defined]
        wide, deep, cu, cv, n = np.moveaxis(values, -1, 0)
        # Splines may swing below the values of the sections.
        wide, deep = np.maximum(wide, rows[:, 1].min() / 2), np.maximum(deep, rows[:, 2].min() / 2)
        a, b = np.abs(u - cu), np.abs(v - cv)
        radius = np.sqrt(a * a + b * b) + 1e-9
        # q is 1 on the outline of the section. The distance is measured along the line to the centre.
        q = ((a / wide) ** n + (b / deep) ** n) ** (1 / n) + 1e-9
        aside = np.maximum(radius * (1 - 1 / q), -np.minimum(wide, deep))
        end = np.maximum(rows[0, 0] - s, s - rows[-1, 0])  # distance beyond the nearer end, negative inside
        return np.where(end > 0, np.hypot(np.maximum(aside, 0), np.maximum(end, 0)), np.maximum(aside, end))

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        rows: Array = self._rows  # type: ignore[attr-defined]
        centres = (
            self.start + rows[:, :1] * self.axis + rows[:, 3:4] * self.across + rows[:, 4:5] * self._third  # type: ignore[attr-defined]
        )
        reach = np.maximum(rows[:, 1], rows[:, 2])[:, None]
        return (centres - reach).min(axis=0), (centres + reach).max(axis=0)

    def along(self, points: Array) -> Array:
        """As in `Solid`."""
        return (points - self.start) @ self.axis


@dataclass(frozen=True)
class Ball(Solid):
    """An ellipsoid around `centre`. Its half axes `radii` (3,), cm, lie along the rows of `axes` (3, 3)."""

    centre: Array
    radii: Array
    axes: Array = field(default_factory=lambda: np.eye(3))

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        local = [x - self.centre[0], y - self.centre[1], z - self.centre[2]]
        parts = [sum(p * row[i] for i, p in enumerate(local)) for row in self.axes]
        # An approximation: k0 - 1, which is 0 on the surface, divided by the slope of k0, which is k1 / k0.
        k0 = np.sqrt(sum((p / r) ** 2 for p, r in zip(parts, self.radii, strict=True)))
        k1 = np.sqrt(sum((p / r**2) ** 2 for p, r in zip(parts, self.radii, strict=True)))
        return np.where(k1 > 1e-9, k0 * (k0 - 1) / np.maximum(k1, 1e-9), -self.radii.min())

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        reach = np.sqrt(((self.axes * self.radii[:, None]) ** 2).sum(axis=0))
        return self.centre - reach, self.centre + reach


@dataclass(frozen=True)
class Rod(Solid):
    """A rod with round ends. Its radius changes from `thick` at `start` to `thin` at `end`, cm."""

    start: Array
    end: Array
    thick: float
    thin: float

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        way = self.end - self.start
        local = [x - self.start[0], y - self.start[1], z - self.start[2]]
        # Share of the way from start to end at which the rod is nearest to the point.
        t = np.clip(sum(p * way[i] for i, p in enumerate(local)) / max(way @ way, 1e-9), 0, 1)
        from_axis = np.sqrt(sum((p - t * way[i]) ** 2 for i, p in enumerate(local)))
        return from_axis - (self.thick + (self.thin - self.thick) * t)

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        reach = max(self.thick, self.thin)
        return np.minimum(self.start, self.end) - reach, np.maximum(self.start, self.end) + reach


@dataclass(frozen=True)
class Floor(Solid):
    """Everything below the plane through `place` with the unit normal `up`.

    Its bounding box reaches `reach` cm from `place`.
    """

    place: Array
    up: Array
    reach: float

    def distance(self, x: Any, y: Any, z: Any) -> Array:
        """As in `Solid`."""
        local = [x - self.place[0], y - self.place[1], z - self.place[2]]
        return np.asarray(sum(p * self.up[i] for i, p in enumerate(local)))

    def bounds(self) -> tuple[Array, Array]:
        """As in `Solid`."""
        return self.place - self.reach, self.place + self.reach


def smooth_union(a: Array, b: Array, blend: float) -> Array:
    """Distance to two solids together, from the distances `a` and `b` to each of them, cm.

    It is the smaller distance. Where they differ by less than `blend` cm, it is even smaller: this rounds the
    edge between the solids.
    """
    near = np.maximum(blend - np.abs(a - b), 0) / max(blend, 1e-9)
    return np.minimum(a, b) - 0.25 * blend * near * near


def smooth_difference(a: Array, b: Array, blend: float) -> Array:
    """Distance to what is left of a solid after another one is cut from it, cm.

    a, b: distances to the solid and to the one that is cut from it. Edges are rounded over `blend` cm.
    """
    return -smooth_union(-a, b, blend)


# The shape of a person around the joints of a skeleton.
#
# The tables of proportions are in centimetres for a body whose legs are LEG_LENGTH long. They are multiplied
# by `scale` (see `body_scale`). `position_of` is that of `BindPose`: role -> position of its joint. `sign` is
# 1 for the left side, which is at +X, and -1 for the right side.


LEG_LENGTH = 81.0  # cm from hip to ankle of the body that the tables describe
TOE_HEIGHT = 2.5  # cm, height of the ball of the foot above the sole
# Heights (cm) of hip joints, chest, neck and head in the table TRUNK. Height 0 is 8 cm above the hip joints.
# TRUNK is stretched until these heights are the heights of the joints in the skeleton.
JOINT_HEIGHTS = (-8.0, 23.0, 38.0, 48.0)

# Each row of TRUNK, LEG, ARM, PALM and FOOT is one section across a solid (see `SweptSolid`). In TRUNK:
# height; half width; half depth; how far the centre is to the front; exponent of the superellipse
TRUNK = (
    (-18.5, 3.5, 4.5, 0.2, 2.0),
    (-16.5, 7.0, 7.0, 0.0, 2.0),
    (-13.0, 12.6, 9.6, -0.3, 2.1),
    (-8.0, 15.2, 10.8, -0.5, 2.2),
    (-3.0, 15.5, 10.9, -0.5, 2.2),
    (3.0, 14.4, 10.2, -0.2, 2.2),
    (9.0, 12.8, 9.1, 0.2, 2.2),
    (16.0, 12.6, 9.1, 0.5, 2.2),
    (22.0, 14.0, 10.2, 0.6, 2.3),
    (27.0, 15.2, 10.9, 0.5, 2.4),
    (31.0, 15.4, 10.5, 0.1, 2.4),
    (34.5, 14.0, 9.2, -0.5, 2.3),
    (38.0, 9.6, 7.2, -1.0, 2.1),
    (41.0, 6.6, 6.0, -1.0, 2.0),
    (44.0, 5.4, 5.6, -0.7, 2.0),
    (49.0, 5.1, 5.4, -0.1, 2.0),
    (54.0, 4.2, 4.6, 0.4, 2.0),
)
# position along thigh (0 to 1) and shank (1 to 2); half width; half depth; how far the centre is to the front
LEG = (
    (-0.2, 2.5, 3.5, -0.4),
    (-0.12, 6.0, 7.6, -0.3),
    (0.0, 8.4, 9.5, 0.0),
    (0.2, 8.5, 9.3, 0.3),
    (0.45, 7.5, 8.3, 0.6),
    (0.72, 6.0, 6.7, 0.4),
    (0.9, 5.2, 5.8, 0.3),
    (1.0, 5.0, 5.6, 0.3),
    (1.1, 4.8, 5.4, -0.4),
    (1.28, 5.3, 6.0, -1.4),
    (1.45, 4.8, 5.4, -1.2),
    (1.66, 3.7, 4.2, -0.7),
    (1.86, 3.1, 3.6, -0.3),
    (1.97, 3.2, 3.7, -0.2),
    (2.04, 3.0, 3.4, -0.2),
)
# position along upper arm (0 to 1) and forearm (1 to 2); half width, from front to back; half depth
ARM = (
    (-0.16, 3.6, 3.2),
    (-0.08, 5.1, 4.7),
    (0.04, 5.8, 5.5),
    (0.18, 5.5, 5.3),
    (0.36, 4.9, 4.6),
    (0.62, 4.4, 4.1),
    (0.86, 3.7, 3.5),
    (1.0, 3.6, 3.4),
    (1.16, 4.1, 3.7),
    (1.35, 3.9, 3.5),
    (1.68, 3.1, 2.6),
    (1.93, 2.7, 1.95),
    (2.03, 2.7, 1.9),
)
# cm from the wrist; half width; half thickness; how far the centre is towards the thumb
PALM = (
    (-1.5, 2.4, 1.7, 0.0),
    (0.5, 2.8, 1.75, 0.1),
    (3.5, 3.8, 1.8, 0.3),
    (7.0, 4.1, 1.55, 0.1),
    (9.2, 3.9, 1.3, 0.0),
    (10.2, 3.3, 1.0, 0.0),
)
# each finger, cm: how far its root is towards the thumb; how far it is from the wrist; length; half width
FINGERS = ((3.1, 8.7, 7.0, 0.84), (1.0, 9.2, 7.8, 0.86), (-1.1, 8.9, 7.2, 0.83), (-3.05, 8.1, 5.6, 0.74))
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
    (1.0, 8.0, 2.6, 2.6, 1.1),
)


def solids_of_person(pose: BindPose) -> Iterator[Solid]:
    """The solids of a person, in the order in which they are added to the body or cut from it."""
    position_of = pose.position_of
    scale = body_scale(pose)
    yield from _trunk(position_of, scale)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        yield from _leg(position_of, side, scale)
        yield from _arm(position_of, side, sign, scale)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        yield from _foot(position_of, side, sign, scale)
        yield from _hand(position_of, side, sign, scale)
    yield from _head(position_of, scale)


def body_scale(pose: BindPose) -> float:
    """The factor by which the tables are multiplied: leg length of the body, divided by LEG_LENGTH."""
    position_of = pose.position_of
    legs = [np.linalg.norm(position_of[f"{s}_{a}"] - position_of[f"{s}_{b}"]) for s in SIDES for a, b in
            (("heel", "knee"), ("knee", "hip"))]  # fmt: skip
    return float(max(sum(legs) / 2 / LEG_LENGTH, 0.05))


def _levels(position_of: dict[str, Array], scale: float) -> Array:
    """Heights (4,) of hip joints, chest, neck and head, cm. Each is at least a little above the last one."""
    hips = (position_of["left_hip"][1] + position_of["right_hip"][1]) / 2
    heights = [hips, position_of["chest"][1], position_of["neck"][1], position_of["head"][1]]
    for i in range(1, 4):
        usual = scale * (JOINT_HEIGHTS[i] - JOINT_HEIGHTS[i - 1])
        heights[i] = max(heights[i], heights[i - 1] + 0.4 * usual)
    return np.array(heights)


def _trunk(position_of: dict[str, Array], scale: float) -> Iterator[Solid]:
    heights = _levels(position_of, scale)

    def level(y: float) -> float:
        """The height in the skeleton, cm, that corresponds to the height `y` in TRUNK."""
        if y < JOINT_HEIGHTS[0] or y > JOINT_HEIGHTS[-1]:
            end = 0 if y < JOINT_HEIGHTS[0] else -1
            return float(heights[end] + scale * (y - JOINT_HEIGHTS[end]))
        return float(np.interp(y, JOINT_HEIGHTS, heights))

    hip = (position_of["left_hip"] + position_of["right_hip"]) / 2
    start = np.array([hip[0], 0.0, hip[2]])
    # The centres of the sections follow the line through the joints of the back.
    joint_depths = [
        hip[2],
        position_of["spine"][2],
        position_of["chest"][2],
        position_of["neck"][2],
        position_of["head"][2],
    ]
    joint_heights = [heights[0], position_of["spine"][1], *heights[1:]]

    def middle_depth(y: float) -> float:
        """Depth (z) of the line through the joints of the back at the height `y` in TRUNK, cm."""
        return float(np.interp(level(y), joint_heights, joint_depths))

    rows = [
        (level(y), scale * w, scale * d, 0.0, middle_depth(y) - hip[2] + scale * f, n)
        for y, w, d, f, n in TRUNK
    ]
    up, right = np.array([0.0, 1.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    # (height at which the part of the trunk that a bone moves begins, role of the bone), from below
    owners: tuple[Owner, ...] = (
        (-np.inf, "hips"),
        (0.5 * (position_of["hips"][1] + position_of["spine"][1]) + 2.0 * scale, "spine"),
        (0.5 * (position_of["spine"][1] + heights[1]) + 3.0 * scale, "chest"),
        (heights[2] + 2.0 * scale, "neck"),
        (heights[3] + 1.0 * scale, "head"),
    )
    yield SweptSolid(0.0, owners, start, up, right, rows)

    def place(x: float, y: float, z: float) -> Array:
        """The point at the height `y` in TRUNK, `x` to the left and `z` in front of the trunk's middle."""
        return np.array([hip[0] + scale * x, level(y), middle_depth(y) + scale * z])

    for sign in (1.0, -1.0):
        for role, blend, centre, radii in (
            ("chest", 4.0, (6.6, 28.5, 6.6), (7.2, 5.4, 3.9)),  # breast
            ("chest", 4.0, (7.6, 29.0, -6.2), (6.4, 7.5, 3.6)),  # shoulder blade
            ("hips", 6.0, (6.8, -9.0, -4.6), (7.0, 7.6, 6.6)),  # seat
        ):
            x, y, z = centre
            yield Ball(blend * scale, ((-np.inf, role),), place(sign * x, y, z), scale * np.array(radii))
        shoulder = position_of["left_shoulder" if sign > 0 else "right_shoulder"]
        # A rod from the neck to the shoulder.
        inner = place(sign * 3.6, 42.0, -1.8)
        outer = shoulder + scale * np.array([-sign * 2.5, 2.4, -0.4])
        yield Rod(4.5 * scale, ((-np.inf, "chest"),), inner, outer, 2.6 * scale, 3.0 * scale)


def _unit(v: Array) -> Array:
    return v / max(float(np.linalg.norm(v)), 1e-9)


def _limb(
    places: tuple[Array, Array, Array], forward: Array, table: tuple, scale: float, roles: tuple[str, str]
) -> SweptSolid:
    """A solid along two bones, which are in one line in the bind pose.

    places: positions of the three joints. forward: direction in which the depth of a section is measured.
    table: rows with the columns of LEG. roles: the role of each of the two bones.
    """
    a, b, c = places
    axis = _unit(c - a)
    first, second = float((b - a) @ axis), float((c - b) @ axis)  # lengths of the two bones
    across = _unit(np.cross(axis, forward))
    # The depth is measured along the cross product of `axis` and `across`. It has to point to `forward`.
    across = -across if np.cross(axis, across) @ forward < 0 else across
    rows = []
    for t, wide, deep, front in table:
        s = t * first if t < 1 else first + (t - 1) * second
        rows.append((s, scale * wide, scale * deep, 0.0, scale * front, 2.0))
    return SweptSolid(0.0, ((-np.inf, roles[0]), (first, roles[1])), a, axis, across, rows)


def _leg(position_of: dict[str, Array], side: str, scale: float) -> Iterator[Solid]:
    hip, knee, heel = (position_of[f"{side}_{role}"] for role in ("hip", "knee", "heel"))
    front = np.array([0.0, 0.0, 1.0])
    leg = _limb((hip, knee, heel), front, LEG, scale, (f"{side}_hip", f"{side}_knee"))
    yield _with_blend(leg, 3.5 * scale)
    kneecap = knee + scale * np.array([0.0, 0.4, 4.3])
    yield Ball(3.0 * scale, ((-np.inf, f"{side}_knee"),), kneecap, scale * np.array([2.7, 3.4, 1.9]))


def _with_blend(sweep: SweptSolid, blend: float) -> SweptSolid:
    """The same solid with another width of the blend, cm."""
    return SweptSolid(blend, sweep.owners, sweep.start, sweep.axis, sweep.across, sweep.sections)


def _arm(position_of: dict[str, Array], side: str, sign: float, scale: float) -> Iterator[Solid]:
    shoulder, elbow, wrist = (position_of[f"{side}_{role}"] for role in ("shoulder", "elbow", "wrist"))
    # The depth of an arm is measured outward, towards the back of the hand, and the width from front to back.
    out = np.array([sign, 0.6, 0.0])
    table = [(t, wide, deep, 0.0) for t, wide, deep in ARM]
    arm = _limb((shoulder, elbow, wrist), out, tuple(table), scale, (f"{side}_shoulder", f"{side}_elbow"))
    yield _with_blend(arm, 3.5 * scale)
    deltoid = shoulder + scale * np.array([sign * 1.2, -2.2, 0.3])
    yield Ball(4.0 * scale, ((-np.inf, f"{side}_shoulder"),), deltoid, scale * np.array([4.5, 6.2, 5.2]))


def _foot(position_of: dict[str, Array], side: str, sign: float, scale: float) -> Iterator[Solid]:
    ankle, ball = position_of[f"{side}_heel"], position_of[f"{side}_toe"]
    sole = ball[1] - TOE_HEIGHT * scale
    way = (ball - ankle) * [1.0, 0.0, 1.0]
    length = float(np.linalg.norm(way))
    ahead = way / length if length > 1.0 * scale else np.array([0.0, 0.0, 1.0])
    up = np.array([0.0, 1.0, 0.0])
    inward = np.cross(up, ahead) * -sign
    # The heights in FOOT are for an ankle 7 cm above the sole. This factor fits them to the skeleton's ankle.
    # Towards the ball, the factor changes to `scale`.
    ankle_factor = max((ankle[1] - sole) / 7.0, 0.5 * scale)
    rows = []
    for t, cm, wide, height, aside in FOOT:
        high = height * (ankle_factor + (scale - ankle_factor) * min(1.0, t + max(cm, 0.0) / 8))
        # The section reaches from 0.28 `high` below the sole to `high` above it.
        s = t * length + scale * cm
        rows.append((s, scale * wide, 0.64 * high, scale * aside, 0.36 * high, 2.3))
    start = np.array([ankle[0], sole, ankle[2]])
    across = inward if np.cross(ahead, inward) @ up > 0 else -inward
    if across is not inward:
        rows = [(s, wide, deep, -aside, middle, n) for s, wide, deep, aside, middle, n in rows]
    owners = ((-np.inf, f"{side}_heel"), (length - 0.5 * scale, f"{side}_toe"))
    yield SweptSolid(2.5 * scale, owners, start, ahead, across, rows)
    # Cut off what is below the sole.
    owner = ((-np.inf, f"{side}_heel"),)
    middle_of_sole = start + ahead * (0.6 * length)
    yield Floor(1.0 * scale, owner, middle_of_sole, up, (length + 12.0) * scale, is_subtracted=True)


def _hand(position_of: dict[str, Array], side: str, sign: float, scale: float) -> Iterator[Solid]:
    wrist, elbow = position_of[f"{side}_wrist"], position_of[f"{side}_elbow"]
    ahead = _unit(wrist - elbow)
    thumb = _unit(np.array([0.0, 0.0, 1.0]) - ahead * ahead[2])
    palm = np.cross(ahead, thumb) * sign  # out of the palm
    owner = ((-np.inf, f"{side}_wrist"),)

    def place(out: float, aside: float, deep: float) -> Array:
        """The point `out` along the hand from the wrist, `aside` to the thumb and `deep` out of the palm."""
        return wrist + scale * (out * ahead + aside * thumb + deep * palm)

    rows = [
        (scale * out, scale * wide, scale * deep, scale * aside, 0.0, 2.5) for out, wide, deep, aside in PALM
    ]
    yield SweptSolid(1.6 * scale, owner, wrist, ahead, thumb, rows)
    for aside, begin, length, thick in FINGERS:
        joint, bend = place(begin, aside, 0.0), 0.0
        # Each finger has three segments with these shares of its length.
        for segment, (share, joint_bend) in enumerate(zip((0.42, 0.32, 0.26), CURL, strict=True)):
            bend += joint_bend
            fan = 0.045 * aside  # the fingers are spread a little
            way = _unit(np.cos(bend) * ahead + np.sin(bend) * palm + fan * thumb)
            tip = joint + scale * share * length * way
            a, b = thick * (1 - 0.08 * segment), thick * (1 - 0.08 * (segment + 1))
            yield Rod(0.5 * scale, owner, joint, tip, a * scale, b * scale)
            joint = tip
    # The thumb.
    root, joint, tip = place(2.4, 2.4, 0.5), place(5.8, 4.7, 1.3), place(9.3, 5.9, 1.9)
    yield Rod(1.4 * scale, owner, root, joint, 1.5 * scale, 1.12 * scale)
    yield Rod(0.5 * scale, owner, joint, tip, 1.12 * scale, 0.86 * scale)


def _head(position_of: dict[str, Array], scale: float) -> Iterator[Solid]:
    """The solids of the head. Their places are (x, y, z) from the head joint, cm before scaling."""
    base, owner = position_of["head"], ((-np.inf, "head"),)

    def ball(blend: float, centre: tuple, radii: tuple, is_subtracted: bool = False) -> Ball:
        return Ball(
            scale * blend,
            owner,
            base + scale * np.array(centre),
            scale * np.array(radii),
            is_subtracted=is_subtracted,
        )

    def rod(blend: float, a: tuple, b: tuple, thick: float, thin: float) -> Rod:
        return Rod(
            scale * blend, owner, base + scale * np.array(a), base + scale * np.array(b),
            scale * thick, scale * thin,
        )  # fmt: skip

    yield ball(2.0, (0, 9.4, 0.4), (7.1, 8.6, 8.9))  # skull
    yield ball(4.0, (0, 3.2, 3.9), (4.9, 7.0, 5.5))  # face
    yield ball(3.0, (0, -2.9, 6.9), (2.0, 1.7, 1.7))  # chin
    for sign in (1.0, -1.0):
        yield rod(3.5, (sign * 3.9, 1.2, 1.6), (sign * 1.3, -2.7, 6.0), 1.2, 1.2)  # jaw
        yield ball(4.0, (sign * 3.3, 3.6, 5.9), (1.9, 2.4, 1.8))  # cheek
        yield rod(3.0, (sign * 0.8, 8.9, 8.6), (sign * 4.2, 8.8, 7.2), 0.85, 0.7)  # brow
    for sign in (1.0, -1.0):
        yield ball(2.6, (sign * 2.9, 6.6, 10.9), (2.1, 1.1, 2.0), is_subtracted=True)  # eye socket
        yield ball(1.0, (sign * 7.0, 6.2, -0.2), (0.8, 2.7, 1.6))  # ear
    yield rod(1.8, (0, 8.0, 8.8), (0, 4.2, 10.9), 0.8, 1.1)  # nose
    yield ball(3.0, (0, 0.7, 7.4), (2.6, 1.9, 1.5))  # mouth
