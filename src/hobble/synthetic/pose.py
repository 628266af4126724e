"""Poses the figure: finds the hip positions and all joint rotations from the feet, the path and the style."""

from typing import NamedTuple

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, bone_axes, local_rotations, two_bone_knee
from hobble.core.smooth import smooth_above
from hobble.synthetic.feet import FootPoses
from hobble.synthetic.plan import Ground, PlannedPath, flat
from hobble.synthetic.style import LEFT, RIGHT, SIDE_SIGN, Style

X, Y, Z = np.eye(3)  # the three axes
# Shares of the swing of an arm, degrees by degrees, by which the shoulder girdle and the hand turn as well.
GIRDLE, HAND = 0.25, 0.5
GRAVITY = 981.0  # cm/s^2
TWIST = 12.0  # degrees by which an upper arm is turned inward about its axis
# The keys of both say whether the ground is flat. MAX_STRETCH: longest distance from hip to ankle, as a share
# of the leg's length. SMOOTHING_TIME: seconds, for the filter by which the hips come down smoothly to where
# the legs reach the ground.
MAX_STRETCH = {True: 0.992, False: 0.98}
SMOOTHING_TIME = {True: 0.03, False: 0.06}


class _Walk(NamedTuple):
    """What all parts of the pose depend on. phase: (F,) in cycles. noise: (F, 6), from `_noise`."""

    skeleton: Skeleton
    path: PlannedPath
    style: Style
    phase: Array
    noise: Array

    def wave(self, peak: Array | float, times: int = 1) -> Array:
        """(F,) cosine with `times` periods in a cycle; it is 1 at the phase `peak`."""
        return np.cos(2 * np.pi * times * (self.phase - peak))

    def mid_stance(self, side: int) -> Array:
        """(F,) phase in the middle of the stance of the foot `side` (LEFT or RIGHT)."""
        return self.style.duty[:, side] / 2 + (0.5 if side == LEFT else 0.0)


def _rotation(axis: Array, degrees: Array) -> Array:
    """(F, 4) rotations about an axis (3,). degrees: (F,)."""
    return quat.from_axis_angle(axis, np.radians(degrees))


