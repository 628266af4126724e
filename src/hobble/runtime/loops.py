"""Walks that can be repeated without a jump: cut out of a longer walk straight on, with the ends blended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

SETTLED = 6 * 60  # frames until the gait has settled; no loop begins earlier
SHORTEST, LONGEST = 150, 300  # frames: least and greatest length of a loop, unless the caller says otherwise
BLEND = 12  # frames over which the end of a loop is blended into its start
SPEEDS = {"stand": 0.0, "walk": 2.5, "jog": 7.0, "crouch": 2.0}  # cm a frame, of the gaits that can repeat


@dataclass(frozen=True)
class RepeatedWalk:
    """A walk that can be repeated: after its last frame, its first frame follows without a jump.

    positions: (F, J, 3), cm. rotations: (F, J, 4). travel: (3,) cm from the start of one repetition to the
    start of the next. gap: mean distance by which the joints would jump without blending, cm.
    """

    positions: Array
    rotations: Array
    travel: Array
    gap: float

    def ahead(self) -> RepeatedWalk:
        """The same walk, starting above the origin and going along +z on average."""
        yaw = np.arctan2(self.travel[0], self.travel[2]) if np.linalg.norm(self.travel) > 1.0 else 0.0
        back = quat.yaw(-yaw)
        count = len(self.positions)
        # The mean distance of the root from a point that moves at constant speed.
        even = np.arange(count)[:, None] / count * self.travel
        start = (self.positions[:, 0] - even).mean(axis=0) * [1.0, 0.0, 1.0]
        return replace(
            self,
            positions=quat.rotate(back, self.positions - start),
            rotations=quat.mul(back, self.rotations),
            travel=quat.rotate(back, self.travel),
        )


def make_loop(
    network: Network,
    values: Mapping[str, Mapping[str, float]],
    runtime: Runtime,
    gait: str = "walk",
    lengths: tuple[int, int] = (SHORTEST, LONGEST),
) -> RepeatedWalk:
    """A loop of the character going straight on, cut out of a longer walk by `find_cut`.

    values: channel -> column -> value. gait: of SPEEDS. lengths: the least and the greatest, frames.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    target = np.array([0.0, SPEEDS[gait]])
    count = SETTLED + 60 + lengths[1] + BLEND
    poses = [animation.next_pose(target, None, gait, **values) for _ in range(count)]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    first, stop, gap = find_cut(positions, lengths)
    loop_positions, loop_rotations = positions[first:stop].copy(), rotations[first:stop].copy()
    travel = positions[stop, 0] - positions[first, 0]
    travel[1] = 0.0
    # The end of the loop is blended into the frames just before its first frame, moved on by `travel`.
    for k in range(BLEND):
        share = (k + 1) / (BLEND + 1)
        here, before = stop - BLEND + k, first - BLEND + k
        loop_positions[here - first] = (1 - share) * positions[here] + share * (positions[before] + travel)
        loop_rotations[here - first] = _mix_rotations(rotations[here], rotations[before], share)
    return RepeatedWalk(loop_positions, loop_rotations, travel, gap)


def find_cut(positions: Array, lengths: tuple[int, int] = (SHORTEST, LONGEST)) -> tuple[int, int, float]:
    """Find two frames of a walk, (F, J, 3), between which it can be cut out and repeated.

    Their poses and velocities are as similar as possible. Returns the first frame of the loop, the frame
    after its last, and the mean distance (cm) between the joints in these two frames. First frames within a
    second after SETTLED and all allowed lengths are tried.
    """
    local = positions - positions[:, :1] * np.array([1.0, 0.0, 1.0])  # the root stays over the origin
    velocity = np.gradient(local, axis=0)
    best = (SETTLED, SETTLED + lengths[0], np.inf)
    for first in range(SETTLED, SETTLED + 60, 2):
        later = np.arange(first + lengths[0], min(first + lengths[1], len(positions) - BLEND))
        # Distance of the poses, cm, plus 3 times the difference of the velocities, cm a frame.
        difference = np.linalg.norm(local[later] - local[first], axis=-1).mean(axis=1)
        difference += 3 * np.linalg.norm(velocity[later] - velocity[first], axis=-1).mean(axis=1)
        if difference.min() < best[2]:
            best = (first, int(later[difference.argmin()]), float(difference.min()))
    first, stop, _ = best
    return first, stop, float(np.linalg.norm(local[stop] - local[first], axis=-1).mean())


def _mix_rotations(a: Array, b: Array, share: float) -> Array:
    """Rotations (J, 4) between a and b. share: 0 gives a, 1 gives b."""
    b = np.where((a * b).sum(-1, keepdims=True) < 0, -b, b)  # q and -q are the same rotation
    mixed = (1 - share) * a + share * b
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
