"""Gives a rig's motion an upright rest pose, without changing the positions of joints.

The meaning of a joint's rotations depends on the zero pose, in which all of them are zero. If a person could
stand in the zero pose, it becomes the rest pose. In other rigs, all bones of the zero pose lie along one axis
or in a twisted heap. Then the directions of the bones in motion show how each joint is turned when its bone
points down a leg, out along an arm or up the trunk. Knees and elbows show the front of a limb. Standing feet
show which direction of a foot is level.

The result is a frame for each joint: the constant rotation (4,) from the axes of a figure in a T-pose (facing
+Z, with its arms out sideways) to the joint's own axes. `hobble.motion.body_sample` explains frames.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations, path_to_root
from hobble.motion.axes import AHEAD, LEFT, UP, aligned, degrees_between, pointed_along, snapped, unit
from hobble.motion.body import SIDES, Body, across, middle
from hobble.motion.body_sample import RAISED, SHORT, BodySample, outward, spine_shares

# Largest angles, in degrees, by which parts of a standing person differ from a direction. Legs are compared
# with down, trunk and head with up, and feet with straight ahead. Up is the direction from the hips to the
# shoulders.
LEG, TRUNK, HEAD, FOOT = 40.0, 40.0, 50.0, 50.0
# A leg is stretched if the distance from hip to ankle is more than this share of the leg's length. An upright
# figure has at least one stretched leg.
STRETCHED = 0.8
UPRIGHT_LEAN = 25.0  # degrees: the trunk of an upright figure leans less than this
FEWEST_UPRIGHT = 0.05  # least share of the moments that must be upright
# Degrees: the moments are chosen that lean less than this plus the 5 % quantile (FEWEST_UPRIGHT) of the lean.
SPREAD = 15.0
KINK = 0.06  # leg lengths: a bone above the chest that is shorter does not show how the chest is turned
AGREE = 25.0  # degrees: joints of trunk and neck count as turned like the chest if they differ by less
# Degrees. If the frame of a joint from the zero pose differs from the frame from the motion by more than
# this, the frame from the motion is used. For hands, the limit is TRUSTED_HAND.
TRUSTED, TRUSTED_HAND = 30.0, 60.0
SHRUG = 12.0  # degrees: if a clavicle's frame differs from the chest's by less, it gets the chest's frame
# Radians by which the first bone of a person's neck leans forward. NECK: from the vertical, in a standing
# zero pose. NECK_OF_HEAD: from the line that goes from chest to head. Both are means over seven subjects of
# CMU, with standard deviations of 2.6 and 3.9 degrees.
NECK, NECK_OF_HEAD = np.radians(5.4), np.radians(5.6)
# BALL: offset from an ankle to the ball of its foot, as a share of the length of thigh plus shank, for a foot
# that stands and points to +Z. TOES_OUT: radians by which feet point outward. Both are means over seven
# subjects of the CMU database. The standard deviations are .006 (height) and .010 (length) for BALL, and 2
# degrees for TOES_OUT.
BALL, TOES_OUT = np.array([0.0, -0.034, 0.136]), np.radians(5.0)
# cm: if the offset of a joint from its parent changes by more than this during the clip, the new clip stores
# the offsets of every frame.
MOVES = 0.1
# Degrees. If standing feet are steeper or flatter than in the zero pose by this or more, this is reported. In
# the data set `patients` the difference is at most 9 degrees.
UNLIKE_ZERO = 12.0
APART = 10.0  # degrees: a larger difference between the two standing feet is reported
NOTED = 1.0  # cm: an uncertainty of the height (two standard deviations) above this is reported

Frames = dict[int, Array]  # joint -> (4,)


@dataclass(frozen=True)
class UprightMotion:
    """A clip with a standing rest pose that faces +Z with the arms out.

    clip: has the joints of the body, and the further joints that `with_upright_rest` was told to keep. body:
    which joint is which part of the body. doubts: sentences on what is uncertain. height_error: cm (two
    standard deviations) by which the figure may stand too high or too low.
    """

    clip: Clip = field(repr=False)
    body: Body
    doubts: list[str]
    height_error: float


def with_upright_rest(
    clip: Clip, body: Body, target: Skeleton, others: Collection[int] = ()
) -> UprightMotion:
    """The same motion on a rig that stands upright in its rest pose.

    clip: in centimetres, right-handed, Y up. body: the joints of the clip that are parts of a body. target:
    the skeleton to which the clip will be retargeted. others: further joints to keep, unless they are below
    no joint of the body. In the rest pose, they are turned like the body part that they are on.

    Trunk, limbs and feet are turned by the directions of their bones, so that the same motion gives the same
    result on any rig. No bone shows how head, clavicles and hands are turned. A zero pose in which a person
    could stand shows it.
    """
    sample = BodySample.of(clip, replace(body, arms_on_neck=_arms_on_neck(clip, body)), target)
    zero = None
    if why_not_standing(body, sample.zero_positions) is None:
        zero = _frames_from_zero_pose(sample)
        zero = None if _is_trunk_twisted(sample, zero) else zero
    trunk = _upright_moments(sample, zero is not None)
    frames = _frames_from_motion(sample, trunk, zero)
    if zero:
        _use_zero_pose(frames, zero, sample)
    further = _add_further_joints(frames, clip, sample, others)
    new_clip, new_body = _with_rest_pose(clip, sample, trunk, frames, further)
    height_error = 0.0 if zero else _height_error(sample)
    doubts = _feet_doubts(sample, zero, height_error)
    return UprightMotion(new_clip, new_body, doubts, height_error)


def why_not_standing(body: Body, rest: Array) -> str | None:
    """Why a person could not stand in a rest pose, in words; None if a person could.

    body: which joint is which part. rest: (J, 3) positions of the joints in the rest pose, cm. The
    coordinates may be left-handed.
    """
    shoulders = middle(rest, body.arms, 1)
    up = unit(shoulders - middle(rest, body.legs, 0))
    left = across(rest, body.legs, 0)
    if degrees_between(left, across(rest, body.arms, 1)) > 30 or abs(degrees_between(left, up) - 90) > 25:
        return "hips and shoulders point in different directions"
    if degrees_between(rest[body.head] - shoulders, up) > HEAD:
        return "the head is not above the shoulders"
    ahead = np.cross(unit(left), up)  # straight back in left-handed coordinates
    forward = []  # for each foot, how far it reaches along `ahead`
    for side in SIDES:
        hip, knee, heel, toe = body.legs[side]
        if max(degrees_between(rest[b] - rest[a], -up) for a, b in ((hip, knee), (knee, heel))) > LEG:
            return f"the {side} leg does not point down"
        if toe is not None:
            foot = rest[toe] - rest[heel]
            flat = foot - up * (foot @ up)
            forward.append(flat @ ahead)
            # A foot may point along `ahead` or against it, but not sideways, and not steeply up or down.
            sideways = abs(degrees_between(flat, ahead) - 90) < 90 - FOOT
            if sideways or np.linalg.norm(flat) < 0.4 * np.linalg.norm(foot):
                return f"the {side} foot does not point forward"
    if forward and min(forward) < 0 < max(forward):
        return "the feet point in opposite directions"
    for a, b in pairwise((body.hips, *body.trunk)):
        if np.linalg.norm(rest[b] - rest[a]) > SHORT and degrees_between(rest[b] - rest[a], up) > TRUNK:
            return "the trunk is not straight"
    return None


def _arms_on_neck(clip: Clip, body: Body) -> bool:
    """Whether the arms hang from the first joint of the neck, and this joint lies below the shoulders."""
    parents, p = clip.skeleton.parents, clip.positions
    if not body.neck or any(body.neck[0] not in path_to_root(parents, arm[1]) for arm in body.arms.values()):
        return False
    to_shoulders = middle(p, body.arms, 1) - p[:, body.neck[0]]
    return bool(np.median(np.sum(to_shoulders * (p[:, body.head] - p[:, body.hips]), axis=-1)) > 0)


def _is_trunk_twisted(sample: BodySample, zero: Frames) -> bool:
    """Whether bones of the trunk are turned about their own length in the zero pose.

    The positions of the joints do not show this. But the zero pose and the motion then disagree on which
    direction of a joint is the left. zero: the frames according to the zero pose.
    """
    in_motion = _trunk_frames(_upright_moments(sample, False), zero)
    joints = (sample.body.hips, *sample.body.trunk)
    lefts = ([quat.rotate(frames[j], LEFT) for j in joints] for frames in (zero, in_motion))
    return bool(degrees_between(*map(np.array, lefts)).max() > TRUSTED)


# The trunk in motion


def _upright_moments(sample: BodySample, stands_in_zero: bool) -> BodySample:
    """The most upright moments of a sample. They show how the pelvis is turned against the spine.

    The spine is about straight in upright poses. In a bow or a squat it bends. If such a bent spine were
    taken for straight, the pelvis would come out tilted. If too few moments are upright, the result is the
    zero pose if a person could stand in it, and otherwise the whole sample.
    """
    leans = _leans(sample)
    if np.mean(leans < UPRIGHT_LEAN) >= FEWEST_UPRIGHT:
        return sample.at_moments(leans < np.quantile(leans, FEWEST_UPRIGHT) + SPREAD)
    return sample.in_zero_pose() if stands_in_zero else sample


def _leans(sample: BodySample) -> Array:
    """(S,) degrees between the trunk and the vertical; 180 in moments in which no leg is stretched."""
    body, p = sample.body, sample.positions
    leans = degrees_between(middle(p, body.arms, 1) - middle(p, body.legs, 0), UP)
    stretch = [
        np.linalg.norm(p[:, ankle] - p[:, hip], axis=-1) / max(sample.length(hip, knee, ankle), 1e-9)
        for hip, knee, ankle, _ in body.legs.values()
    ]
    return np.where(np.max(stretch, axis=0) > STRETCHED, leans, 180.0)


def _trunk_frames(sample: BodySample, zero: Frames | None) -> Frames:
    """The frames of hips, trunk, neck and head. sample: moments that show how these joints are turned."""
    body, frames = sample.body, Frames()
    for joint in body.spine[:-1]:
        bone, axis, left = _trunk_bone(sample, joint)
        if body.trunk and joint == body.chest and _lacks_neck(sample):
            bone, axis = _assumed_neck(sample, left, zero), sample.target.neck_direction
        # `aligned` fits its first direction exactly and its second one as nearly as possible. For
        # hips and chest, the direction to the left is more reliable than the bone: hips and shoulders are
        # level, but spines of captured rigs bend sideways by some degrees.
        if joint in (body.hips, body.chest):
            frames[joint] = aligned(left, LEFT, bone, axis)
        else:
            frames[joint] = aligned(bone, axis, left, LEFT)
    chest = frames[body.chest]
    if len(frames) > 2 and max(_apart(frame, chest) for frame in frames.values()) < AGREE:
        frames[body.head] = chest
    else:  # the head is assumed to look ahead on average
        ahead = unit(np.cross(sample.chest_left + sample.hips_left, UP) * [1, 0, 1])
        upward = np.broadcast_to(UP, ahead.shape)
        up, ahead = (sample.mean_in_joint_axes(body.head, v) for v in (upward, ahead))
        frames[body.head] = aligned(up, UP, ahead, AHEAD)
    return frames


def _trunk_bone(sample: BodySample, joint: int) -> tuple[Array, Array, Array]:
    """Measure the bone above a joint of trunk or neck. Returns three vectors (3,).

    They are: the bone, in the joint's coordinates; the direction of this bone in a figure that stands facing
    +Z; and the direction to the body's left, in the joint's coordinates.
    """
    body, target = sample.body, sample.target
    lengths = np.array([sample.length(a, b) for a, b in pairwise(body.spine)])
    # Joint -> its position along the body: 0 at the hips, 1 at the chest, 2 at the head.
    share = dict(zip(body.spine, spine_shares(lengths, body.trunk_bones), strict=True))
    following = body.spine[body.spine.index(joint) + 1 :]
    # A chain of many short bones is not straight. If one bone of the target is as long as several bones of
    # the rig, the direction is measured from the start of the first of these bones to the end of the last.
    within_bone = [j for j in following if share[j] <= target.bone_end(share[joint]) + 1e-6]
    # The chest is stiff up to the shoulders. A very short bone above it does not show how it is turned.
    least = max(SHORT, KINK * sample.length(*body.legs["left"][:3])) if joint == body.chest else SHORT
    bones = [(sample.bone(joint, end), end) for end in (*within_bone[-1:], *following)]
    bone, end = next((found for found in bones if np.linalg.norm(found[0]) > least), bones[-1])
    left = sample.chest_left
    if joint == body.hips:
        left = sample.hips_left
    elif joint in body.trunk and joint != body.chest:
        left = unit(sample.hips_left + sample.chest_left)
    return bone, target.direction(share[joint], share[end]), sample.mean_in_joint_axes(joint, left)


def _lacks_neck(sample: BodySample) -> bool:
    """Whether a neck must be assumed: the rig has none, but the target has one.

    A joint at the same place as the chest is no neck.
    """
    chest, neck = sample.body.chest, sample.body.neck
    return sample.target.has_neck and all(sample.length(chest, joint) <= SHORT for joint in neck)


def _assumed_neck(sample: BodySample, left: Array, zero: Frames | None) -> Array:
    """(3,) direction of a neck that leans as far as people's necks do on average, in the chest's coordinates.

    left: (3,) direction to the body's left, in the chest's coordinates.
    """
    chest = sample.body.chest
    if zero:
        return quat.rotate(zero[chest], np.array([0.0, np.cos(NECK), np.sin(NECK)]))
    head = unit(sample.bone(chest, sample.body.head))
    return quat.rotate(quat.from_axis_angle(unit(left), NECK_OF_HEAD), head)


# Frames of all joints


def _frames_from_motion(sample: BodySample, trunk: BodySample, zero: Frames | None) -> Frames:
    """The frames of all joints of the body, from the directions of their bones in motion.

    trunk: those moments of the sample that show how the trunk is turned. zero: the frames according to the
    zero pose, or None if nobody could stand in it. They are needed for rigs without a neck.
    """
    body, frames = sample.body, _trunk_frames(trunk, zero)
    chest = quat.mul(sample.rotations[:, body.chest], frames[body.chest])
    for side in SIDES:
        clavicle, *arm = body.arms[side]
        if clavicle is not None:
            frames[clavicle] = sample.mean_frame(clavicle, chest)
        # The elbow of an arm in the T-pose bends forward, the knee of a leg about the left.
        out = outward(side)
        frames |= _limb_frames(sample, arm, out, -sample.chest_left, -out[0] * UP)
        frames |= _limb_frames(sample, body.legs[side][:3], -UP, sample.hips_left, LEFT)
        _, elbow, wrist = arm
        forearm = quat.mul(sample.rotations[:, elbow], frames[elbow])
        frames[wrist] = sample.hand_frame(side, sample.mean_frame(wrist, forearm))
    return frames | sample.foot_frames()


def _limb_frames(sample: BodySample, limb: Sequence[int], along: Array, usual: Array, hinge: Array) -> Frames:
    """The frames of the first two of a limb's three joints.

    along: (3,) where the limb points in the T-pose. hinge: (3,) the axis about which it bends there. usual:
    (S, 3) that axis in the world, for a limb that hardly bends.
    """
    axes = sample.hinge_axes(limb, usual)
    return {
        start: aligned(sample.bone(start, end), along, sample.mean_in_joint_axes(start, axes), hinge)
        for start, end in pairwise(limb)
    }


def _frames_from_zero_pose(sample: BodySample) -> Frames:
    """The frames of all joints according to the zero pose, in which a person must be able to stand.

    In the zero pose, the axes of all joints are parallel. So trunk, neck, head, clavicles and feet have the
    same frame. Arms and legs may point in other directions than in the T-pose. Their bones in the zero pose
    show how they are turned.
    """
    body, rest = sample.body, sample.zero_positions
    left = unit(unit(across(rest, body.legs, 0)) + unit(across(rest, body.arms, 1)))
    trunk, upward = middle(rest, body.arms, 1) - middle(rest, body.legs, 0), rest[body.head] - rest[body.hips]
    common = snapped(aligned(upward if upward @ trunk > 0 else trunk, UP, left, LEFT))
    frames = dict.fromkeys(body.joints, common)
    for side in SIDES:
        _, *arm = body.arms[side]
        for limb, along in ((arm, outward(side)), (body.legs[side][:3], -UP)):
            for start, end in pairwise(limb):
                frames[start] = pointed_along(common, along, sample.bone(start, end))
        frames[arm[2]] = sample.hand_frame(side, frames[arm[1]])
    return frames


def _use_zero_pose(frames: Frames, zero: Frames, sample: BodySample) -> None:
    """Replace the frames of head, clavicles, hands and feet where the zero pose is more reliable.

    frames: from the motion. This argument is changed. zero: according to the zero pose.
    """
    body = sample.body
    limits = {body.head: TRUSTED, **{arm[3]: TRUSTED_HAND for arm in body.arms.values()}}
    for joint, limit in limits.items():
        if _apart(zero[joint], frames[joint]) < limit:
            frames[joint] = zero[joint]
    for side in SIDES:
        clavicle = body.arms[side][0]
        if clavicle is not None and _apart(frames[body.chest], frames[clavicle]) < SHRUG:
            frames[clavicle] = frames[body.chest]
        for joint in body.legs[side][2:]:
            if joint is not None:
                frames[joint] = _foot_frame(frames[joint], zero[joint], sample, side)


def _foot_frame(standing: Array, zero: Array, sample: BodySample, side: str) -> Array:
    """(4,) the frame of an ankle or toe joint.

    standing: its frame from the motion. zero: its frame from the zero pose.

    If the body is not upright while the foot is flat, `zero` is returned. Otherwise, if the two frames differ
    too much, `standing` is returned. If they roughly agree, a foot without a toe joint gets `zero`. A foot
    with a toe joint gets `standing`, made as steep as `zero`. Only the steepness is taken from the zero pose,
    because in a zero pose with splayed legs the feet are rolled and point outward.
    """
    if not sample.is_upright_while_flat(side):
        return zero
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return zero if _apart(standing, zero) < TRUSTED else standing
    zero_bone, standing_bone = (quat.rotate(quat.inv(f), sample.bone(heel, toe)) for f in (zero, standing))
    # The foot may also be rolled or point outward in the zero pose, hence the extra 60 degrees.
    if _apart(standing, zero) > TRUSTED + 60 or degrees_between(zero_bone, standing_bone) > TRUSTED:
        return standing
    # Keep the height of `zero_bone` and its length, but let it point as far outward as `standing_bone`.
    out, level = standing_bone[0], float(np.hypot(zero_bone[0], zero_bone[2]))
    zero_bone = np.array([out, zero_bone[1], np.sqrt(max(level**2 - out**2, 0.0))])
    return quat.mul(standing, quat.between(zero_bone, standing_bone))


def _apart(a: Array, b: Array) -> float:
    """Angle in degrees between two rotations (4,)."""
    return float(np.degrees(quat.angle(a, b)))


def _add_further_joints(frames: Frames, clip: Clip, sample: BodySample, others: Collection[int]) -> list[int]:
    """Add the frames of further joints, and return those that are below a joint of the body.

    Each joint gets the mean rotation of the body part that it is on. The base of a finger points along the
    finger.
    """
    body, parents, added = sample.body, clip.skeleton.parents, []
    hands = {arm[3]: side for side, arm in body.arms.items()}
    for joint in sorted(set(others) - set(body.joints)):
        carrier = next((j for j in path_to_root(parents, joint)[1:] if j in body.joints), None)
        if carrier is None:
            continue
        added.append(joint)
        frames[joint] = sample.mean_frame(joint, quat.mul(sample.rotations[:, carrier], frames[carrier]))
        if carrier in hands:
            bones = (sample.bone(joint, j) for j in others if joint in path_to_root(parents, j)[1:])
            bone = next((bone for bone in bones if np.linalg.norm(bone) > SHORT), None)
            if bone is not None:
                frames[joint] = pointed_along(frames[joint], outward(hands[carrier]), bone)
    return added


# The new rest pose


def _with_rest_pose(
    clip: Clip, sample: BodySample, trunk: BodySample, frames: Frames, further: list[int]
) -> tuple[Clip, Body]:
    """The same motion with the joints of the body and `further` ones, and a new rest pose; and the new body.

    In the new rest pose the figure stands facing +Z with its arms out sideways, and all rotations are zero.
    Balls of the feet that the rig lacks are put where people have them. Hips and chest get a second joint
    (see `_bends`). trunk: moments that show how the trunk is turned. frames: of all joints; those of ankles
    above new balls are turned outward.
    """
    body, names = sample.body, list(clip.skeleton.joints)
    world = clip.global_rotations
    turned, places = Frames(), {j: clip.positions[:, j] for j in (*body.joints, *further)}

    def add(joint: int, word: str, place: Array, rotations: Array) -> int:
        names.append(f"{clip.skeleton.joints[joint]}_{word}")
        new = len(names) - 1
        places[new], turned[new] = place, rotations
        return new

    legs = dict(body.legs)
    for side, (hip, knee, heel, toe) in body.legs.items():
        if toe is None:
            frames[heel] = quat.mul(frames[heel], quat.yaw(outward(side)[0] * TOES_OUT))
            offset = quat.rotate(frames[heel], BALL * _length(clip.positions[:, [hip, knee, heel]]))
            place = places[heel] + quat.rotate(world[:, heel], offset)
            legs[side] = (hip, knee, heel, add(heel, "ball", place, quat.mul(world[:, heel], frames[heel])))
    body = replace(body, legs=legs)
    roles = body.roles(names)
    for joint, rotations in _bends(clip, trunk).items():
        bend = add(joint, "bend", places[joint], rotations)
        if joint == body.chest:
            body = replace(body, neck=(bend, *body.neck))
        else:
            body = replace(body, trunk=(bend, *body.trunk))
    joints = [*body.joints, *further]
    # How far each body part has turned, in the world, from the new rest pose.
    turned |= {j: quat.mul(world[:, j], frames[j]) for j in joints if j not in turned}
    for side, finger in body.fingers.items():
        wrist = body.arms[side][3]
        turned[wrist] = _pointed(turned[wrist], outward(side), clip.positions[:, finger] - places[wrist])
    new = {old: i for i, old in enumerate(joints)}  # old index of a joint -> new index
    above = {b: a for chain in body.chains for a, b in pairwise(chain)}
    for joint in further:
        path = path_to_root(clip.skeleton.parents, joint)[1:]
        above[joint] = next((j for j in path if j in above), body.hips)
    parents, offsets = (-1, *(new[above[j]] for j in joints[1:])), np.zeros((len(joints), 3))
    skeleton = Skeleton(clip.skeleton.name, tuple(names[j] for j in joints), parents, offsets, roles)
    rotations, positions = (np.stack([of[j] for j in joints], axis=1) for of in (turned, places))
    return _clip_from_world(clip, skeleton, rotations, positions), body.renumbered(new)


def _bends(clip: Clip, sample: BodySample) -> Frames:
    """Joint (hips or chest) -> (F, 4) how far the bone above it has turned from the new rest pose.

    In many rigs, one joint at the hips carries both legs and the spine, and one joint at the chest carries
    both arms and the neck. The rotation of this joint is taken to be that of the limbs, but the bone above it
    may point in another direction. So a second joint is added at the same place, which follows the bone. The
    spine of the target can then follow the second joint. It turns only if the bone's end moves relative to
    the first joint. Joints whose bone is shorter than SHORT are left out.
    """
    body, out = sample.body, Frames()
    above_chest = () if body.arms_on_neck else (*body.neck, body.head)
    for joint, following in ((body.hips, body.trunk), (body.chest, above_chest)):
        if not following or sample.length(joint, following[0]) <= SHORT:
            continue
        direction, axis, left = _trunk_bone(sample, joint)
        bone, rotations = sample.bone(joint, following[0]), clip.global_rotations[:, joint]
        if clip.translations is not None:
            to_end = clip.positions[:, following[0]] - clip.positions[:, joint]
            bones = quat.rotate(quat.inv(rotations), to_end)
            # The direction of a bone that is shorter than half of its mean is not reliable.
            long = np.linalg.norm(bones, axis=-1, keepdims=True) > 0.5 * np.linalg.norm(bone)
            mean = np.broadcast_to(bone, bones.shape)
            rotations = quat.mul(rotations, quat.between(mean, np.where(long, bones, mean)))
        out[joint] = quat.mul(rotations, aligned(direction, axis, left, LEFT))
    return out


def _length(positions: Array) -> float:
    """Length of a chain of joints, cm: the sum of the median lengths of its bones. positions: (F, N, 3)."""
    return float(np.median(np.linalg.norm(np.diff(positions, axis=1), axis=-1), axis=0).sum())


def _pointed(turned: Array, axis: Array, to_finger: Array) -> Array:
    """Rotations (F, 4) of a hand, changed so that `axis` points along `to_finger` (F, 3) in every frame."""
    pointing = quat.rotate(turned, axis)
    has_length = np.linalg.norm(to_finger, axis=-1, keepdims=True) > 1e-6
    return quat.mul(quat.between(pointing, np.where(has_length, to_finger, pointing)), turned)


def _clip_from_world(clip: Clip, skeleton: Skeleton, rotations: Array, positions: Array) -> Clip:
    """A clip on a new skeleton, whose offsets are measured. rotations, positions: of all joints, world."""
    parents = list(skeleton.parents)
    from_parent = quat.rotate(quat.inv(rotations[:, parents]), positions - positions[:, parents])
    from_parent[:, 0] = 0.0  # the hips have no parent
    offsets = np.median(from_parent, axis=0)
    translations = from_parent if np.abs(from_parent - offsets).max() > MOVES else None
    local = quat.continuous(local_rotations(skeleton, rotations))
    return Clip(clip.name, replace(skeleton, offsets=offsets), clip.fps, local, positions[:, 0], translations)


# What is uncertain, in sentences


def _height_error(sample: BodySample) -> float:
    """Centimetres (two standard deviations) by which the figure may stand too high or low.

    0 if the rig lacks a joint for the ball of a foot.
    """
    feet = [leg[2:] for leg in sample.body.legs.values()]
    if any(toe is None for _, toe in feet):
        return 0.0
    return float(2 * np.mean([sample.length(*foot) for foot in feet]) * sample.feet_tilt.error)


def _feet_doubts(sample: BodySample, zero: Frames | None, height_error: float) -> list[str]:
    """Sentences on what is uncertain about how the feet stand. zero: the frames of the zero pose."""
    tilts = sample.feet_tilt.measured
    if len(tilts) < len(SIDES):
        added = "The rig has no joints for the balls of the feet. They were added where people have them"
        further = "" if zero else ", and toes and ankles may lie some centimetres off"
        return [f"{added}, so the figure may stand 3 cm too high or low{further}."]
    if zero:
        raised = RAISED if sample.figure_runs else 0.0  # a runner's foot is steeper than flat
        feet = {side: sample.body.legs[side][2:] for side in SIDES if sample.is_upright_while_flat(side)}
        bones = {s: quat.rotate(quat.inv(zero[a]), sample.bone(a, b)) for s, (a, b) in feet.items()}
        steeper = [tilts[side] - raised + np.arctan2(y, np.hypot(x, z)) for side, (x, y, z) in bones.items()]
        degrees = float(np.degrees(np.mean(steeper))) if steeper else 0.0
        if abs(degrees) < UNLIKE_ZERO:
            return []
        high = np.radians(abs(degrees)) * np.mean([sample.length(*foot) for foot in feet.values()])
        unlike = f"{abs(degrees):.0f} degrees {'steeper' if degrees > 0 else 'flatter'} than in its zero pose"
        return [f"Its feet stand {unlike}, so the figure may stand {high:.1f} cm too high or low."]
    if height_error < NOTED:
        return []
    one, other = np.degrees(list(tilts.values()))
    apart = f" and its feet stand at {one:.0f} and {other:.0f} degrees" if abs(one - other) > APART else ""
    why = f"because nobody could stand in the zero pose (all rotations zero) of its file{apart}"
    result = f"It was estimated, so the figure may stand {height_error:.1f} cm too high or low"
    return [f"The height of the ankles is uncertain, {why}. {result}."]
