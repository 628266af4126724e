"""The solids of which a body is built. Each gives the signed distance to its surface: cm, negative inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from hobble.core.quat import Array

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
