"""Finds the cycles of a walk and measures them. A cycle lasts from one landing of a foot to its next landing.

A foot counts as landing when its ankle is furthest ahead of the hips. This rule also finds the landings of a
foot that drags or is set down beside the other foot. Foot contacts would miss these landings, and so would
zero crossings of the distance between the ankles.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.signals import CURVES, Signals, measure_signals, mirror_signals

SAMPLES = 50  # number of samples of each curve in a cycle
SCALARS = (
    "stride_seconds",
    "speed_per_leg",  # leg lengths a second
    "left_strike_phase",  # share of the cycle that has passed as the left foot lands
    "stance_share_R",  # share of the cycle in which the right ankle stands still (see STANDING_SPEED)
    "stance_share_L",
    "step_R",  # how far the right ankle is ahead of the left one as the right foot lands, leg lengths
    "step_L",
    "step_width",  # sideways distance between the ankles at the landings, leg lengths
)
STANDING_SPEED = 0.35  # an ankle that is slower than this share of the walking speed stands still
SHORTEST_CYCLE, LONGEST_CYCLE = 0.4, 3.5  # seconds
LEAST_TRAVEL = 0.2  # leg lengths: if the hips travel less than this in a cycle, the body stands
# In a step, the ankle moves forward and then back relative to the hips. A movement in either direction that
# is smaller than one of these two limits is no step.
LEAST_SWING = 0.12  # leg lengths
LEAST_SWING_SHARE = 0.4  # share of the ankle's range
# Degrees that the path may turn in a cycle. The people with whom a walk is compared (people.py) walked
# straight.
MOST_TURN = 25.0
# Mean cosine of the angle between the facing and the direction of travel. A cycle with less is walked
# backward or sideways.
LEAST_AHEAD = 0.7


@dataclass(frozen=True)
class Cycle:
    """A cycle of the right leg, from a landing in frame `start` to the next landing in frame `end`.

    scalars: name of SCALARS -> value. curves: (22, 50) the curves signals.CURVES at 50 evenly spaced times,
    of which the first is `start`.
    """

    start: int
    end: int
    scalars: dict[str, float]
    curves: Array = field(repr=False)


@dataclass(frozen=True)
class WalkCycles:
    """The cycles of a stretch of walking.

    right: cycles that begin as the right foot lands. left: cycles that begin as the left foot lands. The left
    cycles are mirrored, so in every cycle the names with R mean the leg that lands at the start.
    """

    fps: float
    right: tuple[Cycle, ...] = field(repr=False)
    left: tuple[Cycle, ...] = field(repr=False)

    def __len__(self) -> int:
        """The number of right cycles or of left cycles, whichever is smaller."""
        return min(len(self.right), len(self.left))

    def within(self, start: float, end: float) -> WalkCycles:
        """The cycles that are completely between the frames `start` and `end`."""
        kept = ((c for c in side if start <= c.start and c.end <= end) for side in (self.right, self.left))
        return WalkCycles(self.fps, *map(tuple, kept))

    def mirrored(self) -> WalkCycles:
        """The same walk, mirrored."""
        return WalkCycles(self.fps, self.left, self.right)


def measure_cycles(skeleton: Skeleton, positions: Array, fps: float = 60.0) -> WalkCycles:
    """Find and measure the cycles in which a figure walks straight ahead.

    positions: (F, J, 3) in the world, cm, Y up. Frames of standing, turning, and walking backward or sideways
    give no cycle. Between the two landings of a cycle the other foot must land exactly once. A clip that is
    shorter than a cycle has none.
    """
    if len(positions) < SHORTEST_CYCLE * fps:
        return WalkCycles(fps, (), ())
    walk = measure_signals(skeleton, positions, fps)
    return WalkCycles(fps, tuple(_cycles(walk)), tuple(_cycles(mirror_signals(walk))))


def join_walks(walks: Iterable[WalkCycles]) -> WalkCycles:
    """The cycles of several clips of one person as one walk, in which the frame numbers have no meaning."""
    walks = tuple(walks)
    right, left = (
        tuple(itertools.chain(*side)) for side in zip(*((w.right, w.left) for w in walks), strict=True)
    )
    return WalkCycles(walks[0].fps, right, left)


def find_landings(forward: Array, fps: float) -> list[int]:
    """Frames in which an ankle is furthest ahead of the hips.

    forward: (F,) how far the ankle is ahead of the hips, leg lengths. After a landing the ankle must go back,
    and before the next landing it must come forward again. Both movements must be at least LEAST_SWING and at
    least LEAST_SWING_SHARE of the ankle's range. The range is taken over LONGEST_CYCLE seconds around the
    frame.
    """
    reach = int(LONGEST_CYCLE * fps / 2)
    least_swing = np.maximum(LEAST_SWING, LEAST_SWING_SHARE * _ranges(forward, reach))
    landed: list[int] = []
    high = low = 0  # frames of the highest and the lowest value since the movement last changed direction
    rising = True
    for i, value in enumerate(forward):
        if rising:
            high = i if value > forward[high] else high
            if forward[high] - value >= least_swing[high]:
                landed.append(high)
                rising, low = False, i
        else:
            low = i if value < forward[low] else low
            if value - forward[low] >= least_swing[low]:
                rising, high = True, i
    return [i for i in landed if i > 0]  # in frame 0 the ankle may have gone back for some time already


def _ranges(values: Array, reach: int) -> Array:
    """(F,) largest minus smallest value within `reach` frames before and after each frame."""
    padded = np.pad(values, reach, mode="edge")
    return np.ptp(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1), axis=1)


def _cycles(walk: Signals) -> Iterable[Cycle]:
    """The cycles of the right leg that pass all limits above."""
    right, left = (find_landings(walk.curves[f"ankle_forward_{side}"], walk.fps) for side in "RL")
    for start, end in itertools.pairwise(right):
        left_landings = [i for i in left if start < i < end]
        plausible_length = SHORTEST_CYCLE * walk.fps <= end - start <= LONGEST_CYCLE * walk.fps
        if len(left_landings) == 1 and plausible_length:
            travel = np.linalg.norm(np.diff(walk.hips[start : end + 1], axis=0), axis=1).sum()
            straight = abs(walk.heading[end] - walk.heading[start]) <= MOST_TURN
            if travel >= LEAST_TRAVEL and straight and walk.ahead[start:end].mean() >= LEAST_AHEAD:
                yield _cycle(walk, start, left_landings[0], end)


def _cycle(walk: Signals, start: int, left_landing: int, end: int) -> Cycle:
    """The cycle from frame `start` to frame `end`. left_landing: the frame in which the left foot lands."""
    seconds = (end - start) / walk.fps
    speed = float(np.linalg.norm(walk.hips[end] - walk.hips[start])) / seconds
    right_ahead = walk.curves["ankle_forward_R"] - walk.curves["ankle_forward_L"]
    standing = {
        side: _share_below(walk.ankle_speed[side][start : end + 1], STANDING_SPEED * speed) for side in "LR"
    }
    width = [walk.across["L"][i] - walk.across["R"][i] for i in (start, left_landing)]
    values = (  # in the order of SCALARS
        seconds,
        speed,
        (left_landing - start) / (end - start),
        standing["R"],
        standing["L"],
        float(right_ahead[start]),
        float(-right_ahead[left_landing]),
        float(np.mean(width)),
    )
    times = start + (end - start) * np.arange(SAMPLES) / SAMPLES
    frames = np.arange(start, end + 1)
    curves = np.stack([np.interp(times, frames, walk.curves[name][start : end + 1]) for name in CURVES])
    return Cycle(start, end, dict(zip(SCALARS, values, strict=True)), curves)


def _share_below(values: Array, limit: float) -> float:
    """The share of the time in which values (F,) are below a limit, interpolated linearly between frames.

    A count of frames would be too coarse: a character whose cycle lasts exactly 60 frames repeats the same
    rounding in every cycle, and one frame is .017 of it.
    """
    below, distance = np.maximum(limit - values, 0.0), np.abs(limit - values)
    # For each interval between two frames, the share of it in which the line between the values is below.
    under, whole = below[:-1] + below[1:], distance[:-1] + distance[1:]
    return float(np.mean(np.divide(under, whole, out=np.zeros(len(under)), where=whole > 0)))
