"""Finds how feet are turned when they stand flat, and how certain that is.

The ball of a standing foot is low and slow. While the foot stands, its heel comes down and goes up again, so
the foot is flat when it is least steep. The moments in which a foot lands on its heel are an exception: it is
even less steep then. A runner's heel never comes all the way down. The tilt of a foot is the angle by which
the bone from the ankle to the ball points down. The tilt measured in the motion is compared with the tilt in
the zero pose (all rotations zero) and with the tilt of the target's feet. The target is the skeleton to which
the clip will be retargeted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import BodySample
from hobble.motion.orient import degrees_between, mean_rotation, unit_vectors
from hobble.motion.spine import SHORT
from hobble.motion.target_build import limb_bones

# The axes of a figure that faces +Z.
UP, AHEAD, LEFT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
STANCE = 0.2  # a foot counts as standing in this share of the frames: those with the lowest and slowest ball
# Percentiles of a standing foot's tilt. The foot counts as flat in the frames between them; below the lower
# one it lands on its heel.
LEAST_STEEP = (10.0, 30.0)
FEWEST = 3  # least number of frames in which a foot is flat
SLOW = 0.5  # leg lengths a second: the ball of a standing foot is slower than this
# A figure runs if the balls of its feet are slow in less than this share of the frames. In CMU's walks the
# share is at least 0.41.
RUNS = 0.3
# Radians by which a runner's standing foot is steeper than flat. In 19 clips of running from CMU, the feet
# are 4.0 to 9.2 degrees steeper than in their zero poses, 6.8 on average. In 50 clips of walking the mean is
# 0.7.
RAISED = np.radians(6.8)
UNLIKE = np.radians(2.5)  # the tilt of each foot may differ from the mean of both by at most this
UPRIGHT = 0.6  # least height of an upright body's hips above a standing foot, in leg lengths
# Feet that were animated or cleaned stand at exactly one angle: the 10th and 50th percentile of their angles
# differ by less than EXACT (in most clips of the data set `styles` by 0.00 degrees). Over the whole clip,
# their angles differ by more than TILTS. For captured feet the percentiles differ by at least 0.1 degrees.
EXACT, TILTS = np.radians(0.02), np.radians(10.0)
# Standard deviation (radians) of the tilt of feet that stand at one angle, or whose tilt the zero pose shows.
EXACT_ERROR = np.radians(0.5)
# Standard deviation (radians) of the difference in tilt between a captured foot that stands and the same foot
# in the rig's zero pose. It is 3 degrees over seven subjects of CMU. Differences between clips add a little.
CAPTURED_ERROR = np.radians(3.5)
# Radians. The feet of a rig are built either like those of people in the CMU database or in any way. In the
# first case their mean tilt in the zero pose is PERSON, with the standard deviation PERSON_DEVIATION. (On
# seven subjects 15.0 and 2.0 degrees were measured.) In the second case, all tilts in a range as wide as
# ANY_FOOT are equally likely.
PERSON, PERSON_DEVIATION, ANY_FOOT = np.radians(15.0), np.radians(2.5), np.radians(42.0)
# In a clip shorter than BRIEF seconds, the feet may never stand. The standard deviation of their tilt is then
# BRIEF_ERROR radians: clips of a third of a second or less were 10 to 15 degrees off.
BRIEF, BRIEF_ERROR = 0.5, np.radians(12.0)
APART = 10.0  # degrees: a larger difference between the two standing feet is reported
# Radians. Even a zero pose in which nobody could stand shows the tilt of the feet, if the tilts of its feet
# differ from each other and from those in motion by less than AGREE. If the motion is on tiptoe, the feet of
# the zero pose must differ from each other by less than SAME.
AGREE, SAME = np.radians(10.0), np.radians(2.0)
TIPTOE = np.radians(12.0)  # a squatting body is on tiptoe if its feet are this much steeper than the target's
# Degrees. If a foot points further than FORWARD away from where its knee points in the zero pose, its tilt in
# that pose does not count. A knee that bends by less than STRAIGHT is not compared, because it may point
# anywhere.
FORWARD, STRAIGHT = 35.0, 30.0
NOTED = 1.0  # cm: an uncertainty of the height (two standard deviations) above this is reported


@dataclass(frozen=True)
class Tilt:
    """The tilt of each foot when it stands flat, in radians.

    measured: side -> tilt in the frames in which the foot is flat. flat: side -> tilt that is taken as
    correct. Both are None for a foot without a ball. error: standard deviation of the mean of both feet's
    `flat`.
    """

    measured: dict[str, float | None]
    flat: dict[str, float | None]
    error: float


def frames_of_feet(sample: BodySample) -> dict[int, Array]:
    """Joint (ankle or ball) -> its frame (4,), found from how the joint is turned while the foot is flat.

    The frame of a joint (not a moment of the clip) is the rotation from the axes of a figure that faces +Z to
    the joint's own axes (see `BodySample` in `hobble.motion.body_sample`).
    """
    tilt = feet_tilt(sample)
    frames: dict[int, Array] = {}
    for side in SIDES:
        measured, correct = tilt.measured[side], tilt.flat[side]
        steeper_by = 0.0 if measured is None or correct is None else correct - measured
        correction = quat.from_axis_angle(LEFT, np.array(steeper_by))
        flat = flat_moments(sample, side)
        # The rotations from a figure that faces +Z to one that faces where the foot points.
        heading = quat.between(AHEAD, unit_vectors(_ahead(sample, side)[flat] * [1, 0, 1]))
        for joint in sample.body.legs[side][2:]:
            if joint is not None:
                as_measured = mean_rotation(quat.mul(quat.inv(sample.rotations[flat, joint]), heading))
                frames[joint] = quat.mul(as_measured, quat.inv(correction))
    return frames


@lru_cache(maxsize=1)
def feet_tilt(sample: BodySample) -> Tilt:
    """The tilt of flat feet: from the zero pose if this shows it, else from frames in which feet stand."""
    by_side = {side: _measured_tilt(sample, side) for side in SIDES}
    measured_tilts = [tilt for tilt in by_side.values() if tilt is not None]
    if not measured_tilts:  # no foot has a ball
        return Tilt(by_side, by_side, 0.0)
    zero = {side: _zero_tilt(sample, side) for side in SIDES}
    zero_tilts = [tilt for tilt in zero.values() if tilt is not None]
    if _on_tiptoe(sample, measured_tilts):
        alike = len(zero_tilts) == len(SIDES) and np.ptp(zero_tilts) < SAME
        if alike and 0 < np.mean(zero_tilts) < np.mean(measured_tilts):
            return Tilt(by_side, zero, CAPTURED_ERROR)
        return Tilt(by_side, _around_mean(by_side, sample.target_proportions.foot_tilt), BRIEF_ERROR)
    if exact := [
        tilt for side, tilt in by_side.items() if tilt is not None and _has_exact_tilt(sample, side)
    ]:
        return Tilt(by_side, _around_mean(by_side, float(np.mean(exact))), EXACT_ERROR)
    raised = RAISED if figure_runs(sample) else 0.0
    measured = float(np.mean(measured_tilts)) - raised
    if len(zero_tilts) == len(SIDES) and np.ptp(zero_tilts) < AGREE:
        # A foot that limps or stands on a slope may never come down. So it is enough if one foot agrees, to
        # within half of AGREE.
        best_foot = min(abs(a - b + raised) for a, b in zip(zero_tilts, measured_tilts, strict=True))
        if min(abs(np.mean(zero_tilts) - measured), 2 * best_foot) < AGREE:
            return Tilt(by_side, zero, EXACT_ERROR)
    if _is_target(sample):
        return Tilt(by_side, _around_mean(by_side, sample.target_proportions.foot_tilt), EXACT_ERROR)
    # The more the two feet differ, the less certain is their mean.
    error = float(np.hypot(CAPTURED_ERROR, 0.25 * np.ptp(measured_tilts)))
    angle, error = _expected_tilt(measured, error)
    return Tilt(by_side, _around_mean(by_side, angle), error if sample.seconds >= BRIEF else BRIEF_ERROR)


def _is_target(sample: BodySample) -> bool:
    """Whether the rig has the target's proportions. Then its feet are taken to be built like the target's."""
    bones = limb_bones(sample.body)
    return sample.target_proportions.matches_limb_lengths(np.array([sample.length(*bone) for bone in bones]))


def _on_tiptoe(sample: BodySample, measured_tilts: Sequence[float]) -> bool:
    """Whether the body squats on feet that are much steeper than the target's flat ones."""
    low = not any(upright_while_flat(sample, side) for side in SIDES)
    return low and bool(np.mean(measured_tilts) > sample.target_proportions.foot_tilt + TIPTOE)


