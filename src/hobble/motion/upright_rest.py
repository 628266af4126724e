"""Gives a rig's motion an upright rest pose, without changing the positions of joints.

The meaning of a joint's rotations depends on the zero pose, in which all of them are zero. If a person could
stand in the zero pose, it becomes the rest pose. In other rigs, all bones of the zero pose lie along one axis
or in a twisted heap. Then the directions of the bones in motion show how each joint is turned when its bone
points down a leg, out along an arm or up the trunk. Knees and elbows show the front of a limb. Standing feet
show which direction of a foot is level.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.added_joints import with_balls, with_split_joints
from hobble.motion.body import Body, body_by_roles
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import feet_doubt, height_error
from hobble.motion.from_motion import find_bends, frames_from_motion, trunk_frames
from hobble.motion.from_rest import TRUSTED, frames_from_rest, use_zero_pose, zero_doubt
from hobble.motion.no_neck import lean_doubt
from hobble.motion.orient import degrees_between, mean_rotation, rotation_pointing_along
from hobble.motion.rebase import with_new_rest_pose
from hobble.motion.spine import SHORT
from hobble.motion.standing import why_not_standing
from hobble.motion.target_build import TargetProportions
from hobble.motion.tree import path_to_root
from hobble.motion.trunk_sample import stoop_doubt, trunk_sample

SAMPLES = 400  # at most this many frames of the clip are measured


@dataclass(frozen=True)
class UprightMotion:
    """A clip with a standing rest pose that faces +Z with the arms out.

    clip: has the joints of the body, and the further joints that `with_upright_rest` was told to keep. body:
    which joint is which part of the body. rest_source: where the rest pose comes from, in words. doubts:
    sentences on what is uncertain. height_error: cm by which the figure may stand too high or too low.
    """

    clip: Clip = field(repr=False)
    body: Body
    rest_source: str
    doubts: list[str] = field(default_factory=list)
    height_error: float = 0.0


def with_upright_rest(
    clip: Clip, body: Body, target: Skeleton, others: Collection[int] = ()
) -> UprightMotion:
    """The same motion on a rig that stands upright in its rest pose.

    clip: in centimetres, right-handed, Y up. body: the joints of the clip that are parts of a body. target:
    the skeleton to which the clip will be retargeted. others: further joints to keep. In the rest pose, they
    are turned like the body part that they are on.

    Trunk, limbs and feet are turned by the directions of their bones, so that the same motion gives the same
    result on any rig. No bone shows how head, clavicles and hands are turned. A zero pose in which a person
    could stand shows it.
    """
    body = replace(body, arms_on_neck=_arms_on_neck(clip, body))
    sampled = np.unique(np.linspace(0, len(clip) - 1, SAMPLES).round().astype(int))
    ends = {
        side: clip.skeleton.end_sites.get(clip.skeleton.joints[leg[2]]) for side, leg in body.legs.items()
    }
    speeds = _speeds(clip)[sampled]
    rest = rest_positions(clip.skeleton)
    sample = BodySample(
        body,
        clip.positions[sampled],
        clip.global_rotations[sampled],
        speeds,
        rest,
        ends,
        TargetProportions.from_skeleton(target, body_by_roles(target)),
        len(clip) / clip.fps,
    )
    # Two dicts, joint -> (4,) rotation of its axes in the rest pose. `zero` is what the zero pose shows, None
    # if nobody could stand in it. `axes` is the result.
    problem = why_not_standing(body, rest)
    zero = frames_from_rest(sample) if problem is None else None
    if zero and _is_trunk_twisted(sample, zero):
        problem, zero = "the trunk is twisted", None
    trunk = trunk_sample(sample, zero is not None)
    axes = frames_from_motion(sample, trunk, zero[body.chest] if zero else None)
    doubts = [lean_doubt(sample, zero is not None), stoop_doubt(sample, zero is not None)]
    if zero:
        use_zero_pose(axes, zero, sample)
        doubts.append(zero_doubt(sample, zero))
    rest_source = "its zero pose" if problem is None else f"its motion, because in its zero pose {problem}"
    doubts.append(feet_doubt(sample, problem is None))
    kept = _add_further_joints(axes, clip, sample, others)
    clip, body = with_balls(clip, body, axes)
    roles = body.roles(clip.skeleton.joints)
    clip, body = with_split_joints(clip, body, axes, find_bends(trunk))
    clip, body = with_new_rest_pose(clip, body, [*body.joints, *kept], axes, roles)
    return UprightMotion(
        clip,
        body,
        rest_source,
        [doubt for doubt in doubts if doubt],
        height_error(sample, problem is None),
    )


def _arms_on_neck(clip: Clip, body: Body) -> bool:
    """Whether the arms hang from the first joint of the neck, and this joint lies below the shoulders."""
    shoulders = [arm[1] for arm in body.arms.values()]
    parents, p = clip.skeleton.parents, clip.positions
    if not body.neck or any(body.neck[0] not in path_to_root(parents, joint) for joint in shoulders):
        return False
    to_shoulders = np.mean([p[:, joint] for joint in shoulders], axis=0) - p[:, body.neck[0]]
    return bool(np.median(np.sum(to_shoulders * (p[:, body.head] - p[:, body.hips]), axis=-1)) > 0)


def _is_trunk_twisted(sample: BodySample, zero: dict[int, Array]) -> bool:
    """Whether bones of the trunk are turned about their own length in the zero pose.

    The positions of the joints do not show this. But the zero pose and the motion then disagree on which
    direction of a joint is the left. zero: joint -> (4,) rotation of its axes, if the zero
    pose is taken as the rest pose.
    """
    in_motion = trunk_frames(trunk_sample(sample, False), zero[sample.body.chest])
    joints = (sample.body.hips, *sample.body.trunk)
    left_of_both = [[quat.rotate(axes[j], LEFT) for axes in (zero, in_motion)] for j in joints]
    return max(degrees_between(*pair) for pair in left_of_both) > TRUSTED


def _speeds(clip: Clip) -> Array:
    """(F, J) speeds of the joints, cm a second."""
    if len(clip) < 2:
        return np.zeros(clip.positions.shape[:2])
    return np.linalg.norm(np.gradient(clip.positions, axis=0), axis=-1) * clip.fps


def _add_further_joints(
    axes: dict[int, Array], clip: Clip, sample: BodySample, others: Collection[int]
) -> list[int]:
    """Add to `axes` the rotations of further joints in the rest pose. Returns the joints that were added.

    others: the further joints. Those that are below no joint of the body are left out. Each joint gets the
    mean rotation of the body part that it is on. The base of a finger points along the finger.
    """
    body, parents = sample.body, clip.skeleton.parents
    added = []
    for joint in sorted(set(others) - set(body.joints)):
        carrier = next((j for j in path_to_root(parents, joint)[1:] if j in body.joints), None)
        if carrier is None:
            continue
        part = quat.mul(sample.rotations[:, carrier], axes[carrier])
        axes[joint] = mean_rotation(quat.mul(quat.inv(sample.rotations[:, joint]), part))
        for side, sign in (("left", 1.0), ("right", -1.0)):
            tips = [j for j in others if joint in path_to_root(parents, j)[1:]]
            bones = [bone for j in tips if np.linalg.norm(bone := sample.bone(joint, j)) > SHORT]
            if carrier == body.arms[side][3] and bones:
                axes[joint] = rotation_pointing_along(axes[joint], sign * LEFT, bones[0])
        added.append(joint)
    return added
