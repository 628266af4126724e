"""Finds how feet are turned when they stand flat, and how certain that is.

The ball of a standing foot is low and slow. While it stands, the heel comes down and goes up again, so the
foot is flat when it is least steep, except for the moments in which it lands on the heel. A runner's heel
never comes all the way down. The tilt of a foot is the angle by which the bone from the ankle to the ball
points down. The tilt measured in the motion is compared with the tilt in the zero pose (all rotations zero)
and with that of the target's feet.
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
from hobble.motion.orient import degrees_between, mean_rotation, unit
from hobble.motion.spine import SHORT
from hobble.motion.target_build import limb_bones

UP, AHEAD, LEFT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
STANCE = 0.2  # a foot counts as standing in this share of the frames: those with the lowest and slowest ball
LEAST_STEEP = (10.0, 30.0)  # percentiles of a standing foot's tilt; between them the foot counts as flat
FEWEST = 3  # least number of frames in which a foot is flat
SLOW = 0.5  # leg lengths a second: the ball of a standing foot is slower than this
# A figure runs if its balls are slow in less than this share of the frames. In CMU's walks the share is at
# least .41.
RUNS = 0.3
# Radians by which a runner's standing foot is steeper than flat. In 19 clips of running from CMU, the feet
# are 4.0 to 9.2 degrees steeper than in their zero poses, 6.8 on average. In 50 clips of walking the mean is
# .7.
RAISED = np.radians(6.8)
UNLIKE = np.radians(2.5)  # the tilt of each foot may differ from the mean of both by at most this
UPRIGHT = 0.6  # least height of an upright body's hips above a standing foot, in leg lengths
# Feet that were animated or cleaned stand at exactly one angle: the 10th and 50th percentile of their angles
# differ by less than EXACT (in most clips of the data set `styles` by .00 degrees). Over the whole clip,
# their angles differ by more than TILTS. For captured feet the percentiles differ by at least .1 degrees.
EXACT, TILTS = np.radians(0.02), np.radians(10.0)
# Standard deviation (radians) of the tilt of feet that stand at one angle, or whose tilt the zero pose shows.
EXACT_ERROR = np.radians(0.5)
# A captured foot that stands and the same foot in the rig's zero pose differ in tilt. Standard deviation of
# the difference: 3 degrees over seven subjects of CMU, and a little more for differences between clips.
CAPTURED_ERROR = np.radians(3.5)
# The feet of a rig are built either like those of people in the CMU database or in any way. In the first case
# their tilt in the zero pose is PERSON, with the standard deviation PERSONS (measured on seven subjects: 15.0
# and 2.0 degrees). In the second case, all tilts in a range of ANY_FOOT are equally likely.
PERSON, PERSONS, ANY_FOOT = np.radians(15.0), np.radians(2.5), np.radians(42.0)
# In a clip shorter than BRIEF seconds, the feet may never stand. The standard deviation of their tilt is then
# BRIEF_ERROR radians: clips of a third of a second or less were 10 to 15 degrees off.
BRIEF, BRIEF_ERROR = 0.5, np.radians(12.0)
APART = 10.0  # degrees: a larger difference between the two standing feet is reported
# Even a zero pose in which nobody could stand shows the tilt of the feet, if its feet differ from each other
# and from those in motion by less than AGREE. If the motion is on tiptoe, the feet of the zero pose must
# differ from each other by less than SAME.
AGREE, SAME = np.radians(10.0), np.radians(2.0)
TIPTOE = np.radians(12.0)  # a squatting body is on tiptoe if its feet are this much steeper than the target's
# Degrees. If a foot points further than FORWARD from where its knee points in the zero pose, its tilt there
# does not count. A knee that bends by less than STRAIGHT is not compared, because it may point anywhere.
FORWARD, STRAIGHT = 35.0, 30.0
NOTED = 1.0  # cm: an uncertainty of the height (two standard deviations) above this is reported


@dataclass(frozen=True)
class Tilt:
    """The tilt of each foot when it stands flat: how far the bone from ankle to ball points down.

    measured: side -> radians in the frames in which the foot is flat, or None if it has no ball. flat: side
    -> radians that are taken as correct, or None. error: standard deviation in radians of the mean of both
    feet's `flat`.
    """

    measured: dict[str, float | None]
    flat: dict[str, float | None]
    error: float


def flat_feet(sample: BodySample) -> dict[int, Array]:
    """Joint (ankle or ball) -> its frame (4,), found from how the joint is turned while the foot is flat.

    The frame of a joint (not a moment of the clip) is the rotation from the axes of a figure that faces +Z to
    the joint's own axes (see `BodySample` in `hobble.motion.body_sample`).
    """
    tilt = feet_tilt(sample)
    frames: dict[int, Array] = {}
    for side in SIDES:
        measured, correct = tilt.measured[side], tilt.flat[side]
        turn = 0.0 if measured is None or correct is None else correct - measured
        more = quat.from_axis_angle(LEFT, np.array(turn))
        flat = flat_frames(sample, side)
        level = quat.between(AHEAD, unit(_ahead(sample, side)[flat] * [1, 0, 1]))
        for joint in sample.body.legs[side][2:]:
            if joint is not None:
                as_measured = mean_rotation(quat.mul(quat.inv(sample.turned[flat, joint]), level))
                frames[joint] = quat.mul(as_measured, quat.inv(more))
    return frames


@lru_cache(maxsize=1)
def feet_tilt(sample: BodySample) -> Tilt:
    """The tilt of flat feet: from the zero pose if this shows it, else from frames in which feet stand."""
    by_side = {side: _steepness(sample, side) for side in SIDES}
    measured_tilts = [tilt for tilt in by_side.values() if tilt is not None]
    if not measured_tilts:
        return Tilt(by_side, by_side, 0.0)
    zero = {side: _zero_tilt(sample, side) for side in SIDES}
    zero_tilts = [tilt for tilt in zero.values() if tilt is not None]
    if _on_tiptoe(sample, measured_tilts):
        alike = len(zero_tilts) == len(SIDES) and np.ptp(zero_tilts) < SAME
        if alike and 0 < np.mean(zero_tilts) < np.mean(measured_tilts):
            return Tilt(by_side, zero, CAPTURED_ERROR)
        return Tilt(by_side, _both(by_side, sample.target.tilt), BRIEF_ERROR)
    if exact := [tilt for side, tilt in by_side.items() if tilt is not None and _exact(sample, side)]:
        return Tilt(by_side, _both(by_side, float(np.mean(exact))), EXACT_ERROR)
    raised = RAISED if runs(sample) else 0.0
    measured = float(np.mean(measured_tilts)) - raised
    if len(zero_tilts) == len(SIDES) and np.ptp(zero_tilts) < AGREE:
        # A foot that limps or stands on a slope may never come down, so one foot that agrees is enough.
        best_foot = min(abs(a - b + raised) for a, b in zip(zero_tilts, measured_tilts, strict=True))
        if min(abs(np.mean(zero_tilts) - measured), 2 * best_foot) < AGREE:
            return Tilt(by_side, zero, EXACT_ERROR)
    if _is_target(sample):
        return Tilt(by_side, _both(by_side, sample.target.tilt), EXACT_ERROR)
    error = float(np.hypot(CAPTURED_ERROR, 0.25 * np.ptp(measured_tilts)))
    angle, error = _likeliest(measured, error)
    return Tilt(by_side, _both(by_side, angle), error if sample.seconds >= BRIEF else BRIEF_ERROR)


def _is_target(sample: BodySample) -> bool:
    """Whether the rig has the target's proportions. Then its feet are taken to be built like the target's."""
    bones = limb_bones(sample.body)
    return sample.target.is_built_like(np.array([sample.length(*bone) for bone in bones]))


def _on_tiptoe(sample: BodySample, measured_tilts: Sequence[float]) -> bool:
    """Whether the body squats on feet that are much steeper than the target's flat ones."""
    low = not any(upright_while_flat(sample, side) for side in SIDES)
    return low and bool(np.mean(measured_tilts) > sample.target.tilt + TIPTOE)


