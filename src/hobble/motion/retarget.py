"""Transfers one figure's motion to another, by joint maps, rest poses and leg lengths.

The source is the figure whose motion is known; the target gets this motion. World rotations are transferred
relative to the rest poses. Limbs get the directions of the source's limbs. Trunk, head and feet turn from
their rest pose by the same rotation as in the source, so that a flat foot stays flat even if its ankle is
higher. The path is scaled by leg length of the target / leg length of the source.
Two-bone inverse kinematics puts the balls of standing feet where they are in the scaled source, so that feet
that do not slide in the source do not slide in the result. Knees of swinging legs bend as in the source. If
the source's legs are not equally long, the pelvis is turned so that both feet stand on the same ground.
Joints that follow no joint of the source (fingers, face, roll joints) keep their rest pose relative to the
joint above.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import (
    Skeleton,
    aim_bone,
    local_rotations,
    path_between,
    rest_positions,
    two_bone_knee,
)
from hobble.core.smooth import gaussian, lowest, smooth_above, smoothstep
from hobble.motion import Problem
from hobble.motion.axes import AHEAD, UP, angles_between, bend_direction, degrees_between, rest_frame, unit
from hobble.motion.body import SIDES
from hobble.motion.ground import steady_heels
from hobble.motion.rig import leg_length, leg_lengths

# Bones of limbs, without the side: role of the joint that turns the bone -> role of the joint at its end.
LIMB_BONES = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "heel"}
# Both are distances from hip to ankle, as shares of the leg's length. If the source's leg has the share
# NEARLY_STRAIGHT or more, the target's hips come down until its leg is no straighter than the source's. If
# the share is BENT or less, they do not come down. Between the two shares, they come down by a growing part.
BENT, NEARLY_STRAIGHT = 0.88, 0.95
SMOOTH = 0.04  # seconds: half of the time on each side of a frame over which the drop of the hips is smoothed
# Radians by which a knee may bend less than in the source before the hips come down. They come down smoothly,
# by more than most frames need. Without SPARED, knees would bend 4 degrees more than in the source on
# average, in some clips 9. With 8, nearly straight knees would jerk.
SPARED = np.radians(5.0)
MOST_DROP = 6.0  # cm by which the hips come down at most
# cm: a knee that is nearer than this to the line from hip to ankle hardly shows which way it bends. So its
# direction is mixed with the forward direction.
STRAIGHT = 0.5
# cm a second: a ball of the foot that is slower than the first stands, one faster than the second swings.
SWING = (40.0, 120.0)
# Radians by which a pelvis that is turned to make the feet level may lean to the other side. UNEVEN: cm
# between the heights of the standing feet of the source from which on its ground is not flat.
LEVEL, UNEVEN = np.radians(2.0), 3.0


@dataclass(frozen=True)
class Retarget:
    """How the skeleton `target` follows the skeleton `source`. Made once by `plan`, applied to any pose.

    joints: (M,) indices of the target joints that follow a joint of the source, parents first. follows: (M,)
    indices of the source joints that they follow. turns: (M, 4); the world rotation of a target joint is the
    world rotation of its source joint times its turn.

    drivers: (J,) for each target joint the nearest of `joints` above it, or the joint itself if it is one of
    them. A joint has the world rotation of its driver. driver_offsets: (J, 3) cm, position of each joint in
    the coordinates of its driver, or of its parent's driver if the joint is its own driver.

    forward: (3,) the direction that the target's rest pose faces. pelvis: (3,) cm, from the target's hips to
    the middle between its two hip joints. scale: leg length of the target / leg length of the source. lifts:
    (2,) cm by which the hip joint is higher above the ball of the foot than in the scaled source, if the leg
    bends as it does there; left, then right. The hips rise by the mean. If the legs of a figure are not
    equally long, the balls of the feet go down or up by the rest, so that no knee bends for it. In clips,
    `level_pelvis` makes the rest small.
    """

    source: Skeleton = field(repr=False)
    target: Skeleton = field(repr=False)
    joints: Array
    follows: Array
    turns: Array = field(repr=False)
    drivers: Array = field(repr=False)
    driver_offsets: Array = field(repr=False)
    forward: Array = field(repr=False)
    pelvis: Array = field(repr=False)
    scale: float
    lifts: Array = field(repr=False)


def plan(source: Skeleton, target: Skeleton, followed_joints: Mapping[str, str]) -> Retarget:
    """Plan how `target` follows `source`.

    followed_joints: name of a target joint -> name of the source joint that it follows. Both skeletons need
    the roles hips and head, and on both sides shoulder, hip, knee, heel and toe. Raises HobbleError if the
    target's hips, or a hip, knee or heel, follows nothing, or if a bone of a leg has no length.
    """
    pairs = sorted((target.index(mine), source.index(theirs)) for mine, theirs in followed_joints.items())
    joints, follows = (np.array(column) for column in zip(*pairs, strict=True))
    for role in ("hips", *(f"{s}_{part}" for s in SIDES for part in ("hip", "knee", "heel"))):
        if target.role(role) not in joints:
            joint = f"{target.roles[role]} ({role}) of {target.name}"
            raise HobbleError(f"no joint of {source.name} moves {joint}")
    # The upright pose has the body's left at +X, up at +Y and forward at +Z.
    upright_to_source, upright_to_target = rest_frame(source), rest_frame(target)
    target_to_upright = quat.inv(upright_to_target)
    turns = np.broadcast_to(quat.mul(upright_to_source, target_to_upright), (len(pairs), 4)).copy()
    limb_turns = _limb_turns(source, target, upright_to_source, target_to_upright)
    for i, pair in enumerate(pairs):
        turns[i] = limb_turns.get(pair, turns[i])
    scale = leg_length(target) / leg_length(source)
    drivers, driver_offsets = _drivers(target, joints)
    rest = rest_positions(target)
    middle = 0.5 * (rest[target.role("left_hip")] + rest[target.role("right_hip")])
    return Retarget(
        source=source,
        target=target,
        joints=joints,
        follows=follows,
        turns=turns,
        drivers=drivers,
        driver_offsets=driver_offsets,
        forward=quat.rotate(upright_to_target, AHEAD),
        pelvis=middle - rest[target.role("hips")],
        scale=scale,
        lifts=_hip_heights(target, target_to_upright)
        - scale * _hip_heights(source, quat.inv(upright_to_source)),
    )


def _limb_turns(
    source: Skeleton, target: Skeleton, upright_to_source: Array, target_to_upright: Array
) -> dict[tuple[int, int], Array]:
    """(target joint, source joint) -> the turn (4,) that makes their bones parallel, for each limb bone.

    The joints are those at the start of the bones. `Retarget` explains turns. Raises HobbleError if a bone of
    a leg has no length.
    """
    target_rest, source_rest = rest_positions(target), rest_positions(source)
    out = {}
    for side in SIDES:
        for start, end in LIMB_BONES.items():
            roles = f"{side}_{start}", f"{side}_{end}"
            if not all(role in s.roles for role in roles for s in (source, target)):
                continue
            follower, leader = target.role(roles[0]), source.role(roles[0])
            bone = target_rest[target.role(roles[1])] - target_rest[follower]
            source_bone = source_rest[source.role(roles[1])] - source_rest[leader]
            for skeleton, vector in ((source, source_bone), (target, bone)):
                if start in ("hip", "knee") and np.linalg.norm(vector) < 1e-6:
                    joints = " to ".join(skeleton.roles[role] for role in roles)
                    raise HobbleError(f"the bone from {joints} of {skeleton.name} has no length")
            turn = quat.between(
                quat.rotate(target_to_upright, bone), quat.rotate(quat.inv(upright_to_source), source_bone)
            )
            out[follower, leader] = quat.mul(upright_to_source, quat.mul(turn, target_to_upright))
    return out


def _hip_heights(skeleton: Skeleton, to_upright: Array) -> Array:
    """(2,) cm, heights of both hip joints above the balls of the feet if the legs are straight.

    to_upright: (4,) rotation that makes the rest pose stand along Y and face +Z.
    """
    y = quat.rotate(to_upright, rest_positions(skeleton))[:, 1]
    ankles = [y[skeleton.role(f"{s}_heel")] - y[skeleton.role(f"{s}_toe")] for s in SIDES]
    return np.array(ankles) + leg_lengths(skeleton)


def _drivers(target: Skeleton, joints: Array) -> tuple[Array, Array]:
    """`drivers` and `driver_offsets` of a Retarget. The driver of a joint above the hips is the hips."""
    rest, hips = rest_positions(target), target.role("hips")
    drivers = np.full(len(target.joints), hips)
    driver_offsets = np.zeros((len(target.joints), 3))
    for j, p in enumerate(target.parents):
        above = drivers[p] if p >= 0 else hips
        drivers[j] = j if j in joints else above
        driver_offsets[j] = rest[j] - rest[above]
    return drivers, driver_offsets


def retarget_clip(clip: Clip, how: Retarget) -> Clip:
    """The clip's motion on the target skeleton. how: what `plan` returns for the two skeletons."""
    rotations = np.empty((len(clip), len(how.target.joints), 4))  # only those of `how.joints` are set
    rotations[:, how.joints] = quat.mul(clip.global_rotations[:, how.follows], how.turns)
    how = _with_measured_lifts(how, clip, rotations)
    how = _with_level_pelvis(how, clip, rotations)
    for side in SIDES:
        heel, toe = (clip.positions[:, how.source.role(f"{side}_{part}")] for part in ("heel", "toe"))
        ankle, ball = how.target.role(f"{side}_heel"), how.target.role(f"{side}_toe")
        foot = quat.rotate(rotations[:, ankle], how.driver_offsets[ball])
        tilt = steady_heels(foot, heel * how.scale, toe * how.scale, clip.fps)
        rotations[:, ankle] = quat.mul(tilt, rotations[:, ankle])
    hips = _bend_legs(how, clip, rotations)
    root = hips + quat.rotate(rotations[:, how.target.role("hips")], how.driver_offsets[0])
    local = quat.continuous(local_rotations(how.target, rotations[:, how.drivers]))
    return Clip(clip.name, how.target, clip.fps, local, root)


