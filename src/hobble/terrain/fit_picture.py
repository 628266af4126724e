"""Data for a picture of a fit of the ground: heights on a grid, the feet over time, and three poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.terrain.cycle_ground import CycleGround
from hobble.terrain.soles import Feet, Mask

GRID_POINTS = 24  # points of the ground's grid along x and along z
MARGIN_CM = 60.0  # the grid reaches this far beyond the feet


@dataclass(frozen=True)
class FitPicture:
    """The best fit of one cycle, in centimetres in the clip's world.

    cycle: number of the cycle in the clip. x, z: (G,) coordinates of the grid. ground: (G, G) height at each
    x[i], z[j]. soles, contacts: (T, 4, 3) and (T, 4), in the T frames that the ground is fitted to. pose:
    (3, J, 3) joint positions after a quarter, half and three quarters of these frames. parents: (J,) index of
    each joint's parent.
    """

    cycle: int
    x: Array = field(repr=False)
    z: Array = field(repr=False)
    ground: Array = field(repr=False)
    soles: Array = field(repr=False)
    contacts: Mask = field(repr=False)
    pose: Array = field(repr=False)
    parents: np.ndarray = field(repr=False)


def cycles_to_picture(count: int) -> set[int]:
    """Numbers of the cycles that get a picture: one in each half of the `count` cycles of a clip."""
    return {count // 4, (3 * count) // 4} if count > 1 else set(range(count))


def make_picture(clip: Clip, cycle: int, ground: CycleGround, feet: Feet, around: slice) -> FitPicture:
    """The picture of the best fit of a cycle. around: the frames that the ground was fitted to."""
    soles = feet.soles[around]
    low, high = (
        soles[..., [0, 2]].min(axis=(0, 1)) - MARGIN_CM,
        soles[..., [0, 2]].max(axis=(0, 1)) + MARGIN_CM,
    )
    x, z = np.linspace(low[0], high[0], GRID_POINTS), np.linspace(low[1], high[1], GRID_POINTS)
    points = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = ground.heights_at(points)[0].reshape(GRID_POINTS, GRID_POINTS)
    frames = np.linspace(around.start, around.stop - 1, 5).astype(int)[1:4]
    return FitPicture(
        cycle,
        x.astype(np.float32),
        z.astype(np.float32),
        heights.astype(np.float32),
        soles.astype(np.float32),
        feet.contacts[around],
        clip.positions[frames].astype(np.float32),
        np.array(clip.skeleton.parents, np.int32),
    )
