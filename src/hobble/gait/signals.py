"""Describes a walking body by 22 curves over time, the same curves as in the data of people.py.

Joints are found by role, such as "left_knee", so any rig whose joints have roles works. Angles are relative
to the vertical and the direction of travel.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian

SIDES = ("L", "R")
SIDE_NAMES = {"L": "left", "R": "right"}
# Curves of each side.
LIMBS = (
    "hip_flexion",
    "hip_abduction",
    "knee_flexion",
    "foot_pitch",
    "ankle_height",
    "ankle_forward",
    "arm_forward",
    "elbow_flexion",
)
# Curves of the whole body.
MIDDLE = (
    "trunk_forward",
    "trunk_left",
    "pelvis_left_up",
    "pelvis_turn_left",
    "shoulders_turn_left",
    "hips_height",
)
CURVES = (*(f"{limb}_{side}" for side in SIDES for limb in LIMBS), *MIDDLE)
# Curves whose sign changes if the body is mirrored.
SIGN_CHANGES = ("trunk_left", "pelvis_left_up", "pelvis_turn_left", "shoulders_turn_left")
TRAVEL_SECONDS = 0.5  # sigma of the Gaussian that smooths the direction of travel and that of the facing


@dataclass(frozen=True)
class Signals:
    """F frames of a moving body. All lengths are in leg lengths; `leg` is the leg length in cm.

    curves: name of CURVES -> (F,), degrees or leg lengths. heading: (F,) direction of travel, degrees from
    +Z towards +X, unwrapped (without jumps at 360). ahead: (F,) cosine of the angle between facing and
    direction of travel. hips: (F, 2) path over the ground. ankle_speed: "L" or "R" -> (F,) speed over the
    ground, leg lengths a second. across: "L" or "R" -> (F,) how far the ankle is to the left of the hips.
    """

    fps: float
    leg: float
    curves: dict[str, Array] = field(repr=False)
    heading: Array = field(repr=False)
    ahead: Array = field(repr=False)
    hips: Array = field(repr=False)
    ankle_speed: dict[str, Array] = field(repr=False)
    across: dict[str, Array] = field(repr=False)

    def __len__(self) -> int:
        return len(self.ahead)


def mirror_signals(signals: Signals) -> Signals:
    """The same walk, mirrored: left and right swapped."""
    curves = {}
    for name in CURVES:
        other = name[:-1] + {"L": "R", "R": "L"}[name[-1]] if name not in MIDDLE else name
        curves[name] = -signals.curves[name] if name in SIGN_CHANGES else signals.curves[other]
    speed = {"L": signals.ankle_speed["R"], "R": signals.ankle_speed["L"]}
    across = {"L": -signals.across["R"], "R": -signals.across["L"]}
    hips = signals.hips * [-1.0, 1.0]
    return Signals(signals.fps, signals.leg, curves, -signals.heading, signals.ahead, hips, speed, across)


def measure_signals(skeleton: Skeleton, positions: Array, fps: float) -> Signals:
    """The curves of joint positions (F, J, 3), cm, Y up, at `fps` frames a second. F is 2 or more.

    hip_flexion is the forward angle of the thigh from the vertical, hip_abduction its outward angle.
    knee_flexion and elbow_flexion are 0 if the joint is straight. foot_pitch is the angle of the line from
    ankle to toe above the horizontal. arm_forward is the forward angle of the line from shoulder to elbow, or
    to the wrist on a rig without elbows. On a rig without elbows or without wrists, elbow_flexion is 0. On a
    rig without both, arm_forward is 0, too. The trunk is the line from the hips to the neck, or to the chest
    or head on a rig without a neck.
    """
    # Role -> positions (F, 3).
    at = {role: positions[:, skeleton.role(role)].astype(float) for role in skeleton.roles}
    ahead, left = _travel(at["hips"], fps)
    leg = _leg_length(at)
    outward = {"L": left, "R": -left}
    side_curves = {side: _limb(at, SIDE_NAMES[side], ahead, outward[side], leg) for side in SIDES}
    curves = {f"{limb}_{side}": side_curves[side][limb] for side in SIDES for limb in LIMBS}
    trunk = at[_trunk_top(skeleton)] - at["hips"]
    pelvis, shoulders = (at[f"left_{part}"] - at[f"right_{part}"] for part in ("hip", "shoulder"))
    curves |= {
        "trunk_forward": _angle(_dot(trunk, ahead), trunk[:, 1]),
        "trunk_left": _angle(_dot(trunk, left), trunk[:, 1]),
        "pelvis_left_up": _angle(pelvis[:, 1], np.hypot(_dot(pelvis, left), _dot(pelvis, ahead))),
        "pelvis_turn_left": _angle(-_dot(pelvis, ahead), _dot(pelvis, left)),
        "shoulders_turn_left": _angle(-_dot(shoulders, ahead), _dot(shoulders, left)),
        "hips_height": at["hips"][:, 1] / leg,
    }
    # The body faces at a right angle to the lines through its hips and its shoulders.
    to_left = pelvis / np.maximum(np.linalg.norm(pelvis, axis=1, keepdims=True), 1e-9)
    to_left = to_left + shoulders / np.maximum(np.linalg.norm(shoulders, axis=1, keepdims=True), 1e-9)
    facing = gaussian(np.cross(to_left, [0.0, 1.0, 0.0]), TRAVEL_SECONDS * fps)
    facing = facing / np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
    ankles = {side: at[f"{SIDE_NAMES[side]}_heel"] for side in SIDES}
    return Signals(
        fps,
        leg,
        curves,
        np.degrees(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2]))),
        _dot(facing, ahead),
        at["hips"][:, ::2] / leg,
        {side: _speed(ankle, fps) / leg for side, ankle in ankles.items()},
        {side: _dot(ankle - at["hips"], left) / leg for side, ankle in ankles.items()},
    )


def _travel(hips: Array, fps: float) -> tuple[Array, Array]:
    """Horizontal unit vectors (F, 3): the direction of travel, and the direction to its left."""
    velocity = gaussian(np.gradient(hips, axis=0), TRAVEL_SECONDS * fps) * [1.0, 0.0, 1.0]
    ahead = velocity / np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), 1e-9)
    return ahead, np.cross([0.0, 1.0, 0.0], ahead)


def _leg_length(at: dict[str, Array]) -> float:
    """Length of thigh and shank together, cm: the mean of the two legs. at: role -> positions (F, 3)."""
    bones = [("hip", "knee"), ("knee", "heel")]
    return float(
        sum(
            np.median(np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=1))
            for side in SIDE_NAMES.values()
            for a, b in bones
        )
        / 2
    )


def _trunk_top(skeleton: Skeleton) -> str:
    """The role of the trunk's upper end: the neck, or the chest or head on a rig without a neck."""
    return next(role for role in ("neck", "chest", "head") if role in skeleton.roles)