def _with_measured_lifts(how: Retarget, clip: Clip, rotations: Array) -> Retarget:
    """The plan with `lifts` corrected, so that nearly straight legs bend on average as in the clip.

    rotations: (F, J, 4) of the target's joints in the world.
    """
    hips, lifts = _hips_position(how, clip.positions, rotations), how.lifts.copy()
    for k, side in enumerate(SIDES):
        too_high, weight = _Leg(how, clip.positions, rotations, hips, side).excess()
        if weight.any():
            order = np.argsort(too_high)
            passed = np.cumsum(weight[order])
            lifts[k] -= too_high[order][np.searchsorted(passed, 0.5 * passed[-1])]  # the weighted median
    return replace(how, lifts=lifts)


def _standing_height(ball: Array) -> float:
    """Height of the ball of a foot while it stands, cm. ball: (F, 3) its positions."""
    slow = np.linalg.norm(np.gradient(ball, axis=0), axis=-1) if len(ball) > 1 else np.zeros(len(ball))
    return float(np.median(ball[slow <= np.quantile(slow, 0.25), 1]))


def _swing(ball: Array, fps: float) -> Array:
    """(F,) how much a foot swings, from 0 to 1. ball: (F, 3) positions of its ball."""
    speed = np.zeros(len(ball))
    if len(ball) > 1:
        speed = np.linalg.norm(np.gradient(gaussian(ball, SMOOTH * fps), axis=0), axis=-1) * fps
    return smoothstep((speed - SWING[0]) / (SWING[1] - SWING[0]))


