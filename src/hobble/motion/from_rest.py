"""Finds how a rig's joints are turned on its body, from a zero pose in which a person could stand.

In the zero pose, all rotations of the file are zero. For some joints it is more reliable than the motion.

The result is a frame for each joint: the rotation (4,) from the axes of a figure in a T-pose to the joint's
own axes. In the T-pose, the figure faces +Z, with its arms out sideways. The frame of a joint is the same at
all times. It has nothing to do with the frames of a clip.
"""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import RAISED, feet_tilt, figure_runs, flat_moments, upright_while_flat
from hobble.motion.orient import (
    degrees_between,
    degrees_between_rotations,
    rotation_aligning,
    rotation_pointing_along,
    snapped_to_axes,
    unit_vectors,
)

UP = np.array([0.0, 1.0, 0.0])
# Degrees. If the frame of a joint from the zero pose differs from the frame from the motion by more than
# this, the frame from the motion is used. For hands, the limit is TRUSTED_HAND.
TRUSTED, TRUSTED_HAND = 30.0, 60.0
# Radians. If standing feet are steeper or flatter than in the zero pose by this or more, this is reported. In
# the data set `patients` the difference is at most 9 degrees.
UNLIKE_ZERO = np.radians(12.0)
# cm between the 5th and 95th percentile of the heights of feet that stand flat. Above this, the ground is
# uneven, and how steep the feet are tells nothing about the rig. On flat ground the value is up to 3, in
# CMU's walks on uneven ground 9 to 18.
UNEVEN = 6.0
SHRUG = 12.0  # degrees: if a clavicle's frame differs from the chest's by less, it gets the chest's frame


def frames_from_rest(sample: BodySample) -> dict[int, Array]:
    """Joint -> its frame (4,) according to the zero pose, in which a person must be able to stand.

    In the zero pose, the axes of all joints are parallel. So trunk, neck, head, clavicles and feet have the
    same frame. Arms and legs may point in other directions than in the T-pose. Their bones in the zero pose
    show how they are turned.
    """
    body, rest = sample.body, sample.zero_positions
    # A Body lists hip, knee, heel and toe of a leg, and clavicle, shoulder, elbow and wrist of an arm.
    across = [
        rest[limbs["left"][k]] - rest[limbs["right"][k]] for limbs, k in ((body.legs, 0), (body.arms, 1))
    ]
    left = unit_vectors(unit_vectors(across[0]) + unit_vectors(across[1]))
    hips_middle, shoulders_middle = [
        0.5 * (rest[limbs["left"][k]] + rest[limbs["right"][k]])
        for limbs, k in ((body.legs, 0), (body.arms, 1))
    ]
    trunk = shoulders_middle - hips_middle
    upward = rest[body.head] - rest[body.hips]
    common_frame = snapped_to_axes(rotation_aligning(upward if upward @ trunk > 0 else trunk, UP, left, LEFT))
    frames = dict.fromkeys((body.hips, *body.trunk, *body.neck, body.head), common_frame)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        clavicle, shoulder, elbow, wrist = body.arms[side]
        if clavicle is not None:
            frames[clavicle] = common_frame
        for start, end in ((shoulder, elbow), (elbow, wrist)):
            frames[start] = rotation_pointing_along(common_frame, sign * LEFT, sample.bone(start, end))
        frames[wrist] = sample.hand_frame(side, frames[elbow], sign)
        hip, knee, heel, toe = body.legs[side]
        for start, end in ((hip, knee), (knee, heel)):
            frames[start] = rotation_pointing_along(common_frame, -UP, sample.bone(start, end))
        frames[heel] = common_frame
        if toe is not None:
            frames[toe] = common_frame
    return frames