def pose_figure(
    skeleton: Skeleton,
    path: PlannedPath,
    style: Style,
    phase: Array,
    feet: tuple[FootPoses, FootPoses],
    ground: Ground,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Local rotations (F, J, 4) and hip positions (F, 3) of every frame of the path.

    phase: (F,) in cycles. feet: motion of the left foot and of the right foot. rng: for small random
    turns and shifts of the trunk and head.
    """
    walk = _Walk(skeleton, path, style, phase, _noise(rng, len(path), path.fps, 6))
    yaw = quat.yaw(path.facing)
    hips, chest = _pelvis_rotation(walk, yaw), _chest_rotation(walk, yaw)
    root = _hip_positions(walk, feet, ground, hips)
    world = np.tile(quat.IDENTITY, (len(path), len(skeleton.joints), 1))
    _set_trunk_and_head(walk, world, hips, chest)
    for side in (LEFT, RIGHT):
        _set_leg(walk, world, root, feet[side], side)
        _set_arm(walk, world, side)
    return local_rotations(skeleton, world), root


def _noise(rng: np.random.Generator, frames: int, fps: float, count: int) -> Array:
    """(F, count) slow random curves with variance 1."""
    from scipy.ndimage import gaussian_filter1d  # here, because planning need not load SciPy

    white = rng.normal(size=(frames, count))
    smooth = gaussian_filter1d(white, 0.45 * fps, axis=0, mode="wrap")
    return smooth / smooth.std(axis=0)


def _pelvis_rotation(walk: _Walk, yaw: Array) -> Array:
    """(F, 4) world rotation. yaw: (F, 4) rotation to the facing direction."""
    turn = walk.style.pelvis_yaw * walk.wave(0.0) + 0.6 * walk.noise[:, 0]
    lean = walk.style.pelvis_list * walk.wave(walk.style.list_peak)
    tilt = walk.style.pelvis_tilt + 0.8 * walk.wave(0.0, 2)
    return quat.mul(yaw, quat.mul(_rotation(Y, turn), quat.mul(_rotation(Z, lean), _rotation(X, tilt))))


def _chest_rotation(walk: _Walk, yaw: Array) -> Array:
    """(F, 4) world rotation. The chest turns opposite to the pelvis. yaw: see `_pelvis_rotation`."""
    turn = -walk.style.chest_yaw * walk.wave(0.03) + 0.8 * walk.noise[:, 1]
    lean = walk.style.lean + walk.style.bow * walk.wave(0.05, 2) + 0.8 * walk.noise[:, 2]
    inward = quat.from_axis_angle(Z, -_lean_into_turn(walk.path))
    return quat.mul(yaw, quat.mul(inward, quat.mul(_rotation(Y, turn), _rotation(X, lean))))


def _lean_into_turn(path: PlannedPath) -> Array:
    """(F,) radians by which the body leans to the left, so that it does not fall outward in a turn."""
    rate = np.gradient(path.facing) * path.fps  # radians a second
    return np.arctan(rate * path.velocity[:, 1] / GRAVITY)


def _hip_positions(walk: _Walk, feet: tuple[FootPoses, FootPoses], ground: Ground, hips: Array) -> Array:
    """(F, 3) positions of the hips, cm: along the path, with sway and bob, and so low that knees are bent.

    hips: (F, 4) rotations of the pelvis.
    """
    from scipy.ndimage import gaussian_filter1d  # here, because planning need not load SciPy

    path, style, noise, flat_ground = walk.path, walk.style, walk.noise, ground is flat
    left, right = (walk.mid_stance(side) for side in (LEFT, RIGHT))
    sway = style.sway * (walk.wave(left) - walk.wave(right)) / 2
    sway = sway + 0.3 * noise[:, 3]
    # Mean over both feet. The left foot is half a cycle behind, which is one period of bob and surge.
    middle = (right + left - 0.5) / 2
    surge = (style.surge * walk.wave(middle - 0.125, 2))[:, None]
    ahead = path.velocity / np.maximum(path.speed, 1e-6)[:, None] * surge
    aside = sway + ahead[:, 0] + style.height * np.tan(_lean_into_turn(path))
    forward = ahead[:, 1]
    x = path.position[:, 0] + aside * np.cos(path.facing) + forward * np.sin(path.facing)
    z = path.position[:, 1] - aside * np.sin(path.facing) + forward * np.cos(path.facing)
    ground_height = gaussian_filter1d(ground(x, z), 0.16 * path.fps, mode="nearest")  # over 0.16 s
    height = ground_height + style.height + style.bob * walk.wave(middle, 2) + 0.2 * noise[:, 4]
    root = np.stack([x, height, z], axis=1)
    excess = np.zeros(len(path))
    for side, name in ((LEFT, "Left"), (RIGHT, "Right")):
        too_high = _too_high(walk.skeleton, root, hips, feet[side], name, MAX_STRETCH[flat_ground])
        excess = np.maximum(excess, too_high)
    down = smooth_above(excess, round(SMOOTHING_TIME[flat_ground] * path.fps))
    return root - np.stack([0 * x, down, 0 * x], axis=1)


def _too_high(
    skeleton: Skeleton, root: Array, hips: Array, foot: FootPoses, side: str, stretch: float
) -> Array:
    """(F,) cm by which the hip joint must come down to be at most `stretch` leg lengths from the ankle.

    root, hips: (F, 3) positions and (F, 4) rotations of the pelvis. side: "Left" or "Right".
    """
    hip_joint = root + quat.rotate(hips, skeleton.offsets[skeleton.index(f"{side}UpLeg")])
    upper, lower = leg_lengths(skeleton, side)
    from_ankle = hip_joint - foot.ankle
    # Squared horizontal distance. It is limited so that the next line takes the root of a positive number.
    squared_distance = np.minimum(from_ankle[:, 0] ** 2 + from_ankle[:, 2] ** 2, (0.9 * (upper + lower)) ** 2)
    highest = np.sqrt((stretch * (upper + lower)) ** 2 - squared_distance)
    return np.maximum(from_ankle[:, 1] - highest, 0.0)


def leg_lengths(skeleton: Skeleton, side: str) -> tuple[float, float]:
    """Lengths of thigh and shank, cm. side: "Left" or "Right"."""
    bones = (skeleton.offsets[skeleton.index(f"{side}{bone}")] for bone in ("Leg", "Foot"))
    upper, lower = (float(np.linalg.norm(bone)) for bone in bones)
    return upper, lower


def _set_trunk_and_head(walk: _Walk, world: Array, hips: Array, chest: Array) -> None:
    """Set the world rotations of pelvis, spine, neck and head. hips, chest: (F, 4) rotations."""
    path, noise, index = walk.path, walk.noise, walk.skeleton.index
    # The head looks up to 8 degrees into a turn of the path.
    ahead = np.radians(4) * np.clip(np.gradient(path.facing) * path.fps, -2, 2)
    pitch = 2.0 + walk.style.nod * walk.wave(0.05, 2) + noise[:, 0]  # forward as a foot lands
    tilted = quat.mul(_rotation(Y, 1.5 * noise[:, 5]), _rotation(X, pitch))
    head = quat.mul(quat.yaw(path.facing + ahead), tilted)
    for name in ("Hips", "LHipJoint", "RHipJoint"):
        world[:, index(name)] = hips
    for name, lower, upper, share in (
        *(("LowerBack", hips, chest, 0.3), ("Spine", hips, chest, 0.65), ("Spine1", hips, chest, 1.0)),
        *(("Neck", chest, head, 0.1), ("Neck1", chest, head, 0.5), ("Head", chest, head, 1.0)),
    ):
        world[:, index(name)] = quat.slerp(lower, upper, np.full(len(path), share))


def _set_leg(walk: _Walk, world: Array, root: Array, foot: FootPoses, side: int) -> None:
    """Set a leg by inverse kinematics. The knee points midway between the directions of pelvis and foot."""
    name, skeleton = ("Left", "Right")[side], walk.skeleton
    hips = world[:, 0]
    hip_joint = root + quat.rotate(hips, skeleton.offsets[skeleton.index(f"{name}UpLeg")])
    forward = walk.style.knee_out[:, None] * SIDE_SIGN[side] * X + Z
    knee_direction = quat.rotate(hips, forward) + quat.rotate(foot.foot, forward)
    upper, lower = leg_lengths(skeleton, name)
    knee, ankle = two_bone_knee(hip_joint, foot.ankle, knee_direction, upper, lower)
    side_axis = np.cross(hip_joint - ankle, knee_direction)
    # A bone of the leg hangs down (-Y) at rest and bends about its X axis.
    for joint, up in (("UpLeg", hip_joint - knee), ("Leg", knee - ankle)):
        world[:, skeleton.index(f"{name}{joint}")] = quat.from_matrix(bone_axes(up, side_axis))
    world[:, skeleton.index(f"{name}Foot")] = foot.foot
    world[:, skeleton.index(f"{name}ToeBase")] = foot.toes


def _set_arm(walk: _Walk, world: Array, side: int) -> None:
    """Set the rotations of an arm. It swings opposite to its side's leg and bends more on its way forward."""
    path, style, index = walk.path, walk.style, walk.skeleton.index
    name, sign, later = ("Left", "Right")[side], SIDE_SIGN[side], 0.0 if side == LEFT else 0.5
    chest = world[:, index("Spine1")]
    # The arms follow the lean and turn of the chest about half.
    shoulders = quat.slerp(quat.yaw(path.facing), chest, np.full(len(path), 0.55))
    swing = walk.wave(0.02 + later)
    flexion = style.arm_mean[:, side] + style.arm_swing[:, side] * swing
    elbow = style.elbow[:, side] + style.elbow_swing[:, side] * walk.wave(0.05 + later)
    # In the rest pose an arm points sideways, along X. It is turned down about Z.
    down = _rotation(Z, sign * (style.abduction[:, side] - 90))
    upper = quat.mul(quat.mul(shoulders, _rotation(X, -flexion)), down)
    upper = quat.mul(upper, _rotation(X, np.full(len(path), TWIST)))
    lower = quat.mul(upper, _rotation(Y, -sign * np.maximum(elbow, 2)))
    # The shoulder girdle goes along with the arm, and the hand hangs behind in the swing.
    along = style.arm_swing[:, side] * swing
    world[:, index(f"{name}Shoulder")] = quat.mul(chest, _rotation(Y, -sign * GIRDLE * along))
    world[:, index(f"{name}Arm")] = upper
    world[:, index(f"{name}ForeArm")] = lower
    hand = quat.mul(lower, _rotation(Y, -sign * (8.0 + HAND * along)))
    for joint in (f"{name}Hand", f"{name}FingerBase", f"{name}HandIndex1", f"{name[0]}Thumb"):
        world[:, index(joint)] = hand