def _with_level_pelvis(how: Retarget, clip: Clip, rotations: Array) -> Retarget:
    """The plan with `lifts` that let the feet stand equally high; the pelvis is turned by the difference.

    If the figure's legs are not equally long, its pelvis leans to the shorter leg while its feet are level.
    Legs of equal length then have level feet only with a level pelvis. So the pelvis is turned until the feet
    are level, but it does not lean to the other side by more than LEVEL.

    rotations: (F, J, 4) of the target's joints in the world, of which those of the pelvis are changed.
    """
    at = clip.at_roles()
    heights = [_standing_height(at[f"{side}_toe"] * how.scale) for side in SIDES]
    if abs(heights[0] - heights[1]) > UNEVEN:
        return how
    left = at["left_hip"] - at["right_hip"]
    lean = float(np.mean(np.arcsin(np.clip(unit(left)[:, 1], -1.0, 1.0))))
    rest, role = rest_positions(how.target), how.target.role
    width = float(np.linalg.norm(rest[role("left_hip")] - rest[role("right_hip")]))
    needed = np.arcsin(np.clip((how.lifts[0] - how.lifts[1] - heights[0] + heights[1]) / width, -0.3, 0.3))
    sign = np.sign(needed)
    turn = sign * np.clip(LEVEL - sign * lean, 0.0, abs(needed))
    parents, hips = how.target.parents, role("hips")
    tops = [parents[role(f"{side}_hip")] for side in SIDES]
    pelvis = sorted({j for top in tops for j in path_between(parents, hips, top)})
    ahead = unit(np.cross(left, UP))
    by = quat.normalize(quat.from_axis_angle(ahead, np.full(len(ahead), turn)))
    rotations[:, pelvis] = quat.mul(by[:, None], rotations[:, pelvis])
    return replace(how, lifts=how.lifts - 0.5 * width * np.sin(turn) * np.array([1.0, -1.0]))


