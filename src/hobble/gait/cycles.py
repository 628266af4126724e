"""The cycles of a walk, from one landing of a foot to its next, and the numbers of each cycle.

A foot lands where its ankle is furthest ahead of the hips. This also works for feet that drag and for feet
that are set down next to the other, where contacts and zero crossings fail.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.signals import CURVES, Signals, mirrored, signals

SAMPLES = 50
SCALARS = (
    "stride_seconds",
    "speed_per_leg",
    "left_strike_phase",
    "stance_share_R",
    "stance_share_L",
    "step_R",
    "step_L",
    "step_width",
)
STANDING_SPEED = 0.35  # share of the walking speed; an ankle that is slower stands
SHORTEST, LONGEST = 0.4, 3.5  # s, a cycle
LEAST_TRAVEL = 0.2  # leg lengths that the hips travel in a cycle; less is standing
LEAST_SWING = 0.12  # leg lengths that an ankle moves at least in a step, forward and then back
LEAST_SWING_SHARE = 0.4  # the same as a share of the ankle's range; smaller movements are no step
STRAIGHT = 25.0  # degrees that the path turns at most in a cycle; people were measured on straight paths
AHEAD = 0.7  # least mean cosine between facing and travel; below it the walk is backward or sideways


@dataclass(frozen=True)
class Cycle:
    """A cycle of the right leg, from its landing in frame `start` to the next in frame `end`.

    scalars: the numbers of SCALARS. curves: (22, 50), rows as CURVES, at 50 equal steps from `start`.
    """

    start: int
    end: int
    scalars: dict[str, float]
    curves: Array = field(repr=False)


@dataclass(frozen=True)
class WalkCycles:
    """The cycles of a stretch of walking.

    right: cycles that begin as the right foot lands. left: cycles that begin as the left foot lands. They
    are mirrored, so that R is the leg that lands first in both.
    """

    fps: float
    right: tuple[Cycle, ...] = field(repr=False)
    left: tuple[Cycle, ...] = field(repr=False)

    def __len__(self) -> int:
        """The number of cycles of the side that has fewer."""
        return min(len(self.right), len(self.left))

    def within(self, start: float, end: float) -> WalkCycles:
        """The cycles that are completely between two frames."""
        kept = ((c for c in side if start <= c.start and c.end <= end) for side in (self.right, self.left))
        return WalkCycles(self.fps, *map(tuple, kept))

    def mirrored(self) -> WalkCycles:
        """The same walk, mirrored."""
        return WalkCycles(self.fps, self.left, self.right)


def measure(skeleton: Skeleton, positions: Array, fps: float = 60.0) -> WalkCycles:
    """Find and measure the cycles in which a figure walks straight ahead.

    positions: (F, J, 3) in the world, cm, Y up. Frames of standing, turning, and walking backward or sideways
    give no cycle. Between the two landings of a cycle the other foot must land exactly once. A clip that is
    shorter than a cycle has none.
    """
    if len(positions) < SHORTEST * fps:
        return WalkCycles(fps, (), ())
    walk = signals(skeleton, positions, fps)
    return WalkCycles(fps, tuple(_cycles(walk)), tuple(_cycles(mirrored(walk))))


def joined(walks: Iterable[WalkCycles]) -> WalkCycles:
    """The cycles of several clips of one person as one walk. Their frame numbers have no meaning any more."""
    walks = tuple(walks)
    right, left = (
        tuple(itertools.chain(*side)) for side in zip(*((w.right, w.left) for w in walks), strict=True)
    )
    return WalkCycles(walks[0].fps, right, left)


def landings(forward: Array, fps: float) -> list[int]:
    """Frames in which an ankle is furthest ahead of the hips. forward: (F,) how far, in leg lengths.

    The ankle must then go back by LEAST_SWING, and by LEAST_SWING_SHARE of its range in the LONGEST seconds
    around.
    """
    reach = int(LONGEST * fps / 2)
    least = np.maximum(LEAST_SWING, LEAST_SWING_SHARE * _ranges(forward, reach))
    found: list[int] = []
    high = low = 0
    rising = True
    for i, value in enumerate(forward):
        if rising:
            high = i if value > forward[high] else high
            if forward[high] - value >= least[high]:
                found.append(high)
                rising, low = False, i
        else:
            low = i if value < forward[low] else low
            if value - forward[low] >= least[low]:
                rising, high = True, i
    return [i for i in found if i > 0]


def _ranges(values: Array, reach: int) -> Array:
    """(F,) largest minus smallest value within `reach` frames on each side."""
    padded = np.pad(values, reach, mode="edge")
    return np.ptp(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1), axis=1)


def _cycles(walk: Signals) -> Iterable[Cycle]:
    right, left = (landings(walk.curves[f"ankle_forward_{side}"], walk.fps) for side in "RL")
    for a, b in itertools.pairwise(right):
        between = [i for i in left if a < i < b]
        if len(between) == 1 and SHORTEST * walk.fps <= b - a <= LONGEST * walk.fps:
            travel = np.linalg.norm(np.diff(walk.hips[a : b + 1], axis=0), axis=1).sum()
            straight = abs(walk.heading[b] - walk.heading[a]) <= STRAIGHT
            if travel >= LEAST_TRAVEL and straight and walk.ahead[a:b].mean() >= AHEAD:
                yield _cycle(walk, a, between[0], b)


def _cycle(walk: Signals, a: int, other: int, b: int) -> Cycle:
    seconds = (b - a) / walk.fps
    speed = float(np.linalg.norm(walk.hips[b] - walk.hips[a])) / seconds
    apart = walk.curves["ankle_forward_R"] - walk.curves["ankle_forward_L"]
    standing = {side: float(np.mean(walk.ankle_speed[side][a:b] < STANDING_SPEED * speed)) for side in "LR"}
    width = [walk.across["L"][i] - walk.across["R"][i] for i in (a, other)]
    values = (
        seconds,
        speed,
        (other - a) / (b - a),
        standing["R"],
        standing["L"],
        float(apart[a]),
        float(-apart[other]),
        float(np.mean(width)),
    )
    at = a + (b - a) * np.arange(SAMPLES) / SAMPLES
    frames = np.arange(a, b + 1)
    curves = np.stack([np.interp(at, frames, walk.curves[name][a : b + 1]) for name in CURVES])
    return Cycle(a, b, dict(zip(SCALARS, values, strict=True)), curves)
