"""Finds the cycles of a walk, each from one landing of a foot to its next, and measures them.

A foot lands where its ankle is furthest ahead of the hips. This rule also finds the landings of a foot that
drags or is set down beside the other foot. Contacts, or zero crossings of the distance between the ankles,
would miss them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.signals import CURVES, Signals, mirrored, signals

SAMPLES = 50  # number of samples of each curve in a cycle
SCALARS = (
    "stride_seconds",
    "speed_per_leg",  # leg lengths a second
    "left_strike_phase",  # share of the cycle that has passed as the left foot lands
    "stance_share_R",  # share of the cycle in which the right ankle stands
    "stance_share_L",
    "step_R",  # how far the right ankle is ahead of the left one as the right foot lands, leg lengths
    "step_L",
    "step_width",  # sideways distance between the ankles at the landings, leg lengths
)
STANDING_SPEED = 0.35  # an ankle that is slower than this share of the walking speed stands
SHORTEST_CYCLE, LONGEST_CYCLE = 0.4, 3.5  # seconds
LEAST_TRAVEL = 0.2  # leg lengths: if the hips travel less than this in a cycle, the body stands
# In a step, the ankle moves forward and then back relative to the hips, each time by at least both of these
# limits. A smaller movement is no step.
LEAST_SWING = 0.12  # leg lengths
LEAST_SWING_SHARE = 0.4  # share of the ankle's range
MOST_TURN = 25.0  # degrees that the path may turn in a cycle; recorded people walked straight (people.py)
LEAST_AHEAD = 0.7  # mean cosine between facing and travel; with less, the walk is backward or sideways


@dataclass(frozen=True)
class Cycle:
    """A cycle of the right leg, from a landing in frame `start` to the next landing in frame `end`.

    scalars: name of SCALARS -> value. curves: (22, 50) signals.CURVES at 50 equal steps from `start`.
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
        """The cycles that are completely between the frames `start` and `end`."""
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
    if len(positions) < SHORTEST_CYCLE * fps:
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
    """Frames in which an ankle is furthest ahead of the hips.

    forward: (F,) how far the ankle is ahead of the hips, leg lengths. After a landing the ankle must go back
    by at least LEAST_SWING, and by at least LEAST_SWING_SHARE of its range. The range is taken over
    LONGEST_CYCLE seconds, half of them before the landing and half after it.
    """
    reach = int(LONGEST_CYCLE * fps / 2)
    least = np.maximum(LEAST_SWING, LEAST_SWING_SHARE * _ranges(forward, reach))
    landed: list[int] = []
    high = low = 0
    rising = True
    for i, value in enumerate(forward):
        if rising:
            high = i if value > forward[high] else high
            if forward[high] - value >= least[high]:
                landed.append(high)
                rising, low = False, i
        else:
            low = i if value < forward[low] else low
            if value - forward[low] >= least[low]:
                rising, high = True, i
    return [i for i in landed if i > 0]


def _ranges(values: Array, reach: int) -> Array:
    """(F,) largest minus smallest value within `reach` frames on each side."""
    padded = np.pad(values, reach, mode="edge")
    return np.ptp(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1), axis=1)


def _cycles(walk: Signals) -> Iterable[Cycle]:
    right, left = (landings(walk.curves[f"ankle_forward_{side}"], walk.fps) for side in "RL")
    for a, b in itertools.pairwise(right):
        between = [i for i in left if a < i < b]
        if len(between) == 1 and SHORTEST_CYCLE * walk.fps <= b - a <= LONGEST_CYCLE * walk.fps:
            travel = np.linalg.norm(np.diff(walk.hips[a : b + 1], axis=0), axis=1).sum()
            straight = abs(walk.heading[b] - walk.heading[a]) <= MOST_TURN
            if travel >= LEAST_TRAVEL and straight and walk.ahead[a:b].mean() >= LEAST_AHEAD:
                yield _cycle(walk, a, between[0], b)


def _cycle(walk: Signals, a: int, other: int, b: int) -> Cycle:
    """The cycle from frame `a` to frame `b`. other: the frame in which the other foot lands."""
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