def _bend_legs(how: Retarget, clip: Clip, rotations: Array) -> Array:
    """Turn thighs and shanks so that the balls of the feet are where they are in the scaled source.

    rotations: (F, J, 4) of the target's joints in the world, which are changed. Returns the positions (F, 3)
    of the hips, which come down where a leg would be too straight.
    """
    hips = _hips_position(how, clip.positions, rotations)
    legs = [_Leg(how, clip.positions, rotations, hips, side) for side in SIDES]
    too_high = [np.maximum(excess, 0.0) * weight for excess, weight in (leg.excess(SPARED) for leg in legs)]
    drop = smooth_above(np.maximum(*too_high), max(1, round(SMOOTH * clip.fps)))[:, None] * UP
    for leg, side in zip(legs, SIDES, strict=True):
        ball = clip.positions[:, how.source.role(f"{side}_toe")] * how.scale
        above_ground = ball[:, 1] - lowest(ball[:, 1], 2 * round(0.25 * clip.fps) + 1)
        leg.bend(leg.start - drop, _swing(ball, clip.fps), above_ground)
    return hips - drop


def _hips_position(how: Retarget, source: Array, rotations: Array) -> Array:
    """(F, 3) position of the target's hips before they come down.

    It puts the middle between the target's hip joints where it is in the scaled source, raised by the mean of
    `how.lifts`.
    The hips joint itself is not compared, because skeletons have it at different places in the pelvis.
    """
    middle = 0.5 * sum(source[:, how.source.role(f"{side}_hip")] for side in SIDES)
    to_middle = quat.rotate(rotations[:, how.target.role("hips")], how.pelvis)
    return middle * how.scale + np.array([0.0, np.mean(how.lifts), 0.0]) - to_middle


class _Leg:
    """A leg of the target, from its hip to the position that the foot must reach.

    source: (F, J, 3) positions of the source's joints. rotations: (F, J, 4) of the target's joints; the
    method `bend` changes the rotations of thigh and shank. hips: (F, 3) position of the target's hips.
    Attributes start, ankle: (F, 3) where the leg begins, and where its ankle must be so that the ball of
    the foot is where the scaled source has it. stretch: (F,) distance from hip to ankle in the source, as a
    share of the leg's length.
    """

    def __init__(self, how: Retarget, source: Array, rotations: Array, hips: Array, side: str) -> None:
        roles = [f"{side}_{part}" for part in ("hip", "knee", "heel", "toe")]
        self.hip, self.knee, heel, ball = (how.target.role(role) for role in roles)
        self.forward, self.rotations = how.forward, rotations
        self.thigh, self.shank = how.driver_offsets[self.knee], how.driver_offsets[heel]
        self.start, joint = hips, self.hip
        while joint != how.target.role("hips"):
            above = how.drivers[how.target.parents[joint]]
            self.start = self.start + quat.rotate(rotations[:, above], how.driver_offsets[joint])
            joint = above
        toe = source[:, how.source.role(roles[3])] * how.scale
        toe = toe + (np.mean(how.lifts) - how.lifts[SIDES.index(side)]) * UP
        self.ankle = toe - quat.rotate(rotations[:, heel], how.driver_offsets[ball])
        hip_at, knee_at, heel_at = (source[:, how.source.role(role)] for role in roles[:3])
        length = np.linalg.norm(knee_at - hip_at, axis=-1) + np.linalg.norm(heel_at - knee_at, axis=-1)
        self.stretch = np.linalg.norm(heel_at - hip_at, axis=-1) / length
        self.knee_bend = angles_between(knee_at - hip_at, heel_at - knee_at)

    def excess(self, spared: float = 0.0) -> tuple[Array, Array]:
        """(F,) cm by which the hips are too high for the leg to bend as in the source, and a weight.

        spared: radians by which the knee may bend less than in the source. The weight is from 0 for a bent
        leg, which changes little with the height of the hips, to 1.
        """
        reach = self._reach(np.maximum(self.knee_bend - spared, 0.0))
        from_ankle = self.start - self.ankle
        # At the right height, the hip is at the distance `reach` from the ankle (Pythagoras).
        level_squared = np.minimum(from_ankle[:, 0] ** 2 + from_ankle[:, 2] ** 2, reach**2)
        excess = from_ankle[:, 1] - np.sqrt(reach**2 - level_squared)
        straightness = np.clip((self.stretch - BENT) / (NEARLY_STRAIGHT - BENT), 0.0, 1.0)
        return np.clip(excess, -MOST_DROP, MOST_DROP), smoothstep(straightness)

    def _reach(self, bend: Array) -> Array:
        """(F,) distance from hip to ankle while the knee is bent by so many radians."""
        thigh, shank = np.linalg.norm(self.thigh), np.linalg.norm(self.shank)
        return np.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * np.cos(bend))

    def bend(self, start: Array, swing: Array, height: Array) -> None:
        """Turn thigh and shank so that the ankle reaches its position. The foot keeps its rotation.

        While the foot stands, the ball stays where it is in the source, and a foot of another size bends the
        knee by some degrees more or less. In a swing, the knee bends as in the source, and the ball may be
        elsewhere, but not below half its height.

        start: (F, 3) where the leg begins after the hips came down. swing: (F,) how much the foot swings, 0
        to 1. height: (F,) how high its ball is above the ground, cm.
        """
        line = self.ankle - start
        distance = np.linalg.norm(line, axis=-1)
        down = np.maximum(-line[:, 1] / np.maximum(distance, 1e-9), 0.1)
        shift = np.minimum(swing * (self._reach(self.knee_bend) - distance), 0.5 * height / down)
        ankle = self.ankle + unit(line) * shift[..., None]
        upper, lower = self.rotations[:, self.hip], self.rotations[:, self.knee]
        thigh = quat.rotate(upper, self.thigh)
        pole = bend_direction(np.zeros(3), thigh, thigh + quat.rotate(lower, self.shank))
        straight = np.maximum(STRAIGHT - np.linalg.norm(pole, axis=-1), 0.0)[:, None]
        pole = pole + straight * quat.rotate(upper, self.forward)
        lengths = float(np.linalg.norm(self.thigh)), float(np.linalg.norm(self.shank))
        knee_at, ankle_at = two_bone_knee(start, ankle, pole, *lengths)
        self.rotations[:, self.hip] = aim_bone(upper, self.thigh, knee_at - start)
        self.rotations[:, self.knee] = aim_bone(lower, self.shank, ankle_at - knee_at)


