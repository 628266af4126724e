"""Changes trunk, pelvis, head and arms: adds the leaning of impaired people, and holds a hurt arm still."""

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, aim_bone, forward_kinematics
from hobble.core.smooth import gaussian
from hobble.hurt.effects import HARMONICS, LEFT, RIGHT, SIDES, Effects
from hobble.hurt.healthy_clip import HealthyClip

X, Y, Z = np.eye(3)
PELVIS_LEAN = 0.35  # the pelvis tilts forward by this share of the trunk's lean
PELVIS_STIFFNESS = 0.7  # the pelvis loses this times as much of its movement as a stiff back loses
POSTURE_SECONDS = 0.5  # sigma of the Gaussian over time that gives a joint's mean posture
TRUNK_DIP = 0.35  # the trunk leans by this share of the head's nod, forward and over the hurt foot
LOOK_AHEAD = 0.85  # share of the trunk's lean that the head undoes, to look ahead
ARM_STILL = 0.93  # a held arm loses up to this share of its movement
# How firmly an arm is held grows with (strength of the injury) ** HOLD_POWER. So a mildly hurt arm swings
# nearly as far as a healthy arm. With a power of 1, the character that a network drives holds its arms too
# still at severity 5.
HOLD_POWER = 1.9
# Ways to hold a hurt left arm: the directions of upper arm and forearm as (forward, left, up), relative to
# the heading. `fore`, for a hurt forearm: the forearm lies across the belly. This is the mean posture of the
# clip Injured_Jog_LLA by Ferre et al., a jog with a hurt forearm. `upper`, for a hurt upper arm or shoulder:
# the upper arm is closer to the body, and the forearm points more forward. `carry`, for a hurt hand: the
# forearm is only raised in front of the body. `guard`, for a guarded leg or back: the
# elbow is bent by 50 degrees and away from the body, and the hand is in front of the thigh.
HELD_ARMS = {
    "upper": ((0.10, 0.16, -0.98), (0.80, -0.58, 0.10)),
    "fore": ((0.28, 0.17, -0.85), (0.26, -0.86, -0.41)),
    "carry": ((0.10, 0.14, -0.98), (0.92, -0.25, 0.30)),
    "guard": ((0.05, 0.34, -0.94), (0.62, -0.20, -0.72)),
}
CARRY_STRENGTH = 0.75  # an arm with a hurt hand (`carry`) is held less firmly, by this factor


def change_body(source: HealthyClip, effects: Effects) -> Array:
    """The world rotations (F, J, 4) of all joints in the source's frames, after the change.

    The legs only turn with the pelvis; `hobble.hurt.hurt_clip` changes them later.
    """
    skeleton = source.clip.skeleton
    local = _stiffen(source, effects)
    world, _ = forward_kinematics(skeleton, local, np.zeros((len(local), 3)))
    pelvis, chest, head = _added_rotations(source, effects)
    turns: dict[int, Array] = {}  # joint -> its added rotation; along back and neck it changes evenly
    for lower, upper, role, above in ((pelvis, chest, "chest", "hips"), (chest, head, "head", "chest")):
        joints = _between(skeleton, role, above)[::-1]
        for i, j in enumerate(joints):
            turns[j] = quat.slerp(lower, upper, np.full(len(source), (i + 1) / len(joints)))
    # The joints of a limb turn with the trunk's joint to which the limb is attached.
    none = np.zeros(len(source))
    at_hips, at_chest = quat.slerp(pelvis, chest, none), quat.slerp(chest, head, none)
    for j, parent in enumerate(skeleton.parents):
        if j not in turns:
            turns[j] = at_chest if parent == skeleton.role("chest") else turns.get(parent, at_hips)
        world[:, j] = quat.mul(turns[j], world[:, j])
    for side in (LEFT, RIGHT):
        _hold_arm(source, effects, world, side)
    return world


def _stiffen(source: HealthyClip, effects: Effects) -> Array:
    """Local rotations (F, J, 4), in which pelvis, back, neck and arms move less around their mean posture."""
    skeleton, local = source.clip.skeleton, source.clip.rotations.copy()
    back = _between(skeleton, "chest", "hips")
    neck = _between(skeleton, "head", "chest")
    # A stiff back cannot make up for the movement of the pelvis. If the pelvis moved as before, the whole
    # trunk would sway. So the pelvis moves less, too.
    pelvis = 1.0 - PELVIS_STIFFNESS * (1.0 - effects.ratio("back"))
    ratios = [([skeleton.role("hips")], pelvis), (back, effects.ratio("back")), (neck, effects.ratio("head"))]
    for side in (LEFT, RIGHT):
        arm = _between(skeleton, f"{SIDES[side]}_wrist", "chest")
        ratios.append((arm[1:], effects.ratio("arm")[:, side]))  # without the wrist, which turns the hand
    for joints, ratio in ratios:
        for j in joints:
            mean = quat.normalize(gaussian(quat.continuous(local[:, j]), POSTURE_SECONDS * source.clip.fps))
            local[:, j] = quat.slerp(mean, local[:, j], ratio)
    return local


