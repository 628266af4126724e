"""Finds the cycles of a walk and measures them. A cycle lasts from one landing of a foot to its next landing.

A walking body is described by 22 curves over time, the same curves as in the data of people's walks
(profile.py). Joints are found by role, such as "left_knee", so any rig whose joints have roles works. Angles
are relative to the vertical and the direction of travel.

A foot counts as landing when its ankle is furthest ahead of the hips. This rule also finds the landings of a
foot that drags or is set down beside the other foot. Foot contacts would miss these landings, and so would
zero crossings of the distance between the ankles.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, other_side
from hobble.core.smooth import gaussian

SIDES = {"L": "left", "R": "right"}
# Curves of each side.
LIMBS = (
    "hip_flexion", "hip_abduction", "knee_flexion", "foot_pitch", "ankle_height", "ankle_forward",
    "arm_forward", "elbow_flexion",
)  # fmt: skip
# Curves of the whole body whose sign changes if the body is mirrored.
SIGN_CHANGES = ("trunk_left", "pelvis_left_up", "pelvis_turn_left", "shoulders_turn_left")
CURVES = (
    *(f"{limb}_{side}" for side in SIDES for limb in LIMBS),
    "trunk_forward",
    *SIGN_CHANGES,
    "hips_height",
)
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
TRAVEL_SECONDS = 0.5  # sigma of the Gaussian that smooths the direction of travel and that of the facing
STANDING_SPEED = 0.35  # an ankle that is slower than this share of the walking speed stands still
SHORTEST_CYCLE, LONGEST_CYCLE = 0.4, 3.5  # seconds
LEAST_TRAVEL = 0.2  # leg lengths: if the hips travel less than this in a cycle, the body stands
# In a step, the ankle moves forward and then back relative to the hips. A movement in either direction that
# is smaller than one of these two limits is no step.
LEAST_SWING = 0.12  # leg lengths
LEAST_SWING_SHARE = 0.4  # share of the ankle's range
MOST_TURN = 25.0  # degrees that the path may turn in a cycle; the recorded people walked straight
# Mean cosine of the angle between the facing and the direction of travel. A cycle with less is walked
# backward or sideways.
LEAST_AHEAD = 0.7


@dataclass(frozen=True)
class Cycle:
    """A cycle of the right leg, from a landing in frame `start` to the next landing in frame `end`.

    scalars: name of SCALARS -> value. curves: (22, 50) the curves CURVES at 50 evenly spaced times, of which
    the first is `start`.
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


def measure_clip(clip: Clip) -> WalkCycles:
    """Measure the cycles of a clip. Its skeleton may be any rig whose joints have roles."""
    return measure_cycles(clip.skeleton, clip.positions, clip.fps)


def measure_cycles(skeleton: Skeleton, positions: Array, fps: float = 60.0) -> WalkCycles:
    """Find and measure the cycles in which a figure walks straight ahead.

    positions: (F, J, 3) in the world, cm, Y up. Frames of standing, turning, and walking backward or sideways
    give no cycle. Between the two landings of a cycle the other foot must land exactly once. A clip that is
    shorter than a cycle has none.
    """
    if len(positions) < SHORTEST_CYCLE * fps:
        return WalkCycles(fps, (), ())
    at = {role: positions[:, skeleton.role(role)].astype(float) for role in skeleton.roles}
    mirrored = {other_side(role): points * [-1.0, 1.0, 1.0] for role, points in at.items()}
    return WalkCycles(fps, *(tuple(_cycles(_measure_signals(each, fps), fps)) for each in (at, mirrored)))


def join_walks(walks: Iterable[WalkCycles]) -> WalkCycles:
    """The cycles of several clips of one person as one walk, in which the frame numbers have no meaning."""
    walks = tuple(walks)
    sides = (tuple(c for walk in walks for c in getattr(walk, side)) for side in ("right", "left"))
    return WalkCycles(walks[0].fps, *sides)