# Checks that retargeting kept the motion.
#
# It compares the joint angles, limbs and feet of the source clip with those of the result. A role, such as
# left_knee, names a part of the body. Each skeleton tells which of its joints has which role.


# Degrees: a result is refused if one of its joints or limbs differs by more than this on average.
MOST_DIFFERENCE = 15.0
# Joint -> three roles, without "left_" or "right_". The joint's angle is the one between the bone from the
# first to the second and the bone from the second to the third: 0 if these bones are in line.
ANGLES = {
    "knee": ("hip", "knee", "heel"),
    "elbow": ("shoulder", "elbow", "wrist"),
    "hip": ("head", "hip", "knee"),
    "ankle": ("knee", "heel", "toe"),
}
BONES = {  # limb -> roles of its two ends, without the side
    "thigh": ("hip", "knee"),
    "shank": ("knee", "heel"),
    "upper arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
}
# In the same pose, bodies of different shapes have different angles at these joints. So the median difference
# is subtracted before these angles are compared.
SHAPE_DEPENDENT = ("hip", "ankle")
# Degrees: the report tells of a joint whose median difference is larger.
NOTED_CONSTANTS = {"knee": 5.0, "elbow": 5.0, "hip": 10.0, "ankle": 45.0}
# A clip is refused if the mean cosine of the angle between where a bent knee points and where the body faces
# is less than this. In 172 clips of the data sets `cmu`, `styles` and `patients`, of Ferre et al. and of
# Holden et al. (2017), it is 0.57 or more.
KNEE_AHEAD = 0.25
KNEE_BACKWARD = -0.3  # the limit if the user has set the handedness, which then may be wrong
BENT_KNEE = 20.0  # degrees: a knee that bends less does not show where it points
# Cosine of the angle between a thigh and the body's down. Who sits, kneels or squats lifts a thigh further
# and may point the knee aside.
LIFTED_THIGH = 0.5