def _around_mean(by_side: dict[str, float | None], angle: float) -> dict[str, float | None]:
    """Side -> tilt in radians. The mean of both feet is `angle`. None for a foot without a ball.

    Both feet of a rig have about the same build, so a limping foot is corrected by the other foot. Each foot
    keeps half of its measured difference from the mean, but at most UNLIKE. by_side: the measured tilts.
    """
    middle = np.mean([tilt for tilt in by_side.values() if tilt is not None])
    return {
        side: None if tilt is None else angle + float(np.clip(0.5 * (tilt - middle), -UNLIKE, UNLIKE))
        for side, tilt in by_side.items()
    }


def _expected_tilt(measured: float, error: float) -> tuple[float, float]:
    """The expected tilt of a captured rig's feet and its standard deviation, radians.

    measured: the measured tilt. error: its standard deviation. The feet are built either like a person's or
    in any way. Each case is weighted by how well it explains the measured tilt. So the tilt before the
    measurement has a mixture of two distributions, a normal and an even one, and the result is its mean after
    the measurement.
    """
    apart, deviation = PERSON - measured, float(np.hypot(error, PERSON_DEVIATION))
    density = np.exp(-0.5 * (apart / deviation) ** 2) / (np.sqrt(2 * np.pi) * deviation)
    person = density / (density + 1 / ANY_FOOT)  # the probability of feet like a person's
    pull = (error / deviation) ** 2  # share of the way to PERSON, if the feet are like a person's
    variance = error**2 * (1 - person * pull) + person * (1 - person) * (pull * apart) ** 2
    return measured + person * pull * apart, float(np.sqrt(variance))