def _limb(at: dict[str, Array], side: str, ahead: Array, outward: Array, leg: float) -> dict[str, Array]:
    """The curves LIMBS of one side.

    at: role -> positions (F, 3). side: "left" or "right". ahead, outward: (F, 3) unit vectors of the
    direction of travel and of the direction away from the other leg. leg: leg length, cm.
    """
    hip, knee, ankle, toe, shoulder = (at[f"{side}_{p}"] for p in ("hip", "knee", "heel", "toe", "shoulder"))
    zero = np.zeros(len(hip))
    elbow, wrist = (at.get(f"{side}_{part}") for part in ("elbow", "wrist"))
    thigh, foot = knee - hip, toe - ankle
    arm_end = elbow if elbow is not None else wrist
    arm = None if arm_end is None else arm_end - shoulder
    foot_over_ground = foot * [1.0, 0.0, 1.0]
    return {
        "hip_flexion": _angle(_dot(thigh, ahead), -thigh[:, 1]),
        "hip_abduction": _angle(_dot(thigh, outward), -thigh[:, 1]),
        "knee_flexion": _bend(hip, knee, ankle),
        "foot_pitch": _angle(foot[:, 1], np.linalg.norm(foot_over_ground, axis=1)),
        "ankle_height": ankle[:, 1] / leg,
        "ankle_forward": _dot(ankle - at["hips"], ahead) / leg,
        "arm_forward": zero if arm is None else _angle(_dot(arm, ahead), -arm[:, 1]),
        "elbow_flexion": zero if elbow is None or wrist is None else _bend(shoulder, elbow, wrist),
    }


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)


def _angle(opposite: Array, adjacent: Array) -> Array:
    """Degrees of an angle in a right triangle, from the sides opposite and adjacent to it."""
    return np.degrees(np.arctan2(opposite, adjacent))


def _bend(a: Array, b: Array, c: Array) -> Array:
    """Degrees by which the joint at b bends the line from a to c, all (F, 3). 0 is straight."""
    u, v = b - a, c - b
    return _angle(np.linalg.norm(np.cross(u, v), axis=-1), _dot(u, v))


def _speed(points: Array, fps: float) -> Array:
    """(F,) speed of a point (F, 3) over the ground, cm a second."""
    return np.linalg.norm(np.gradient(points, axis=0)[:, ::2], axis=1) * fps
