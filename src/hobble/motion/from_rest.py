"""Derives how the joints of a body are turned from a standing zero pose.

For some joints it is more reliable than motion.
"""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import RAISED, feet_tilt, flat_frames, runs, upright_while_flat
from hobble.motion.orient import (
    degrees_between,
    degrees_between_rotations,
    frame,
    pointed_along,
    snapped_to_axes,
    unit,
)

UP = np.array([0.0, 1.0, 0.0])
# Degrees. If zero pose and motion differ by more for a joint, the motion is used.
TRUSTED = 30.0
# A larger difference between the angle of standing feet and that in the zero pose is reported. In the data
# set `patients` it is at most 9 degrees.
UNLIKE_ZERO = np.radians(12.0)
# cm between the 5th and 95th percentile of the heights of feet that stand flat. With more, the ground is
# uneven and the angle of the feet shows nothing of the rig. On flat ground it is up to 3, in CMU's walks on
# uneven ground 9 to 18.
UNEVEN = 6.0
SHRUG = 12.0  # degrees; a clavicle whose mean angle to the chest is smaller is turned like the chest
LIMP = 60.0  # degrees; if zero pose and motion differ by less for a hand, the zero pose is used


def from_rest(sample: BodySample) -> dict[int, Array]:
    """Joint -> (4,) rotation of its axes, from a zero pose in which a person could stand.

    Limbs are turned by the directions of their bones in the zero pose.
    """
    body, rest = sample.body, sample.rest
    across = [rest[side["left"][k]] - rest[side["right"][k]] for side, k in ((body.legs, 0), (body.arms, 1))]
    left = unit(unit(across[0]) + unit(across[1]))
    middle = [
        0.5 * (rest[side["left"][k]] + rest[side["right"][k]]) for side, k in ((body.legs, 0), (body.arms, 1))
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
    """Replace in `frames` the joints for which the zero pose is more reliable."""
    body = sample.body
    if degrees_between_rotations(zero[body.head], frames[body.head]) < TRUSTED:
        frames[body.head] = zero[body.head]
    for side in SIDES:
        clavicle, _, _, wrist = body.arms[side]
        if clavicle is not None and degrees_between_rotations(frames[body.chest], frames[clavicle]) < SHRUG:
            frames[clavicle] = frames[body.chest]
        if degrees_between_rotations(zero[wrist], frames[wrist]) < LIMP:
            frames[wrist] = zero[wrist]
        heel, toe = body.legs[side][2:]
        frames[heel] = _foot(frames[heel], zero[heel], sample, side)
        if toe is not None:
            frames[toe] = _foot(frames[toe], zero[toe], sample, side)


def zero_doubt(sample: BodySample, zero: dict[int, Array]) -> str | None:
    """A sentence if the feet stand at another angle than in the zero pose; None if they agree.

    zero: from `from_rest`. In the zero pose a person may stand on the toes or lean. On uneven ground, where
    feet stand at any angle, nothing is said.
    """
    measured = feet_tilt(sample).measured
    difference, lengths, heights = [], [], []
    for side in SIDES:
        heel, toe = sample.body.legs[side][2:]
        if toe is not None and (tilt := measured[side]) is not None and upright_while_flat(sample, side):
            x, y, z = quat.rotate(quat.inv(zero[heel]), sample.bone(heel, toe))
            difference.append(tilt - (RAISED if runs(sample) else 0.0) - np.arctan2(-y, np.hypot(x, z)))
            lengths.append(sample.length(heel, toe))
            heights.append(sample.at[flat_frames(sample, side), toe, 1])
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
    return f"{sentence}: if that pose is no stance, the figure stands {high:.1f} cm too high or low."


def _foot(standing: Array, zero: Array, sample: BodySample, side: str) -> Array:
    """(4,) the rotation of a foot: as it stands, but as steep as in the zero pose if both roughly agree.

    It is not taken from the zero pose alone: if the legs are splayed there, the feet are rolled and point
    outward. It is taken from the zero pose if the foot never stands flat, as some patients' feet.
    """
    if not upright_while_flat(sample, side):
        return zero
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return zero if degrees_between_rotations(standing, zero) < TRUSTED else standing
    bone = sample.bone(heel, toe)
    if degrees_between_rotations(standing, zero) > TRUSTED + 60:
        return standing
    wanted, found = (quat.rotate(quat.inv(frame), bone) for frame in (zero, standing))
    if degrees_between(wanted, found) > TRUSTED:
        return standing
    across, level = found[0], float(np.hypot(wanted[0], wanted[2]))
    wanted = np.array([across, wanted[1], np.sqrt(max(level**2 - across**2, 0.0))])
    return quat.mul(standing, quat.between(wanted, found))