def height_error(sample: BodySample, zero: bool) -> float:
    """Centimetres (two standard deviations) by which the figure may stand too high or low.

    zero: whether a person could stand in the zero pose. If so, the pose shows how the feet are turned, and
    the result is 0. The result is also 0 if the rig lacks a joint for the ball of a foot.
    """
    feet = [(heel, toe) for *_, heel, toe in sample.body.legs.values() if toe is not None]
    if zero or len(feet) < len(SIDES):
        return 0.0
    return float(2 * np.mean([sample.length(*bone) for bone in feet]) * feet_tilt(sample).error)


def feet_doubt(sample: BodySample, zero: bool) -> str | None:
    """A sentence on what is uncertain about how the feet stand, or None.

    zero: whether a person could stand in the zero pose. If so, the pose shows how the feet are turned.
    """
    tilt = feet_tilt(sample)
    tilts = [np.degrees(measured) for measured in tilt.measured.values() if measured is not None]
    if len(tilts) < len(SIDES):
        result = "the figure may stand 3 cm too high or low"
        if not zero:
            result += ", and toes and ankles may lie some centimetres off"
        return (
            "The rig has no joints for the balls of the feet. Joints were added where people have the balls, "
            f"so {result}."
        )
    uncertainty = height_error(sample, zero)
    if uncertainty < NOTED:
        return None
    why = "nobody could stand in the zero pose (all rotations zero) of its file"
    if sample.seconds < BRIEF:
        why += f" and {sample.seconds:.2f} s are too short for a step of each foot"
    if _on_tiptoe(sample, [float(np.radians(x)) for x in tilts]):
        why += " and the figure squats, perhaps on tiptoe"
    if abs(tilts[0] - tilts[1]) > APART:
        why += f" and its feet stand at different angles ({tilts[0]:.0f} and {tilts[1]:.0f} degrees)"
    return (
        f"The height of the ankles is uncertain, because {why}. It was estimated from the feet while they "
        f"stand, so the figure may stand {uncertainty:.1f} cm too high or low."
    )


def figure_runs(sample: BodySample) -> bool:
    """Whether the figure runs. The feet of a runner hardly stand."""
    slow = [
        sample.speeds[:, _ball(sample, side)] < SLOW * sample.length(*sample.body.legs[side][:3])
        for side in SIDES
    ]
    return bool(np.mean(slow) < RUNS)