def _both(by_side: dict[str, float | None], angle: float) -> dict[str, float | None]:
    """Side -> tilt in radians, with the mean `angle`; None for a foot without a ball.

    Both feet of a rig have about the same build, so a limping foot is corrected by the other. Half of the
    measured difference is kept, but no more than UNLIKE from the mean. by_side: the measured tilts.
    """
    middle = np.mean([tilt for tilt in by_side.values() if tilt is not None])
    return {
        side: None if tilt is None else angle + float(np.clip(0.5 * (tilt - middle), -UNLIKE, UNLIKE))
        for side, tilt in by_side.items()
    }


def _likeliest(measured: float, error: float) -> tuple[float, float]:
    """The expected tilt of a captured rig's feet and its standard deviation, radians.

    measured: the measured tilt. error: its standard deviation. The feet are built either like a person's or
    in any way. Both cases are weighted by how well they explain the measured tilt: a mixture of a normal and
    an even distribution.
    """
    apart, both = PERSON - measured, float(np.hypot(error, PERSONS))
    person = np.exp(-0.5 * (apart / both) ** 2) / (np.sqrt(2 * np.pi) * both)
    person /= person + 1 / ANY_FOOT
    pull = (error / both) ** 2
    variance = error**2 * (1 - person * pull) + person * (1 - person) * (pull * apart) ** 2
    return measured + person * pull * apart, float(np.sqrt(variance))