def _between(skeleton: Skeleton, role: str, above: str) -> list[int]:
    """The joints from the one with `role` up to the one below the joint with the role `above`."""
    return skeleton.path_up(skeleton.role(role), skeleton.role(above))


def _added_rotations(source: HealthyClip, effects: Effects) -> tuple[Array, Array, Array]:
    """World rotations to add to pelvis, chest and head, (F, 4) each."""
    phase, known = source.phase, np.clip(source.phase_known, 0.0, 1.0)
    # The harmonics of the curves, see `read_profiles`. Without steps there is
    # no phase, so only the mean of each curve counts.
    waves = [np.ones(len(source))]
    for h in range(1, HARMONICS + 1):
        waves += [known * np.cos(2 * np.pi * h * phase), known * np.sin(2 * np.pi * h * phase)]
    # (F,) degrees each, in the order of CURVES.
    forward, left, left_up, turn, shoulders = np.einsum("fck,kf->cf", effects.curves, np.stack(waves))
    # Shorter steps turn pelvis and shoulders less.
    less = effects.ratio("turn") - 1.0
    turn, shoulders = turn + less * _turning(source, "hip"), shoulders + less * _turning(source, "shoulder")
    side, raised = effects.changes["side"], effects.changes["list"] * source.swing_curve
    # As a hurt foot bears weight, which is while the other foot swings, the head nods and the trunk follows.
    dips = effects.changes["dip"] * source.swing_curve[:, ::-1]
    dip, side = dips.sum(axis=1), side + TRUNK_DIP * dips
    forward = forward + effects.changes["forward"] + TRUNK_DIP * dip
    left = left + side[:, LEFT] - side[:, RIGHT]
    left_up = left_up + raised[:, LEFT] - raised[:, RIGHT]
    pelvis = _turn_and_lean(source, turn, left_up, PELVIS_LEAN * forward)
    chest = _turn_and_lean(source, shoulders, -left, forward)
    rest = 1 - LOOK_AHEAD  # what the head does not undo
    head = _turn_and_lean(
        source, rest * shoulders, -rest * left, rest * forward + effects.changes["nod"] + dip
    )
    return pelvis, chest, head


def _turning(source: HealthyClip, joint: str) -> Array:
    """(F,) degrees to the left by which the line through the right and the left joint turns in a step."""
    right, left = (source.clip.positions[:, source.clip.skeleton.role(f"{s}_{joint}")] for s in SIDES[::-1])
    across = left - right
    yaw = np.degrees(np.unwrap(np.arctan2(-across[:, 2], across[:, 0])))
    return yaw - gaussian(yaw, POSTURE_SECONDS * source.clip.fps)


def _turn_and_lean(source: HealthyClip, turn: Array, left_up: Array, forward: Array) -> Array:
    """(F, 4) world rotation that turns to the left, raises the left side and leans forward.

    All angles are (F,) degrees. The axes are those of the source's heading.
    """
    yaw, roll, pitch = (
        quat.from_axis_angle(axis, np.radians(angle))
        for axis, angle in ((Y, turn), (Z, left_up), (X, forward))
    )
    rotation = quat.mul(yaw, quat.mul(roll, pitch))
    return quat.mul(source.heading, quat.mul(rotation, quat.inv(source.heading)))


def _hold_arm(source: HealthyClip, effects: Effects, world: Array, side: int) -> None:
    """Hold a hurt arm with a bent elbow, close to the body or in front of it (HELD_ARMS).

    Changes `world`, the world rotations (F, J, 4). Frames in which the arm does not hurt stay the same.
    """
    skeleton = source.clip.skeleton
    # How much the arm is held in each way, (F,) from 0 to 1.
    weights = {name: np.clip(effects.changes[name][:, side], 0.0, 1.0) ** HOLD_POWER for name in HELD_ARMS}
    weights["carry"] = CARRY_STRENGTH * weights["carry"]
    held = ARM_STILL * np.max([*weights.values()], axis=0)
    if not held.any():
        return
    # Where the arm is not held, it needs a direction, too. It has no effect there.
    weights["carry"] = weights["carry"] + 1e-9
    mirror = np.array([1.0 if side == LEFT else -1.0, 1.0, 1.0])
    shoulder, elbow, wrist = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("shoulder", "elbow", "wrist"))
    for bone, (joint, end) in enumerate(((shoulder, elbow), (elbow, wrist))):
        direction: Array = np.zeros((len(source), 3))  # x is left, y is up, z is forward
        for name, directions in HELD_ARMS.items():
            forward, left, up = directions[bone]
            direction += weights[name][:, None] * np.array([left, up, forward]) * mirror
        direction = quat.rotate(source.heading, direction)
        rest_bone = skeleton.offsets[end]
        fully_held = aim_bone(world[:, joint], np.broadcast_to(rest_bone, direction.shape), direction)
        turn = quat.mul(quat.slerp(world[:, joint], fully_held, held), quat.inv(world[:, joint]))
        for j in range(len(skeleton.joints)):
            if joint in skeleton.path_up(j):
                world[:, j] = quat.mul(turn, world[:, j])
