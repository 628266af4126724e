"""Measures a body in some moments of its motion: its bones, how limbs bend, and how its feet stand.

The target is the skeleton to which the clip will be retargeted. The zero pose of a rig is the one in which
all rotations are zero.

The frame of a joint is not a moment of the clip but a constant rotation F (4,). Let R be the joint's rotation
in the world. R F is the identity while the figure stands in a T-pose facing +Z (with its arms out sideways).
At other times, R F is how far the body part has turned from the T-pose.

The ball of a standing foot is low and slow. While the foot stands, its heel comes down and goes up again, so
the foot is flat when it is least steep. The moments in which a foot lands on its heel are an exception: it is
even less steep then. A runner's heel never comes all the way down. The tilt of a foot is the angle by which
the bone from the ankle to the ball points down. The tilt measured in the motion is compared with the tilt in
the zero pose and with the tilt of the target's feet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import AHEAD, LEFT, UP, degrees_between, pointed_along, rest_frame, unit
from hobble.motion.body import REACH, SIDES, Body, across, body_by_roles, distance_shares

SAMPLES = 400  # at most this many frames of the clip are measured
SHORT = 2.0  # cm: a bone shorter than this does not show a direction
# A knee or elbow shows the axis about which it bends if the mean sine of its bend is larger than this.
FLEXED = 0.05
# A rig has the target's proportions if length in the rig / length in the target is the same for all limb
# bones. The largest of these quotients may exceed the smallest by less than this share.
SAME_LENGTHS = 0.01
STANCE = 0.2  # a foot counts as standing in this share of the frames: those with the lowest and slowest ball
# Percentiles of a standing foot's tilt. The foot counts as flat in the frames between them; below the lower
# one it lands on its heel.
LEAST_STEEP = (10.0, 30.0)
FEWEST = 3  # least number of frames in which a foot is flat
STEEPEST = np.radians(70.0)  # a foot is usually less steep than this; some end sites lie under the ankle
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
# Radians. Even a zero pose in which nobody could stand shows the tilt of the feet, if the tilts of its feet
# differ from each other and from those in motion by less than AGREE. If the motion is on tiptoe, the feet of
# the zero pose must differ from each other by less than SAME.
AGREE, SAME = np.radians(10.0), np.radians(2.0)
TIPTOE = np.radians(12.0)  # a squatting body is on tiptoe if its feet are this much steeper than the target's
# Degrees. If a foot points further than FORWARD away from where its knee points in the zero pose, its tilt in
# that pose does not count. A knee that bends by less than STRAIGHT is not compared, because it may point
# anywhere.
FORWARD, STRAIGHT = 35.0, 30.0


@dataclass(frozen=True)
class Target:
    """The target in its standing rest pose, facing +Z.

    shares, points: (N,) and (N, 3) the points where its trunk and neck may bend, from the hips up. These are
    joints; a joint less than SHORT above the one before it is left out. shares: where they are along the
    body: 0 at the hips, 1 at the chest, 2 at the head. points: their positions, cm. foot_tilt: radians by
    which the bone from ankle to ball of the foot points below the horizontal, mean of both feet.
    limb_lengths: (B,) of `Body.limb_bones`, cm.
    """

    shares: Array
    points: Array
    foot_tilt: float = 0.0
    limb_lengths: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, skeleton: Skeleton) -> Target:
        """The target `skeleton`, which has roles."""
        body = body_by_roles(skeleton)
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        places = rest[list(body.spine)]
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=-1)
        used = np.concatenate([[True], lengths > SHORT])
        feet = np.array([rest[toe] - rest[heel] for *_, heel, toe in body.legs.values() if toe is not None])
        limbs = np.array([np.linalg.norm(rest[b] - rest[a]) for a, b in body.limb_bones])
        shares = spine_shares(lengths, body.trunk_bones)
        return cls(shares[used], places[used], float(np.mean(_downward(feet))), limbs)

    def direction(self, start: float, end: float) -> Array:
        """(3,) unit direction of a bone of another rig: that of the part of this spine that it replaces.

        start, end: positions along the body between which the bone lies, counted like `shares`. If the rig
        has fewer joints, one of its bones may span several bones of this spine.
        """
        first = self._first_point(start)
        # A bone that ends at the chest or below does not reach into the neck.
        last = min(self._last_point(end), self._chest if end <= 1 else len(self.shares) - 1)
        return unit(self.points[max(last, first + 1)] - self.points[first])

    def bone_end(self, start: float) -> float:
        """Position along the body of the upper end of a bone of this spine. start: that of its lower end."""
        return float(self.shares[self._first_point(start) + 1])

    @property
    def neck_direction(self) -> Array:
        """(3,) unit direction from the chest to the next point: the neck, or the head if there is no neck."""
        chest = min(self._chest, len(self.shares) - 2)
        return unit(self.points[chest + 1] - self.points[chest])

    @property
    def has_neck(self) -> bool:
        """Whether there is a point between chest and head."""
        return bool(((self.shares > 1.0 + 1e-6) & (self.shares < 2.0 - 1e-6)).any())

    @property
    def _chest(self) -> int:
        return int(np.searchsorted(self.shares, 1.0 - 1e-6))

    def _first_point(self, start: float) -> int:
        """Index of the point at which the bone from position `start` along the body begins."""
        return max(min(self._last_point(start), self._chest - 1 if start < 1 else len(self.shares) - 2), 0)

    def _last_point(self, share: float) -> int:
        """Index of the highest point that is at most REACH above the position `share` along the body."""
        return int(np.searchsorted(self.shares, share + REACH, side="right")) - 1


def spine_shares(lengths: Array, trunk_bones: int) -> Array:
    """(N,) position of each joint along the body: 0 at the hips, 1 at the chest, 2 at the head.

    lengths: (N-1,) of the bones from the hips through trunk and neck to the head. trunk_bones: how many of
    them belong to the trunk. The last of these ends at the chest.
    """
    below, above = distance_shares(lengths[:trunk_bones]), distance_shares(lengths[trunk_bones:])
    shares = np.concatenate([below[:-1], 1.0 + above])
    shares[0] = 0.0  # also if the hips carry the arms and are the chest
    return shares


@dataclass(frozen=True)
class FeetTilt:
    """The tilt of each foot that has a ball, when it stands flat, in radians.

    measured: side -> tilt in the frames in which the foot is flat. flat: side -> tilt that is taken as
    correct. error: standard deviation of the mean of both feet's `flat`.
    """

    measured: dict[str, float]
    flat: dict[str, float]
    error: float


@dataclass(frozen=True, eq=False)
class BodySample:
    """S moments of a clip, chosen to show how the axes of a rig's joints are turned relative to its body.

    body: which joint is which part. positions: (S, J, 3) cm. rotations: (S, J, 4) in the world. speeds:
    (S, J) cm a second. zero_positions: (J, 3) in the zero pose. end_sites: joint -> (3,) offset of its end
    site in the file. target: the target's proportions. seconds: length of the clip.
    """

    body: Body
    positions: Array
    rotations: Array
    speeds: Array
    zero_positions: Array
    end_sites: Mapping[int, Array]
    target: Target
    seconds: float

    @classmethod
    def of(cls, clip: Clip, body: Body, target: Skeleton) -> BodySample:
        """At most SAMPLES moments, spread evenly over a clip in centimetres, right-handed, Y up."""
        moments = np.unique(np.linspace(0, len(clip) - 1, SAMPLES).round().astype(int))
        speeds = np.zeros(clip.positions.shape[:2])
        if len(clip) > 1:
            speeds = np.linalg.norm(np.gradient(clip.positions, axis=0), axis=-1) * clip.fps
        ends = {clip.skeleton.index(name): np.array(end) for name, end in clip.skeleton.end_sites.items()}
        return cls(
            body,
            clip.positions[moments],
            clip.global_rotations[moments],
            speeds[moments],
            rest_positions(clip.skeleton),
            ends,
            Target.of(target),
            len(clip) / clip.fps,
        )

    def at_moments(self, moments: NDArray[np.bool_]) -> BodySample:
        """The sample with only some of its moments. moments: (S,), True for each moment to keep."""
        positions, rotations = self.positions[moments], self.rotations[moments]
        return replace(self, positions=positions, rotations=rotations, speeds=self.speeds[moments])

    def in_zero_pose(self) -> BodySample:
        """The zero pose as a sample of one moment. Its `speeds` are those of this sample's first moment."""
        rotations = np.broadcast_to(quat.IDENTITY, (1, *self.rotations.shape[1:]))
        return replace(self, positions=self.zero_positions[None], rotations=rotations, speeds=self.speeds[:1])

    @cached_property
    def hips_left(self) -> Array:
        """(S, 3) unit vectors from the right hip to the left hip."""
        return unit(across(self.positions, self.body.legs, 0))

    @cached_property
    def chest_left(self) -> Array:
        """(S, 3) unit vectors from the right shoulder to the left shoulder."""
        return unit(across(self.positions, self.body.arms, 1))

    def directions(self, start: int, end: int) -> Array:
        """(S, 3) unit vectors from the joint `start` to the joint `end`."""
        return unit(self.positions[:, end] - self.positions[:, start])

    def mean_in_joint_axes(self, joint: int, vectors: Array) -> Array:
        """(3,) mean of `vectors` (S, 3) of the world, without outliers, in the joint's own axes."""
        own = quat.rotate(quat.inv(self.rotations[:, joint]), vectors)
        distances = np.linalg.norm(own - np.median(own, axis=0), axis=-1)
        return own[distances <= 3 * np.median(distances) + 1e-9].mean(axis=0)

    def bone(self, start: int, end: int) -> Array:
        """(3,) mean vector from the joint `start` to the joint `end`, in the own axes of `start`."""
        return self.mean_in_joint_axes(start, self.positions[:, end] - self.positions[:, start])

    def mean_frame(self, joint: int, turned: Array) -> Array:
        """(4,) mean frame of a joint. turned: (S, 4) how far its body part has turned from the T-pose."""
        return mean_rotation(quat.mul(quat.inv(self.rotations[:, joint]), turned))

    def length(self, *joints: int) -> float:
        """Length of a chain of joints, cm: the sum of the distances from each joint to the next.

        Each distance is the median over the sample.
        """
        vectors = (self.positions[:, b] - self.positions[:, a] for a, b in pairwise(joints))
        return sum(float(np.median(np.linalg.norm(vector, axis=-1))) for vector in vectors)

    def hinge_axes(self, limb: Sequence[int], otherwise: Array) -> Array:
        """(S, 3) axis about which a limb of three joints bends, in the axes of the world.

        The axis turns with the first of them. For a leg it points to the body's left. otherwise: (S, 3), is
        returned if the limb hardly bends.
        """
        start, middle, end = limb
        axis = np.cross(self.directions(start, middle), self.directions(middle, end))
        mean_axis = self.mean_in_joint_axes(start, axis)
        if np.linalg.norm(mean_axis) < FLEXED:
            return otherwise
        return quat.rotate(self.rotations[:, start], np.broadcast_to(unit(mean_axis), axis.shape))

    def hand_frame(self, side: str, straight: Array) -> Array:
        """(4,) the frame of a hand, which points from the wrist to the base of a finger (`Body.fingers`).

        straight: (4,) the frame of a hand that is in line with its forearm. It is returned unchanged if
        `Body.fingers` has no joint for this hand.
        """
        if side not in self.body.fingers:
            return straight
        finger = self.bone(self.body.arms[side][3], self.body.fingers[side])
        return pointed_along(straight, outward(side), finger)

    @cached_property
    def feet_tilt(self) -> FeetTilt:
        """The tilt of flat feet: from the zero pose if it shows it, else from frames in which they stand."""
        feet = [side for side in SIDES if self.body.legs[side][3] is not None]
        measured = {s: float(np.median(_downward(self._ahead(s)[self.flat_moments(s)]))) for s in feet}
        return FeetTilt(measured, *(self._flat_tilt(measured) if feet else ({}, 0.0)))

    def _flat_tilt(self, by_side: dict[str, float]) -> tuple[dict[str, float], float]:
        """`flat` and `error` of FeetTilt. by_side: its `measured`."""
        zero = {side: tilt for side in by_side if (tilt := self._zero_tilt(side)) is not None}
        zero_tilts, tilts = list(zero.values()), list(by_side.values())
        apart_in_zero = np.ptp(zero_tilts) if len(zero) == len(SIDES) else np.inf
        as_target = _around_mean(by_side, self.target.foot_tilt)
        if self.is_on_tiptoe(tilts):
            shown = apart_in_zero < SAME and 0 < np.mean(zero_tilts) < np.mean(tilts)
            return (zero, CAPTURED_ERROR) if shown else (as_target, BRIEF_ERROR)
        if exact := [tilt for side, tilt in by_side.items() if self._has_exact_tilt(side)]:
            return _around_mean(by_side, float(np.mean(exact))), EXACT_ERROR
        raised = RAISED if self.figure_runs else 0.0
        measured = float(np.mean(tilts)) - raised
        if apart_in_zero < AGREE:
            # A foot that limps or stands on a slope may never come down. So it is enough if one foot agrees,
            # to within half of AGREE.
            best_foot = min(abs(a - b + raised) for a, b in zip(zero_tilts, tilts, strict=True))
            if min(abs(np.mean(zero_tilts) - measured), 2 * best_foot) < AGREE:
                return zero, EXACT_ERROR
        if self._has_target_lengths:  # then its feet are taken to be built like the target's
            return as_target, EXACT_ERROR
        # The more the two feet differ, the less certain is their mean.
        angle, error = _expected_tilt(measured, float(np.hypot(CAPTURED_ERROR, 0.25 * np.ptp(tilts))))
        return _around_mean(by_side, angle), error if self.seconds >= BRIEF else BRIEF_ERROR

    @property
    def figure_runs(self) -> bool:
        """Whether the figure runs. The feet of a runner hardly stand."""
        legs = self.body.legs
        slow = [self.speeds[:, self._ball(side)] < SLOW * self.length(*legs[side][:3]) for side in SIDES]
        return bool(np.mean(slow) < RUNS)

    @property
    def _has_target_lengths(self) -> bool:
        bones, wanted = self.body.limb_bones, self.target.limb_lengths
        if len(bones) != len(wanted):
            return False
        quotients = np.maximum([self.length(*bone) for bone in bones], 1e-9) / wanted
        return bool(quotients.max() < (1 + SAME_LENGTHS) * quotients.min())

    def _ball(self, side: str) -> int:
        """The joint at the ball of a foot, or the ankle if the foot has none."""
        heel, toe = self.body.legs[side][2:]
        return heel if toe is None else toe

    def _ahead(self, side: str) -> Array:
        """(S, 3) vectors to where a foot points at the S moments of the sample: from the ankle to the ball.

        A foot without a ball points from the ankle to the ankle's end site. If there is none either, or if it
        lies under the ankle, the foot points where the hips face on average.
        """
        heel, toe = self.body.legs[side][2:]
        if toe is not None:
            return self.positions[:, toe] - self.positions[:, heel]
        site = self.end_sites.get(heel, np.zeros(3))
        ahead = quat.rotate(self.rotations[:, heel], site)
        if np.linalg.norm(site) > SHORT and np.median(_downward(ahead)) < STEEPEST:
            return ahead
        site = self.mean_in_joint_axes(heel, np.cross(self.hips_left, UP))
        return quat.rotate(self.rotations[:, heel], site)

    def foot_frames(self) -> dict[int, Array]:
        """Joint (ankle or ball) -> its frame (4,), from how the joint is turned while the foot is flat."""
        tilt = self.feet_tilt
        frames: dict[int, Array] = {}
        for side in SIDES:
            steeper_by = tilt.flat.get(side, 0.0) - tilt.measured.get(side, 0.0)
            flat = self.flat_moments(side)
            # The rotations from a figure that faces +Z to one that faces where the foot points.
            heading = quat.between(AHEAD, unit(self._ahead(side)[flat] * [1, 0, 1]))
            for joint in self.body.legs[side][2:]:
                if joint is not None:
                    as_measured = mean_rotation(quat.mul(quat.inv(self.rotations[flat, joint]), heading))
                    frames[joint] = quat.mul(as_measured, quat.inv(quat.from_axis_angle(LEFT, steeper_by)))
        return frames

    def flat_moments(self, side: str) -> NDArray[np.integer]:
        """Indices of the moments in which a foot is most likely flat on the ground: at least FEWEST."""
        stance = self._stance_moments(side)
        tilts = _downward(self._ahead(side)[stance])
        low, high = np.percentile(tilts, LEAST_STEEP)
        flat = stance[(tilts >= low) & (tilts <= high)]
        return flat if len(flat) >= FEWEST else stance[np.argsort(tilts)[:FEWEST]]

    def is_upright_while_flat(self, side: str) -> bool:
        """Whether the body is upright while the foot on this side is flat."""
        hip, knee, heel, _ = self.body.legs[side]
        flat = self.flat_moments(side)
        height = np.median(self.positions[flat, hip, 1] - self.positions[flat, heel, 1])
        return bool(height > UPRIGHT * self.length(hip, knee, heel))

    def is_on_tiptoe(self, tilts: Sequence[float]) -> bool:
        """Whether the body squats on feet whose `tilts` are much steeper than the target's flat ones."""
        low = not any(self.is_upright_while_flat(side) for side in SIDES)
        return low and bool(np.mean(tilts) > self.target.foot_tilt + TIPTOE)

    def _stance_moments(self, side: str) -> NDArray[np.integer]:
        """Indices of the sample's moments in which a foot stands: those with the lowest and slowest ball.

        The most certain moments come first.
        """
        joint = self._ball(side)
        # How many speeds, and how many heights, come before each one in ascending order.
        speeds, heights = self.speeds[:, joint], self.positions[:, joint, 1]
        order = np.argsort(np.argsort(speeds)) + np.argsort(np.argsort(heights))
        return np.argsort(order)[: max(FEWEST + 2, round(STANCE * len(order)))]

    def _has_exact_tilt(self, side: str) -> bool:
        """Whether a foot has exactly one tilt whenever it stands, but other tilts at other times."""
        tilts = _downward(self._ahead(side))
        low, middle = np.percentile(tilts[self._stance_moments(side)], [10, 50])
        return bool(middle - low < EXACT and np.ptp(tilts) > TILTS)

    def _zero_tilt(self, side: str) -> float | None:
        """The tilt in radians of a foot in the zero pose, with its shank turned upright.

        None if the foot does not point where its knee points, since its tilt can be any angle then. The knee
        of a nearly straight leg is not compared with the foot, because it may point anywhere if the bones are
        twisted.
        """
        leg = self.body.legs[side]
        thigh, shank, foot = unit(np.diff(self.zero_positions[list(leg)], axis=0))
        left = self.mean_in_joint_axes(leg[1], self.hinge_axes(leg[:3], self.hips_left))
        forward = unit(np.cross(shank, unit(left)))
        # Where the foot points, seen along the shank.
        toe_direction = unit(foot - shank * (shank @ foot))
        if degrees_between(toe_direction, forward) > FORWARD and degrees_between(thigh, shank) > STRAIGHT:
            return None
        return float(np.arcsin(np.clip(foot @ shank, -1.0, 1.0)))


