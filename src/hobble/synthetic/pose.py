"""The position of the hips and the rotations of all joints, from the feet, the path and the style."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hobble.core import quat
from hobble.core.ik import two_bone_knee
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.core.smooth import smooth_above
from hobble.synthetic.foot_motion import FootPoses
from hobble.synthetic.planned_ground import Ground, flat
from hobble.synthetic.planned_path import PlannedPath
from hobble.synthetic.style import LEFT, RIGHT, SIGN, Style

X, Y, Z = np.eye(3)
TWIST = 12.0  # degrees by which an upper arm is turned inward about its axis
# The keys say whether the ground is flat.
STRETCH = {True: 0.9975, False: 0.98}  # longest distance from hip to ankle, as a share of the leg's length
SMOOTH = {True: 0.03, False: 0.06}  # seconds over which the hips come down so that the legs reach the ground


def _turn(axis: Array, degrees: Array) -> Array:
    return quat.from_axis_angle(axis, np.radians(degrees))


def pose(
    skeleton: Skeleton,
    path: PlannedPath,
    style: Style,
    phase: Array,
    feet: tuple[FootPoses, FootPoses],
    ground: Ground,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Local rotations (F, J, 4) and hip positions (F, 3) of every frame of the path.

    phase: (F,) in cycles. feet: motion of the left and of the right foot.
    """
    noise = _noise(rng, len(path), path.fps, 6)
    yaw = quat.yaw(path.facing)
    hips, chest = _pelvis(style, phase, yaw, noise), _chest(style, phase, yaw, noise)
    root = _root(skeleton, path, style, phase, feet, ground, hips, noise)
    world = np.tile(quat.IDENTITY, (len(path), len(skeleton.joints), 1))
    _trunk(skeleton, world, path, hips, chest, noise)
    for side in (LEFT, RIGHT):
        _leg(skeleton, world, root, feet[side], side)
        _arm(skeleton, world, path, style, phase, side)
    return local_rotations(skeleton, world), root


def _noise(rng: np.random.Generator, frames: int, fps: float, count: int) -> Array:
    """(F, count) slow noise of unit variance."""
    white = rng.normal(size=(frames, count))
    smooth = gaussian_filter1d(white, 0.45 * fps, axis=0, mode="wrap")
    return smooth / smooth.std(axis=0)


def _wave(phase: Array, peak: Array | float, times: int = 1) -> Array:
    """(F,) cosine with `times` periods in a cycle; it is 1 at the phase `peak`."""
    return np.cos(2 * np.pi * times * (phase - peak))


def _centre(style: Style, side: int) -> Array:
    """(F,) phase in the middle of a foot's stance."""
    return style.duty[:, side] / 2 + (0.5 if side == LEFT else 0.0)


def _pelvis(style: Style, phase: Array, yaw: Array, noise: Array) -> Array:
    turn = style.pelvis_yaw * _wave(phase, 0.0) + 0.6 * noise[:, 0]
    lean = -style.pelvis_list * _wave(phase, 0.25)
    tilt = style.pelvis_tilt + 0.8 * _wave(phase, 0.0, 2)
    return quat.mul(yaw, quat.mul(_turn(Y, turn), quat.mul(_turn(Z, lean), _turn(X, tilt))))


def _chest(style: Style, phase: Array, yaw: Array, noise: Array) -> Array:
    turn = -style.chest_yaw * _wave(phase, 0.03) + 0.8 * noise[:, 1]
    lean = style.lean + 0.8 * _wave(phase, 0.05, 2) + 0.8 * noise[:, 2]
    return quat.mul(yaw, quat.mul(_turn(Y, turn), _turn(X, lean)))


def _root(
    skeleton: Skeleton,
    path: PlannedPath,
    style: Style,
    phase: Array,
    feet: tuple[FootPoses, FootPoses],
    ground: Ground,
    hips: Array,
    noise: Array,
) -> Array:
    """(F, 3) hip positions: along the path, with sway and bob, and so low that no leg is fully straight."""
    sway = style.sway * (_wave(phase, _centre(style, LEFT)) - _wave(phase, _centre(style, RIGHT))) / 2
    sway = sway + 0.3 * noise[:, 3]
    x = path.position[:, 0] + sway * np.cos(path.facing)
    z = path.position[:, 1] - sway * np.sin(path.facing)
    ground_height = gaussian_filter1d(ground(x, z), 0.16 * path.fps, mode="nearest")
    middle = (_centre(style, RIGHT) + _centre(style, LEFT) - 0.5) / 2
    height = ground_height + style.height + style.bob * _wave(phase, middle, 2) + 0.2 * noise[:, 4]
    root = np.stack([x, height, z], axis=1)
    excess = np.zeros(len(path))
    for side, name in ((LEFT, "Left"), (RIGHT, "Right")):
        excess = np.maximum(
            excess, _too_high(skeleton, root, hips, feet[side], name, STRETCH[ground is flat])
        )
    down = smooth_above(excess, round(SMOOTH[ground is flat] * path.fps))
    return root - np.stack([0 * x, down, 0 * x], axis=1)