def flat_moments(sample: BodySample, side: str) -> NDArray[np.integer]:
    """Indices of the sample's moments in which a foot is most likely flat on the ground: at least FEWEST."""
    stance = _stance_moments(sample, side)
    tilts = _tilt_of(_ahead(sample, side)[stance])
    low, high = np.percentile(tilts, LEAST_STEEP)
    flat = stance[(tilts >= low) & (tilts <= high)]
    return flat if len(flat) >= FEWEST else stance[np.argsort(tilts)[:FEWEST]]


def upright_while_flat(sample: BodySample, side: str) -> bool:
    """Whether the body is upright while the foot on this side is flat."""
    hip, knee, heel, _ = sample.body.legs[side]
    flat = flat_moments(sample, side)
    height = np.median(sample.positions[flat, hip, 1] - sample.positions[flat, heel, 1])
    return bool(height > UPRIGHT * sample.length(hip, knee, heel))


def _measured_tilt(sample: BodySample, side: str) -> float | None:
    """The tilt in radians of a foot in the moments in which it is flat, or None if it has no ball."""
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return None
    flat = flat_moments(sample, side)
    return float(np.median(_tilt_of(sample.positions[flat, toe] - sample.positions[flat, heel])))


def _has_exact_tilt(sample: BodySample, side: str) -> bool:
    """Whether a foot has exactly one tilt whenever it stands, but other tilts at other times."""
    tilts = _tilt_of(_ahead(sample, side))
    low, middle = np.percentile(tilts[_stance_moments(sample, side)], [10, 50])
    return bool(middle - low < EXACT and np.ptp(tilts) > TILTS)


def _stance_moments(sample: BodySample, side: str) -> NDArray[np.integer]:
    """Indices of the sample's moments in which a foot stands: those with the lowest and slowest ball.

    The most certain moments come first.
    """
    ball = _ball(sample, side)
    order = _rank(sample.speeds[:, ball]) + _rank(sample.positions[:, ball, 1])
    return np.argsort(order)[: max(FEWEST + 2, round(STANCE * len(order)))]


def _zero_tilt(sample: BodySample, side: str) -> float | None:
    """The tilt in radians of a foot in the zero pose, after the leg is turned so that its shank is upright.

    None if the foot has no ball, or if it does not point where its knee points, since its tilt can be any
    angle then. The knee of a nearly straight leg is not compared with the foot, because it may point anywhere
    if the bones are twisted.
    """
    hip, knee, heel, toe = sample.body.legs[side]
    if toe is None:
        return None
    thigh, shank, foot = (
        unit_vectors(sample.zero_positions[b] - sample.zero_positions[a])
        for a, b in ((hip, knee), (knee, heel), (heel, toe))
    )
    left = sample.mean_in_joint_axes(knee, sample.hinge_axes(hip, knee, heel, sample.hips_left))
    forward = unit_vectors(np.cross(shank, unit_vectors(left)))
    # Where the foot points, seen along the shank.
    toe_direction = unit_vectors(foot - shank * (shank @ foot))
    if degrees_between(toe_direction, forward) > FORWARD and degrees_between(thigh, shank) > STRAIGHT:
        return None
    return float(np.arcsin(np.clip(foot @ shank, -1.0, 1.0)))


def _ball(sample: BodySample, side: str) -> int:
    """The joint at the ball of a foot, or the ankle if the foot has none."""
    heel, toe = sample.body.legs[side][2:]
    return heel if toe is None else toe


def _ahead(sample: BodySample, side: str) -> Array:
    """(S, 3) vectors to where a foot points at the S moments of the sample: from the ankle to the ball.

    A foot without a ball points from the ankle to the ankle's end site. If there is none either, the foot
    points where the hips face on average.
    """
    heel, toe = sample.body.legs[side][2:]
    if toe is not None:
        return sample.positions[:, toe] - sample.positions[:, heel]
    if (site := sample.ankle_end_sites[side]) is not None and np.linalg.norm(site) > SHORT:
        return quat.rotate(sample.rotations[:, heel], np.array(site))
    ahead = np.cross(sample.hips_left, UP)
    return quat.rotate(sample.rotations[:, heel], sample.mean_in_joint_axes(heel, ahead))


def _tilt_of(ahead: Array) -> Array:
    """Radians by which vectors (S, 3) point down."""
    return np.arctan2(-ahead[:, 1], np.linalg.norm(ahead[:, [0, 2]], axis=-1))


def _rank(values: Array) -> NDArray[np.integer]:
    """How many of the values come before each one in ascending order."""
    return np.argsort(np.argsort(values))