def height_error(sample: BodySample, zero: bool) -> float:
    """Centimetres (two standard deviations) by which the figure may stand too high or low.

    zero: whether a person could stand in the zero pose. If so, the pose shows how the feet are turned, and
    the result is 0. It is also 0 if the rig has no joints for the balls of the feet.
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
        guessed = "the figure may stand 3 cm too high or low"
        if not zero:
            guessed += ", and toes and ankles may lie some centimetres off"
        return f"It has no joints for the balls of the feet. They were put where people have them: {guessed}."
    uncertainty = height_error(sample, zero)
    if uncertainty < NOTED:
        return None
    why = "nobody could stand in the zero pose of its file"
    if sample.seconds < BRIEF:
        why += f" and {sample.seconds:.2f} s are too short for a step of each foot"
    if _on_tiptoe(sample, [float(np.radians(x)) for x in tilts]):
        why += " and the figure squats, perhaps on tiptoe"
    if abs(tilts[0] - tilts[1]) > APART:
        why += f" and its feet stand at different angles ({tilts[0]:.0f} and {tilts[1]:.0f} degrees)"
    return (
        f"The height of its ankles is uncertain, because {why}. It was estimated from the feet while they "
        f"stand: the figure may stand {uncertainty:.1f} cm too high or low."
    )


def runs(sample: BodySample) -> bool:
    """Whether the figure runs. The feet of a runner hardly stand."""
    slow = [
        sample.speeds[:, _ball(sample, side)] < SLOW * sample.length(*sample.body.legs[side][:3])
        for side in SIDES
    ]
    return bool(np.mean(slow) < RUNS)


def flat_frames(sample: BodySample, side: str) -> NDArray[np.integer]:
    """The frames in which a foot is most likely flat on the ground: at least FEWEST."""
    stance = _stance(sample, side)
    steep = _steep(_ahead(sample, side)[stance])
    low, high = np.percentile(steep, LEAST_STEEP)
    flat = stance[(steep >= low) & (steep <= high)]
    return flat if len(flat) >= FEWEST else stance[np.argsort(steep)[:FEWEST]]


def upright_while_flat(sample: BodySample, side: str) -> bool:
    """Whether the body is upright while the foot on this side is flat."""
    hip, knee, heel, _ = sample.body.legs[side]
    flat = flat_frames(sample, side)
    height = np.median(sample.at[flat, hip, 1] - sample.at[flat, heel, 1])
    return bool(height > UPRIGHT * sample.length(hip, knee, heel))


def _steepness(sample: BodySample, side: str) -> float | None:
    """The tilt in radians of a foot in the frames in which it is flat, or None if it has no ball."""
    heel, toe = sample.body.legs[side][2:]
    if toe is None:
        return None
    flat = flat_frames(sample, side)
    return float(np.median(_steep(sample.at[flat, toe] - sample.at[flat, heel])))


def _exact(sample: BodySample, side: str) -> bool:
    """Whether a foot has exactly one tilt whenever it stands, but other tilts at other times."""
    steep = _steep(_ahead(sample, side))
    low, middle = np.percentile(steep[_stance(sample, side)], [10, 50])
    return bool(middle - low < EXACT and np.ptp(steep) > TILTS)


def _stance(sample: BodySample, side: str) -> NDArray[np.integer]:
    """The frames in which a foot stands: those with the lowest and slowest ball. The surest come first."""
    ball = _ball(sample, side)
    order = _rank(sample.speeds[:, ball]) + _rank(sample.at[:, ball, 1])
    return np.argsort(order)[: max(FEWEST + 2, round(STANCE * len(order)))]


def _zero_tilt(sample: BodySample, side: str) -> float | None:
    """The tilt in radians of a foot in the zero pose, after the leg is turned so that its shank is upright.

    None if the foot does not point where its knee points, since it can have any tilt then. The knee of a
    nearly straight leg is not compared: the bones may be twisted, so that it points anywhere.
    """
    hip, knee, heel, toe = sample.body.legs[side]
    if toe is None:
        return None
    thigh, shank, foot = (
        unit(sample.rest[b] - sample.rest[a]) for a, b in ((hip, knee), (knee, heel), (heel, toe))
    )
    left = sample.local(knee, sample.hinge(hip, knee, heel, sample.hips_left))
    forward = unit(np.cross(shank, unit(left)))
    level = unit(foot - shank * (shank @ foot))
    if degrees_between(level, forward) > FORWARD and degrees_between(thigh, shank) > STRAIGHT:
        return None
    return float(np.arcsin(np.clip(foot @ shank, -1.0, 1.0)))


def _ball(sample: BodySample, side: str) -> int:
    heel, toe = sample.body.legs[side][2:]
    return heel if toe is None else toe


def _ahead(sample: BodySample, side: str) -> Array:
    """(S, 3) where a foot points at the S moments of the sample: from the ankle to the ball.

    On a rig without balls it points to the ankle's end site; if there is none, where the hips face on
    average.
    """
    heel, toe = sample.body.legs[side][2:]
    if toe is not None:
        return sample.at[:, toe] - sample.at[:, heel]
    if (site := sample.ends[side]) is not None and np.linalg.norm(site) > SHORT:
        return quat.rotate(sample.turned[:, heel], np.array(site))
    ahead = np.cross(sample.hips_left, UP)
    return quat.rotate(sample.turned[:, heel], sample.local(heel, ahead))


def _steep(ahead: Array) -> Array:
    return np.arctan2(-ahead[:, 1], np.linalg.norm(ahead[:, [0, 2]], axis=-1))


def _rank(values: Array) -> NDArray[np.integer]:
    return np.argsort(np.argsort(values))
