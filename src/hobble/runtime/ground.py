"""Turns the ground that the caller gives (a function, a heightmap, an array or None) into one function."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.runtime.caller_targets import UNITS, Axes

CELL = 3.937007874  # cm, the cell size of the heightmaps of Holden et al. (2017)


@dataclass(frozen=True)
class Heightmap:
    """Heights (rows, columns) on a grid around `centre` with spacing `cell`, in the caller's axes and unit.

    Columns run along the first ground coordinate and rows along the second: +X and +Z, or +X and +Y if Z is
    up. cell: distance between two columns or rows; None for 3.937 cm, whatever the unit. Outside the grid,
    the heights at its border continue.
    """

    heights: Array = field(repr=False)
    cell: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        heights = np.ascontiguousarray(self.heights, float)
        if heights.ndim != 2 or min(heights.shape) < 2 or not np.all(np.isfinite(heights)):
            raise ValueError(
                f"a heightmap has to be a 2D array of finite numbers, at least 2 x 2, not {heights.shape}"
            )
        object.__setattr__(self, "heights", heights)

    def __call__(self, x: Array, z: Array) -> Array:
        """Heights (N,), bilinear, at points with the first ground coordinate x (N,) and the second z (N,)."""
        cell = CELL if self.cell is None else self.cell
        return _bilinear(self.heights, cell, self.centre[0], self.centre[1], x, z)


def as_ground(terrain: Any, axes: Axes) -> Callable[[Array, Array], Array] | None:
    """The caller's terrain as a function from Hobble's x, z (N,) to Hobble's heights (N,).

    terrain: None (flat at 0); a function of the caller's two ground coordinates (arrays) that returns
    heights; a Heightmap; or a 2D array of heights around the origin. All in the caller's axes and unit.
    Raises TypeError for anything else, ValueError for an array that is no heightmap.
    """
    if terrain is None:
        return None
    if isinstance(terrain, np.ndarray):
        terrain = Heightmap(terrain)
    if not callable(terrain):
        kind = type(terrain).__name__
        raise TypeError(f"terrain has to be a function, a Heightmap, a 2D array or None, not {kind}")
    if axes.is_native:  # the caller's axes and unit are Hobble's
        return terrain  # type: ignore[no-any-return]
    if isinstance(terrain, Heightmap) and terrain.cell is None:
        terrain = replace(terrain, cell=CELL * UNITS[axes.unit])
    up = "XYZ".index(axes.up)
    ground_axes = [k for k in range(3) if k != up]

    def converted(x: Array, z: Array) -> Array:
        points = axes.points_to_caller(np.stack([x, np.zeros_like(x), z], axis=-1))
        first, second = np.ascontiguousarray(points[:, ground_axes].T)
        return np.asarray(terrain(first, second)) / axes.scale

    return converted


@njit
def _bilinear(heights: Any, cell: float, centre_x: float, centre_z: float, x: Any, z: Any) -> Any:
    """Heights (N,) of a grid at the points x, z (N,), see `Heightmap`."""
    rows, columns = heights.shape
    out = np.empty(x.size)
    for n in range(x.size):
        # u, v: column and row of the point, with fractions; then its place within the grid cell, 0 to 1.
        u = min(max((x[n] - centre_x) / cell + (columns - 1) / 2, 0.0), columns - 1.0)
        v = min(max((z[n] - centre_z) / cell + (rows - 1) / 2, 0.0), rows - 1.0)
        i, j = min(int(u), columns - 2), min(int(v), rows - 2)
        u, v = u - i, v - j
        low = heights[j, i] * (1 - u) + heights[j, i + 1] * u
        high = heights[j + 1, i] * (1 - u) + heights[j + 1, i + 1] * u
        out[n] = low * (1 - v) + high * v
    return out