def use_zero_pose(frames: dict[int, Array], zero: dict[int, Array], sample: BodySample) -> None:
    """Replace the frames of head, clavicles, hands and feet where the zero pose is more reliable.

    frames: joint -> (4,), from the motion. This argument is changed. zero: the result of `frames_from_rest`.
    """
    body = sample.body
    if degrees_between_rotations(zero[body.head], frames[body.head]) < TRUSTED:
        frames[body.head] = zero[body.head]
    for side in SIDES:
        clavicle, _, _, wrist = body.arms[side]
        if clavicle is not None and degrees_between_rotations(frames[body.chest], frames[clavicle]) < SHRUG:
            frames[clavicle] = frames[body.chest]
        if degrees_between_rotations(zero[wrist], frames[wrist]) < TRUSTED_HAND:
            frames[wrist] = zero[wrist]
        heel, toe = body.legs[side][2:]
        frames[heel] = _foot_frame(frames[heel], zero[heel], sample, side)
        if toe is not None:
            frames[toe] = _foot_frame(frames[toe], zero[toe], sample, side)


def zero_doubt(sample: BodySample, zero: dict[int, Array]) -> str | None:
    """A warning if standing feet are steeper or flatter in the motion than in the zero pose, else None.

    They may differ because the figure stands on its toes or leans in the zero pose. On uneven ground, feet
    stand at any angle, so there is no warning. zero: the result of `frames_from_rest`.
    """
    measured = feet_tilt(sample).measured
    differences, lengths, heights = [], [], []
    for side in SIDES:
        heel, toe = sample.body.legs[side][2:]
        if toe is not None and (tilt := measured[side]) is not None and upright_while_flat(sample, side):
            x, y, z = quat.rotate(quat.inv(zero[heel]), sample.bone(heel, toe))
            # Radians by which a foot points further down while it stands than in the zero pose. A runner's
            # foot is steeper than flat by RAISED.
            differences.append(
                tilt - (RAISED if figure_runs(sample) else 0.0) - np.arctan2(-y, np.hypot(x, z))
            )
            lengths.append(sample.length(heel, toe))
            heights.append(sample.positions[flat_moments(sample, side), toe, 1])
    if not differences or np.ptp(np.percentile(np.concatenate(heights), [5, 95])) > UNEVEN:
        return None
    if abs(np.mean(differences)) < UNLIKE_ZERO:
        return None
    degrees = np.degrees(abs(np.mean(differences)))
    compared = "steeper" if np.mean(differences) > 0 else "flatter"
    sentence = f"Its feet stand {degrees:.0f} degrees {compared} in the motion than in its zero pose"
    if degrees > TRUSTED:
        return f"{sentence}. The angle in the motion was used, so feet may be tilted by some degrees."
    high = np.radians(degrees) * np.mean(lengths)
    return (
        f"{sentence}. If they are not flat in the zero pose, the figure stands {high:.1f} cm too high or low."
    )


def _foot_frame(standing: Array, zero: Array, sample: BodySample, side: str) -> Array:
    """(4,) the frame of an ankle or toe joint.

    standing: its frame from the motion. zero: its frame from the zero pose.

    If the body is not upright while the foot is flat, `zero` is returned. Otherwise, if the two frames differ
    too much, `standing` is returned. If they roughly agree, a foot without a toe joint gets `zero`. A foot
    with a toe joint gets `standing`, made as steep as `zero`. Only the steepness is taken from the zero pose,
    because in a zero pose with splayed legs the feet are rolled and point outward.
    """
    if not upright_while_flat(sample, side):
        return zero
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return zero if degrees_between_rotations(standing, zero) < TRUSTED else standing
    bone = sample.bone(heel, toe)
    # The foot may also be rolled or point outward in the zero pose, hence the extra 60 degrees.
    if degrees_between_rotations(standing, zero) > TRUSTED + 60:
        return standing
    zero_bone, standing_bone = (quat.rotate(quat.inv(frame), bone) for frame in (zero, standing))
    if degrees_between(zero_bone, standing_bone) > TRUSTED:
        return standing
    # Keep the height of `zero_bone` and its length, but let it point as far outward as `standing_bone`.
    across, level = standing_bone[0], float(np.hypot(zero_bone[0], zero_bone[2]))
    zero_bone = np.array([across, zero_bone[1], np.sqrt(max(level**2 - across**2, 0.0))])
    return quat.mul(standing, quat.between(zero_bone, standing_bone))