def _too_high(
    skeleton: Skeleton, root: Array, hips: Array, foot: FootPoses, side: str, stretch: float
) -> Array:
    """(F,) cm by which the hip joint must come down to be at most `stretch` leg lengths from the ankle.

    root, hips: positions and rotations of the pelvis. side: "Left" or "Right".
    """
    joint = root + quat.rotate(hips, skeleton.offsets[skeleton.index(f"{side}UpLeg")])
    upper, lower = leg_lengths(skeleton, side)
    away = joint - foot.ankle
    horizontal = np.minimum(away[:, 0] ** 2 + away[:, 2] ** 2, (0.9 * (upper + lower)) ** 2)
    highest = np.sqrt((stretch * (upper + lower)) ** 2 - horizontal)
    return np.maximum(away[:, 1] - highest, 0.0)


def leg_lengths(skeleton: Skeleton, side: str) -> tuple[float, float]:
    """Lengths of thigh and shank, cm. side: "Left" or "Right"."""
    bones = (skeleton.offsets[skeleton.index(f"{side}{bone}")] for bone in ("Leg", "Foot"))
    upper, lower = (float(np.linalg.norm(bone)) for bone in bones)
    return upper, lower


def _trunk(
    skeleton: Skeleton, world: Array, path: PlannedPath, hips: Array, chest: Array, noise: Array
) -> None:
    ahead = np.radians(4) * np.clip(np.gradient(path.facing) * path.fps, -2, 2)
    look = quat.mul(
        quat.yaw(path.facing + ahead), quat.mul(_turn(Y, 1.5 * noise[:, 5]), _turn(X, 2.0 + noise[:, 0]))
    )
    for name in ("Hips", "LHipJoint", "RHipJoint"):
        world[:, skeleton.index(name)] = hips
    for name, share in (("LowerBack", 0.3), ("Spine", 0.65), ("Spine1", 1.0)):
        world[:, skeleton.index(name)] = quat.slerp(hips, chest, np.full(len(path), share))
    for name, share in (("Neck", 0.1), ("Neck1", 0.5), ("Head", 1.0)):
        world[:, skeleton.index(name)] = quat.slerp(chest, look, np.full(len(path), share))


def _leg(skeleton: Skeleton, world: Array, root: Array, foot: FootPoses, side: int) -> None:
    """Set a leg by inverse kinematics. The knee points midway between the facings of pelvis and foot."""
    name = ("Left", "Right")[side]
    hips = world[:, 0]
    hip = root + quat.rotate(hips, skeleton.offsets[skeleton.index(f"{name}UpLeg")])
    outward = np.array([SIGN[side] * 0.06, 0.0, 1.0])
    toward = quat.rotate(hips, outward) + quat.rotate(foot.foot, outward)
    upper, lower = leg_lengths(skeleton, name)
    knee, ankle = two_bone_knee(hip, foot.ankle, toward, upper, lower)
    side_axis = np.cross(hip - ankle, toward)
    world[:, skeleton.index(f"{name}UpLeg")] = _bone(hip - knee, side_axis)
    world[:, skeleton.index(f"{name}Leg")] = _bone(knee - ankle, side_axis)
    world[:, skeleton.index(f"{name}Foot")] = foot.foot
    world[:, skeleton.index(f"{name}ToeBase")] = foot.toes


def _bone(up: Array, side_axis: Array) -> Array:
    """(F, 4) world rotation of a bone that hangs down (-Y) at rest and bends about its X axis.

    up, side_axis: (F, 3) directions of the bone's Y and (approximately) X axis.
    """
    y = up / np.linalg.norm(up, axis=-1, keepdims=True)
    x = side_axis - y * np.sum(y * side_axis, axis=-1, keepdims=True)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return quat.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))


def _arm(skeleton: Skeleton, world: Array, path: PlannedPath, style: Style, phase: Array, side: int) -> None:
    """Set an arm. It hangs, swings opposite to the leg of its side, and bends more as it swings forward."""
    name, sign = ("Left", "Right")[side], SIGN[side]
    chest = world[:, skeleton.index("Spine1")]
    upright = quat.slerp(quat.yaw(path.facing), chest, np.full(len(path), 0.55))
    swing = _wave(phase, 0.02 if side == LEFT else 0.52)
    flexion = style.arm_mean[:, side] + style.arm_swing[:, side] * swing
    elbow = style.elbow[:, side] + style.elbow_swing[:, side] * _wave(phase, 0.05 if side == LEFT else 0.55)
    upper = quat.mul(quat.mul(upright, _turn(X, -flexion)), _turn(Z, sign * (style.abduction[:, side] - 90)))
    upper = quat.mul(upper, _turn(X, np.full(len(path), TWIST)))
    lower = quat.mul(upper, _turn(Y, -sign * np.maximum(elbow, 2)))
    world[:, skeleton.index(f"{name}Shoulder")] = chest
    world[:, skeleton.index(f"{name}Arm")] = upper
    world[:, skeleton.index(f"{name}ForeArm")] = lower
    hand = quat.mul(lower, _turn(Y, np.full(len(path), -sign * 8.0)))
    first = "L" if side == LEFT else "R"
    for joint in (f"{name}Hand", f"{name}FingerBase", f"{name}HandIndex1", f"{first}Thumb"):
        world[:, skeleton.index(joint)] = hand
