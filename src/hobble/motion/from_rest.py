"""Derives how the joints of a body are turned, from a zero pose in which a person could stand.

For some joints this pose is more reliable than the motion.
"""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import RAISED, feet_tilt, flat_moments, runs, upright_while_flat
from hobble.motion.orient import (
    degrees_between,
    degrees_between_rotations,
    frame,
    pointed_along,
    snapped_to_axes,
    unit,
)

UP = np.array([0.0, 1.0, 0.0])
# Degrees. If zero pose and motion differ by more than this for a joint, the motion is used.
TRUSTED = 30.0
# Radians. If the angle of standing feet differs from that in the zero pose by more, this is reported. In the
# data set `patients` the difference is at most 9 degrees.
UNLIKE_ZERO = np.radians(12.0)
# cm between the 5th and 95th percentile of the heights of feet that stand flat. Above this, the
# ground is uneven and the angle of the feet tells nothing about the rig. On flat ground the value is up to 3,
# in CMU's walks on uneven ground 9 to 18.
UNEVEN = 6.0
SHRUG = 12.0  # degrees: if the mean angle of a clavicle to the chest is smaller, it is turned like the chest
TRUSTED_HAND = 60.0  # degrees: if zero pose and motion differ by less for a hand, the zero pose is used


def from_rest(sample: BodySample) -> dict[int, Array]:
    """Joint -> (4,) frame, from a zero pose in which a person could stand.

    The frame of a joint is the rotation from the axes of a standing figure to the joint's own axes
    (`BodySample` in `hobble.motion.body_sample` explains it). Limbs are turned by the directions of their
    bones in the zero pose.
    """
    body, rest = sample.body, sample.rest
    across = [
        rest[limbs["left"][k]] - rest[limbs["right"][k]] for limbs, k in ((body.legs, 0), (body.arms, 1))
    ]
    left = unit(unit(across[0]) + unit(across[1]))
    middle = [
        0.5 * (rest[limbs["left"][k]] + rest[limbs["right"][k]])
        for limbs, k in ((body.legs, 0), (body.arms, 1))
    ]
    upward = rest[body.head] - rest[body.hips]
    whole = snapped_to_axes(
        frame(upward if upward @ (middle[1] - middle[0]) > 0 else middle[1] - middle[0], UP, left, LEFT)
    )
    frames = dict.fromkeys((body.hips, *body.trunk, *body.neck, body.head), whole)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        clavicle, shoulder, elbow, wrist = body.arms[side]
        if clavicle is not None:
            frames[clavicle] = whole
        for start, end in ((shoulder, elbow), (elbow, wrist)):
            frames[start] = pointed_along(whole, sign * LEFT, sample.bone(start, end))
        frames[wrist] = sample.hand(side, frames[elbow], sign)
        hip, knee, heel, toe = body.legs[side]
        for start, end in ((hip, knee), (knee, heel)):
            frames[start] = pointed_along(whole, -UP, sample.bone(start, end))
        frames[heel] = whole
        if toe is not None:
            frames[toe] = whole
    return frames


def add_rest(frames: dict[int, Array], zero: dict[int, Array], sample: BodySample) -> None:
    """Replace in `frames` the joints for which the zero pose is more reliable. zero: from `from_rest`."""
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
        frames[heel] = _foot(frames[heel], zero[heel], sample, side)
        if toe is not None:
            frames[toe] = _foot(frames[toe], zero[toe], sample, side)


def zero_doubt(sample: BodySample, zero: dict[int, Array]) -> str | None:
    """A sentence if the feet stand at another angle than in the zero pose; None if they agree.

    The angles may differ because the figure stands on its toes or leans in the zero pose. On uneven ground,
    feet stand at any angle, so the result is None. zero: from `from_rest`.
    """
    measured = feet_tilt(sample).measured
    difference, lengths, heights = [], [], []
    for side in SIDES:
        heel, toe = sample.body.legs[side][2:]
        if toe is not None and (tilt := measured[side]) is not None and upright_while_flat(sample, side):
            x, y, z = quat.rotate(quat.inv(zero[heel]), sample.bone(heel, toe))
            difference.append(tilt - (RAISED if runs(sample) else 0.0) - np.arctan2(-y, np.hypot(x, z)))
            lengths.append(sample.length(heel, toe))
            heights.append(sample.at[flat_moments(sample, side), toe, 1])
    if not difference or np.ptp(np.percentile(np.concatenate(heights), [5, 95])) > UNEVEN:
        return None
    if abs(np.mean(difference)) < UNLIKE_ZERO:
        return None
    degrees, more = (
        np.degrees(abs(np.mean(difference))),
        "steeper" if np.mean(difference) > 0 else "flatter",
    )
    sentence = f"Its feet stand {degrees:.0f} degrees {more} than in its zero pose"
    if degrees > TRUSTED:
        return f"{sentence}: the motion was believed, so feet may be tilted by some degrees."
    high = np.radians(degrees) * np.mean(lengths)
    return f"{sentence}: if they are not flat in that pose, the figure stands {high:.1f} cm too high or low."


def _foot(standing: Array, zero: Array, sample: BodySample, side: str) -> Array:
    """(4,) the frame of an ankle or toe joint: `standing`, but as steep as `zero` if both roughly agree.

    standing: the frame found in motion. zero: the frame in the zero pose. `zero` is returned unchanged if the
    body is not upright while the foot is flat, or if the foot has no toe joint and both frames roughly agree.
    In other cases only the steepness is taken from it, because in a zero pose with splayed legs the feet are
    rolled and point outward.
    """
    if not upright_while_flat(sample, side):
        return zero
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return zero if degrees_between_rotations(standing, zero) < TRUSTED else standing
    bone = sample.bone(heel, toe)
    if degrees_between_rotations(standing, zero) > TRUSTED + 60:
        return standing
    zero_bone, standing_bone = (quat.rotate(quat.inv(frame), bone) for frame in (zero, standing))
    if degrees_between(zero_bone, standing_bone) > TRUSTED:
        return standing
    across, level = standing_bone[0], float(np.hypot(zero_bone[0], zero_bone[2]))
    zero_bone = np.array([across, zero_bone[1], np.sqrt(max(level**2 - across**2, 0.0))])
    return quat.mul(standing, quat.between(zero_bone, standing_bone))
