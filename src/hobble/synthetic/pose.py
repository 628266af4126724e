"""Poses the figure: finds the hip positions and all joint rotations from the feet, the path and the style."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

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
TWIST = 12.0  # degrees by which an upper arm is turned inward about its axis
# The keys of both say whether the ground is flat. MAX_STRETCH: longest distance from hip to ankle, as a share
# of the leg's length. SMOOTHING_TIME: seconds, for the filter by which the hips come down smoothly to where
# the legs reach the ground.
MAX_STRETCH = {True: 0.9975, False: 0.98}
SMOOTHING_TIME = {True: 0.03, False: 0.06}


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
    noise = _noise(rng, len(path), path.fps, 6)
    yaw = quat.yaw(path.facing)
    hips, chest = _pelvis_rotation(style, phase, yaw, noise), _chest_rotation(style, phase, yaw, noise)
    root = _hip_positions(skeleton, path, style, phase, feet, ground, hips, noise)
    world = np.tile(quat.IDENTITY, (len(path), len(skeleton.joints), 1))
    _set_trunk_and_head(skeleton, world, path, style, phase, hips, chest, noise)
    for side in (LEFT, RIGHT):
        _set_leg(skeleton, world, root, feet[side], side)
        _set_arm(skeleton, world, path, style, phase, side)
    return local_rotations(skeleton, world), root


def _noise(rng: np.random.Generator, frames: int, fps: float, count: int) -> Array:
    """(F, count) slow random curves with variance 1."""
    white = rng.normal(size=(frames, count))
    smooth = gaussian_filter1d(white, 0.45 * fps, axis=0, mode="wrap")
    return smooth / smooth.std(axis=0)


def _wave(phase: Array, peak: Array | float, times: int = 1) -> Array:
    """(F,) cosine with `times` periods in a cycle; it is 1 at the phase `peak`."""
    return np.cos(2 * np.pi * times * (phase - peak))


def _mid_stance(style: Style, side: int) -> Array:
    """(F,) phase in the middle of the stance of the foot `side` (LEFT or RIGHT)."""
    return style.duty[:, side] / 2 + (0.5 if side == LEFT else 0.0)


def _pelvis_rotation(style: Style, phase: Array, yaw: Array, noise: Array) -> Array:
    """(F, 4) world rotation. yaw: (F, 4) rotation to the facing direction. noise: from `_noise`."""
    turn = style.pelvis_yaw * _wave(phase, 0.0) + 0.6 * noise[:, 0]
    lean = -style.pelvis_list * _wave(phase, 0.25)
    tilt = style.pelvis_tilt + 0.8 * _wave(phase, 0.0, 2)
    return quat.mul(yaw, quat.mul(_rotation(Y, turn), quat.mul(_rotation(Z, lean), _rotation(X, tilt))))


def _chest_rotation(style: Style, phase: Array, yaw: Array, noise: Array) -> Array:
    """(F, 4) world rotation. The chest turns opposite to the pelvis. yaw, noise: see `_pelvis_rotation`."""
    turn = -style.chest_yaw * _wave(phase, 0.03) + 0.8 * noise[:, 1]
    lean = style.lean + 0.8 * _wave(phase, 0.05, 2) + 0.8 * noise[:, 2]
    return quat.mul(yaw, quat.mul(_rotation(Y, turn), _rotation(X, lean)))


def _hip_positions(
    skeleton: Skeleton,
    path: PlannedPath,
    style: Style,
    phase: Array,
    feet: tuple[FootPoses, FootPoses],
    ground: Ground,
    hips: Array,
    noise: Array,
) -> Array:
    """(F, 3) positions of the hips, cm: along the path, with sway and bob, and so low that knees are bent.

    hips: (F, 4) rotations of the pelvis. noise: from `_noise`.
    """
    sway = style.sway * (_wave(phase, _mid_stance(style, LEFT)) - _wave(phase, _mid_stance(style, RIGHT))) / 2
    sway = sway + 0.3 * noise[:, 3]
    # Mean over both feet. The left foot is half a cycle behind, which is one period of bob and surge.
    middle = (_mid_stance(style, RIGHT) + _mid_stance(style, LEFT) - 0.5) / 2
    ahead = (
        path.velocity
        / np.maximum(path.speed, 1e-6)[:, None]
        * (style.surge * _wave(phase, middle - 0.125, 2))[:, None]
    )
    aside, forward = sway + ahead[:, 0], ahead[:, 1]
    x = path.position[:, 0] + aside * np.cos(path.facing) + forward * np.sin(path.facing)
    z = path.position[:, 1] - aside * np.sin(path.facing) + forward * np.cos(path.facing)
    ground_height = gaussian_filter1d(ground(x, z), 0.16 * path.fps, mode="nearest")  # over 0.16 s
    height = ground_height + style.height + style.bob * _wave(phase, middle, 2) + 0.2 * noise[:, 4]
    root = np.stack([x, height, z], axis=1)
    excess = np.zeros(len(path))
    for side, name in ((LEFT, "Left"), (RIGHT, "Right")):
        excess = np.maximum(
            excess, _too_high(skeleton, root, hips, feet[side], name, MAX_STRETCH[ground is flat])
        )
    down = smooth_above(excess, round(SMOOTHING_TIME[ground is flat] * path.fps))
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


def _set_trunk_and_head(
    skeleton: Skeleton,
    world: Array,
    path: PlannedPath,
    style: Style,
    phase: Array,
    hips: Array,
    chest: Array,
    noise: Array,
) -> None:
    """Set the world rotations of pelvis, spine, neck and head. hips, chest: (F, 4) rotations."""
    # The head looks up to 8 degrees into a turn of the path.
    ahead = np.radians(4) * np.clip(np.gradient(path.facing) * path.fps, -2, 2)
    pitch = 2.0 + style.nod * _wave(phase, 0.05, 2) + noise[:, 0]  # forward as a foot lands
    head = quat.mul(
        quat.yaw(path.facing + ahead),
        quat.mul(_rotation(Y, 1.5 * noise[:, 5]), _rotation(X, pitch)),
    )
    for name in ("Hips", "LHipJoint", "RHipJoint"):
        world[:, skeleton.index(name)] = hips
    for name, share in (("LowerBack", 0.3), ("Spine", 0.65), ("Spine1", 1.0)):
        world[:, skeleton.index(name)] = quat.slerp(hips, chest, np.full(len(path), share))
    for name, share in (("Neck", 0.1), ("Neck1", 0.5), ("Head", 1.0)):
        world[:, skeleton.index(name)] = quat.slerp(chest, head, np.full(len(path), share))


def _set_leg(skeleton: Skeleton, world: Array, root: Array, foot: FootPoses, side: int) -> None:
    """Set a leg by inverse kinematics. The knee points midway between the directions of pelvis and foot."""
    name = ("Left", "Right")[side]
    hips = world[:, 0]
    hip_joint = root + quat.rotate(hips, skeleton.offsets[skeleton.index(f"{name}UpLeg")])
    forward = np.array([SIDE_SIGN[side] * 0.06, 0.0, 1.0])  # and slightly outward
    knee_direction = quat.rotate(hips, forward) + quat.rotate(foot.foot, forward)
    upper, lower = leg_lengths(skeleton, name)
    knee, ankle = two_bone_knee(hip_joint, foot.ankle, knee_direction, upper, lower)
    side_axis = np.cross(hip_joint - ankle, knee_direction)
    # A bone of the leg hangs down (-Y) at rest and bends about its X axis.
    for joint, up in (("UpLeg", hip_joint - knee), ("Leg", knee - ankle)):
        world[:, skeleton.index(f"{name}{joint}")] = quat.from_matrix(bone_axes(up, side_axis))
    world[:, skeleton.index(f"{name}Foot")] = foot.foot
    world[:, skeleton.index(f"{name}ToeBase")] = foot.toes


def _set_arm(
    skeleton: Skeleton, world: Array, path: PlannedPath, style: Style, phase: Array, side: int
) -> None:
    """Set the rotations of an arm. It swings opposite to its side's leg and bends more on its way forward."""
    name, sign = ("Left", "Right")[side], SIDE_SIGN[side]
    chest = world[:, skeleton.index("Spine1")]
    # The arms follow the lean and turn of the chest about half.
    shoulders = quat.slerp(quat.yaw(path.facing), chest, np.full(len(path), 0.55))
    swing = _wave(phase, 0.02 if side == LEFT else 0.52)
    flexion = style.arm_mean[:, side] + style.arm_swing[:, side] * swing
    elbow = style.elbow[:, side] + style.elbow_swing[:, side] * _wave(phase, 0.05 if side == LEFT else 0.55)
    # In the rest pose an arm points sideways, along X. It is turned down about Z.
    upper = quat.mul(
        quat.mul(shoulders, _rotation(X, -flexion)), _rotation(Z, sign * (style.abduction[:, side] - 90))
    )
    upper = quat.mul(upper, _rotation(X, np.full(len(path), TWIST)))
    lower = quat.mul(upper, _rotation(Y, -sign * np.maximum(elbow, 2)))
    # The shoulder girdle goes along with the arm, and the hand hangs behind in the swing.
    along = style.arm_swing[:, side] * swing
    world[:, skeleton.index(f"{name}Shoulder")] = quat.mul(chest, _rotation(Y, -sign * GIRDLE * along))
    world[:, skeleton.index(f"{name}Arm")] = upper
    world[:, skeleton.index(f"{name}ForeArm")] = lower
    hand = quat.mul(lower, _rotation(Y, -sign * (8.0 + HAND * along)))
    initial = "L" if side == LEFT else "R"
    for joint in (f"{name}Hand", f"{name}FingerBase", f"{name}HandIndex1", f"{initial}Thumb"):
        world[:, skeleton.index(joint)] = hand