def compare_motions(source: Clip, result: Clip) -> dict[str, Any]:
    """How much the result of retargeting differs from its source, frame by frame, in degrees.

    Returns a dictionary with two keys. angles: joint, such as "left knee" -> dictionary. `constant` is the
    median difference of the joint's angle. For joints in SHAPE_DEPENDENT it is subtracted before `apart`, the
    mean absolute difference, is computed. directions: limb, such as "left thigh" -> mean angle between its
    directions in source and result.
    """
    before, after = ({role: at[: len(result)] for role, at in c.at_roles().items()} for c in (source, result))
    angles, directions = {}, {}
    for side in SIDES:
        for name, parts in ANGLES.items():
            more = _bend(after, side, parts) - _bend(before, side, parts)
            constant = float(np.median(more))
            apart = np.abs(more - (constant if name in SHAPE_DEPENDENT else 0.0)).mean()
            angles[f"{side} {name}"] = {"constant": round(constant, 2), "apart": round(float(apart), 2)}
        for name, ends in BONES.items():
            start, end = (f"{side}_{part}" for part in ends)
            apart = degrees_between(*(at[end] - at[start] for at in (before, after)))
            directions[f"{side} {name}"] = round(float(apart.mean()), 2)
    return {"angles": angles, "directions": directions}


def difference_problems(path: Path, differences: dict[str, Any], rig: str) -> list[Problem]:
    """What is wrong with a result that does not move like its source: first the worst joint or limb.

    path: the source's file. differences: what `compare_motions` returns. rig: name of the source's rig.
    """
    name, degrees = most_different(differences)
    out = []
    if degrees > MOST_DIFFERENCE:
        seen = f"the {name} is {degrees:.0f} degrees off its source on average (rig: {rig})"
        draw = f"`hobble look {path} --picture apart.svg` draws both"
        draft = f"`hobble rig {path}` drafts a file for config/skeletons/, in which to correct the roles"
        out.append(Problem(seen, f"{draw}. {draft}."))
    for joint, angle in differences["angles"].items():
        if abs(angle["constant"]) > NOTED_CONSTANTS[joint.partition(" ")[2]]:
            more = "more" if angle["constant"] > 0 else "less"
            degrees = abs(angle["constant"])
            out.append(Problem(f"the {joint} bends {degrees:.0f} degrees {more} than in the file"))
    return out


def knee_problem(clip: Clip, handedness: str) -> Problem | None:
    """A knee that, while it is bent, does not point forward.

    The mean cosine of the angle between where the knee points and where the body faces is less than
    KNEE_AHEAD, or KNEE_BACKWARD if the option `handedness` is not "auto".
    A frame counts by how much further than BENT_KNEE the knee bends, since a nearly straight leg hardly shows
    where its knee points, and not at all if the thigh is lifted. A knee of which less than a tenth of the
    frames count is not judged.
    """
    at, least = clip.at_roles(), KNEE_AHEAD if handedness == "auto" else KNEE_BACKWARD
    # The body's left times its up gives its forward.
    up = unit(at["head"] - at["hips"])
    ahead = unit(np.cross(at["left_hip"] - at["right_hip"], up))
    for side in SIDES:
        bends = _bend(at, side, ANGLES["knee"])
        hip, knee, heel = (at[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
        lifted = np.sum(unit(hip - knee) * up, axis=-1) < LIFTED_THIGH
        weight = np.where(lifted, 0.0, np.maximum(bends - BENT_KNEE, 0.0))
        points = unit(bend_direction(hip, knee, heel))
        cosine = np.sum(points * ahead, axis=-1) @ weight / max(weight.sum(), 1e-9)
        if np.mean(weight > 0) >= 0.1 and cosine < least:
            bent = f"bent (by up to {bends.max():.0f} degrees, at {bends.argmax() / clip.fps:.1f} s)"
            away = f"points {np.degrees(np.arccos(cosine)):.0f} degrees away from forward while it is {bent}"
            why = "declared in another order than they were written, or in the other handedness"
            seen = f"the {side} knee {away}, so the rotation channels may be {why}"
            return Problem(seen, "Export the clip again.")
    return None


def most_different(differences: dict[str, Any]) -> tuple[str, float]:
    """The joint or limb that differs most, and by how many degrees on average.

    differences: what `compare_motions` returns.
    """
    apart = {name: each["apart"] for name, each in differences["angles"].items()} | differences["directions"]
    name = max(apart, key=lambda part: apart[part])
    return name, apart[name]


def _bend(at: dict[str, Array], side: str, parts: tuple[str, ...]) -> Array:
    """(F,) degrees between the two bones that connect three joints: 0 if the bones are in line.

    at: role -> (F, 3) positions. parts: the joints' roles without the side.
    """
    a, b, c = (at[part] if part == "head" else at[f"{side}_{part}"] for part in parts)
    return degrees_between(b - a, c - b)