def find_landings(forward: Array, fps: float) -> list[int]:
    """Frames in which an ankle is furthest ahead of the hips.

    forward: (F,) how far the ankle is ahead of the hips, leg lengths. After a landing the ankle must go back,
    and before the next landing it must come forward again. Both movements must be at least LEAST_SWING and at
    least LEAST_SWING_SHARE of the ankle's range. The range is taken over LONGEST_CYCLE seconds around the
    frame.
    """
    reach = int(LONGEST_CYCLE * fps / 2)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(forward, reach, mode="edge"), 2 * reach + 1)
    least_swing = np.maximum(LEAST_SWING, LEAST_SWING_SHARE * np.ptp(around, axis=1))
    landed: list[int] = []
    extreme, sign = (
        0,
        1,
    )  # frame of the furthest value since the movement last changed direction, and direction
    for i, value in enumerate(forward):
        if sign * value > sign * forward[extreme]:
            extreme = i
        if sign * (forward[extreme] - value) >= least_swing[extreme]:
            if sign > 0:
                landed.append(extreme)
            extreme, sign = i, -sign
    return [i for i in landed if i > 0]  # in frame 0 the ankle may have gone back for some time already


@dataclass(frozen=True)
class _Signals:
    """F frames of a moving body. All lengths are in leg lengths.

    curves: name of CURVES -> (F,), degrees or leg lengths. heading: (F,) direction of travel, degrees from
    +Z towards +X, unwrapped (without jumps at 360). ahead: (F,) cosine of the angle between facing and
    direction of travel. hips: (F, 2) path over the ground. ankle_speed: "L" or "R" -> (F,) speed over the
    ground, leg lengths a second. across: "L" or "R" -> (F,) how far the ankle is to the left of the hips.
    """

    curves: dict[str, Array]
    heading: Array
    ahead: Array
    hips: Array
    ankle_speed: dict[str, Array]
    across: dict[str, Array]


def _measure_signals(at: Mapping[str, Array], fps: float) -> _Signals:
    """The signals of a body. at: role -> positions (F, 3), cm, Y up, with F of 2 or more.

    hip_flexion is the forward angle of the thigh from the vertical, hip_abduction its outward angle.
    knee_flexion and elbow_flexion are 0 if the joint is straight. foot_pitch is the angle of the line from
    ankle to toe above the horizontal. The trunk is the line from the hips to the neck, or to the chest or
    head on a rig without a neck.
    """
    hips = at["hips"]
    velocity = gaussian(np.gradient(hips, axis=0), TRAVEL_SECONDS * fps) * [1.0, 0.0, 1.0]
    ahead = _unit(velocity)
    left = np.cross([0.0, 1.0, 0.0], ahead)
    bones = [
        at[f"{side}_{a}"] - at[f"{side}_{b}"]
        for side in SIDES.values()
        for a, b in (("hip", "knee"), ("knee", "heel"))
    ]
    leg = float(sum(np.median(np.linalg.norm(bone, axis=1)) for bone in bones) / 2)
    trunk = at[next(role for role in ("neck", "chest", "head") if role in at)] - hips
    pelvis, shoulders = (at[f"left_{part}"] - at[f"right_{part}"] for part in ("hip", "shoulder"))
    limbs = {
        side: _limb(at, name, ahead, left if side == "L" else -left, leg) for side, name in SIDES.items()
    }
    curves = {f"{limb}_{side}": curve for side in SIDES for limb, curve in limbs[side].items()} | {
        "trunk_forward": _angle(_dot(trunk, ahead), trunk[:, 1]),
        "trunk_left": _angle(_dot(trunk, left), trunk[:, 1]),
        "pelvis_left_up": _angle(pelvis[:, 1], np.hypot(_dot(pelvis, left), _dot(pelvis, ahead))),
        "pelvis_turn_left": _angle(-_dot(pelvis, ahead), _dot(pelvis, left)),
        "shoulders_turn_left": _angle(-_dot(shoulders, ahead), _dot(shoulders, left)),
        "hips_height": hips[:, 1] / leg,
    }
    # The body faces at a right angle to the lines through its hips and its shoulders.
    to_left = _unit(pelvis) + _unit(shoulders)
    facing = _unit(gaussian(np.cross(to_left, [0.0, 1.0, 0.0]), TRAVEL_SECONDS * fps))
    ankles = {side: at[f"{name}_heel"] for side, name in SIDES.items()}
    return _Signals(
        curves,
        np.degrees(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2]))),
        _dot(facing, ahead),
        hips[:, ::2] / leg,
        {
            side: np.linalg.norm(np.gradient(ankle, axis=0)[:, ::2], axis=1) * fps / leg
            for side, ankle in ankles.items()
        },
        {side: _dot(ankle - hips, left) / leg for side, ankle in ankles.items()},
    )