def mean_rotation(rotations: Array) -> Array:
    """Mean (4,) of rotations (S, 4), without outliers.

    It is computed twice. The second time, rotations that lie unusually far from the first mean are left out.
    """
    for _ in range(2):
        # The mean of quaternions is the eigenvector with the largest eigenvalue (Markley et al. 2007).
        _, vectors = np.linalg.eigh(rotations.T @ rotations)
        mean = vectors[:, -1]
        angles = quat.angle(rotations, mean)
        rotations = rotations[angles <= 2.5 * np.median(angles) + 1e-9]
    return mean


def outward(side: str) -> Array:
    """(3,) where an arm points in the T-pose."""
    return LEFT if side == "left" else -LEFT


def _downward(ahead: Array) -> Array:
    """Radians by which vectors (S, 3) point down."""
    return np.arctan2(-ahead[:, 1], np.linalg.norm(ahead[:, [0, 2]], axis=-1))


def _around_mean(by_side: dict[str, float], angle: float) -> dict[str, float]:
    """Side -> tilt in radians. The mean of both feet is `angle`.

    Both feet of a rig have about the same build, so a limping foot is corrected by the other foot. Each foot
    keeps half of its measured difference from the mean, but at most UNLIKE. by_side: the measured tilts.
    """
    middle = np.mean(list(by_side.values()))
    return {
        side: angle + float(np.clip(0.5 * (tilt - middle), -UNLIKE, UNLIKE)) for side, tilt in by_side.items()
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