def _limb(at: Mapping[str, Array], side: str, ahead: Array, outward: Array, leg: float) -> dict[str, Array]:
    """The curves LIMBS of one side.

    at: role -> positions (F, 3). side: "left" or "right". ahead, outward: (F, 3) unit vectors of the
    direction of travel and of the direction away from the other leg. leg: leg length, cm.

    arm_forward is the forward angle of the line from shoulder to elbow, or to the wrist on a rig without
    elbows. Where joints are missing, arm_forward and elbow_flexion are 0.
    """
    hip, knee, ankle, toe, shoulder = (at[f"{side}_{p}"] for p in ("hip", "knee", "heel", "toe", "shoulder"))
    zero = np.zeros(len(hip))
    elbow, wrist = (at.get(f"{side}_{part}") for part in ("elbow", "wrist"))
    thigh, foot = knee - hip, toe - ankle
    arm_end = elbow if elbow is not None else wrist
    arm = None if arm_end is None else arm_end - shoulder
    return {
        "hip_flexion": _angle(_dot(thigh, ahead), -thigh[:, 1]),
        "hip_abduction": _angle(_dot(thigh, outward), -thigh[:, 1]),
        "knee_flexion": _bend(hip, knee, ankle),
        "foot_pitch": _angle(foot[:, 1], np.linalg.norm(foot[:, ::2], axis=1)),
        "ankle_height": ankle[:, 1] / leg,
        "ankle_forward": _dot(ankle - at["hips"], ahead) / leg,
        "arm_forward": zero if arm is None else _angle(_dot(arm, ahead), -arm[:, 1]),
        "elbow_flexion": zero if elbow is None or wrist is None else _bend(shoulder, elbow, wrist),
    }


def _cycles(walk: _Signals, fps: float) -> Iterator[Cycle]:
    """The cycles of the right leg that pass all limits above."""
    right, left = (find_landings(walk.curves[f"ankle_forward_{side}"], fps) for side in "RL")
    for start, end in itertools.pairwise(right):
        left_landings = [i for i in left if start < i < end]
        plausible_length = SHORTEST_CYCLE * fps <= end - start <= LONGEST_CYCLE * fps
        if len(left_landings) == 1 and plausible_length:
            travel = np.linalg.norm(np.diff(walk.hips[start : end + 1], axis=0), axis=1).sum()
            straight = abs(walk.heading[end] - walk.heading[start]) <= MOST_TURN
            if travel >= LEAST_TRAVEL and straight and walk.ahead[start:end].mean() >= LEAST_AHEAD:
                yield _cycle(walk, start, left_landings[0], end, fps)


def _cycle(walk: _Signals, start: int, left_landing: int, end: int, fps: float) -> Cycle:
    """The cycle from frame `start` to frame `end`. left_landing: the frame in which the left foot lands."""
    seconds = (end - start) / fps
    speed = float(np.linalg.norm(walk.hips[end] - walk.hips[start])) / seconds
    right_ahead = walk.curves["ankle_forward_R"] - walk.curves["ankle_forward_L"]
    width = [walk.across["L"][i] - walk.across["R"][i] for i in (start, left_landing)]
    values = (  # in the order of SCALARS
        seconds,
        speed,
        (left_landing - start) / (end - start),
        *(_share_below(walk.ankle_speed[side][start : end + 1], STANDING_SPEED * speed) for side in "RL"),
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


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)


def _angle(opposite: Array, adjacent: Array) -> Array:
    """Degrees of an angle in a right triangle, from the sides opposite and adjacent to it."""
    return np.degrees(np.arctan2(opposite, adjacent))


def _bend(a: Array, b: Array, c: Array) -> Array:
    """Degrees by which the joint at b bends the line from a to c, all (F, 3). 0 is straight."""
    u, v = b - a, c - b
    return _angle(np.linalg.norm(np.cross(u, v), axis=-1), _dot(u, v))
