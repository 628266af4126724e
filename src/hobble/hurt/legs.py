"""Changes path and legs of a healthy clip (the source): shorter steps, other feet, hips and knees."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, bone_axes, two_bone_knee
from hobble.core.smooth import gaussian, interpolate_curve, smooth_above, smoothstep
from hobble.hurt.effects import SIDES, Effects
from hobble.hurt.healthy_clip import (
    UP,
    HealthyClip,
    SourceStance,
    interpolate_rotations,
    interpolate_values,
)

SLOPE_SECONDS = 0.3  # sigma of the Gaussian that smooths the height of the ground over time


@dataclass(frozen=True)
class ShortenedPath:
    """The path of the body before (old) and after (new) it is shortened, in each of F source frames, cm.

    old, new: (F, 2) horizontal path, x and z. old_ground, new_ground: (F,) height of the ground below the
    body. If the ground is flat, its height is 0. On other ground, climbs and descents shrink like the path,
    so that slopes keep their angle.
    """

    old: Array = field(repr=False)
    new: Array = field(repr=False)
    old_ground: Array = field(repr=False)
    new_ground: Array = field(repr=False)

    def move_point(self, point: Array, when: float) -> Array:
        """Move a point (3,) by as much as the body's path has moved in source frame `when`. Returns (3,)."""
        first = min(int(when), len(self.old) - 1)
        near = slice(first, first + 2)  # two frames; to read all frames for each footprint would take long
        shift = self.new[near] - self.old[near]
        curves = shift[:, 0], self.new_ground[near] - self.old_ground[near], shift[:, 1]
        return point + np.array([interpolate_curve(curve, when - first) for curve in curves])


def shorten(
    source: HealthyClip, effects: Effects, stride_ratio: Array, ground: Array | None
) -> ShortenedPath:
    """Shorten the path of the body so that its speed changes as `effects` says.

    stride_ratio: (F,) new duration of a stride / old duration. ground: (F,) height of the ground below the
    body; None if flat.
    """
    share = effects.ratio("speed") * stride_ratio  # length of a stride = speed * duration
    flat = np.zeros(len(source))
    return ShortenedPath(
        source.path,
        _shrink(source.path, share[:, None]),
        flat if ground is None else ground,
        flat if ground is None else _shrink(ground, share),
    )


def ground_below(source: HealthyClip, feet: Sequence[HurtFoot]) -> Array:
    """(F,) height of the ground below the body, cm, from the footprints of both feet.

    The median height of each foot counts as 0. Otherwise, if one ankle is higher than the other in stance,
    flat ground would seem to rise and fall with each step.
    """
    points: list[tuple[float, float]] = []
    for foot, stances in zip(feet, source.stances, strict=True):
        heights = [float(footprint[1]) for footprint in footprints_of(foot, stances)]
        level = float(np.median(heights))
        points += [(stance.middle, y - level) for stance, y in zip(stances, heights, strict=True)]
    points.sort()
    height = np.interp(np.arange(len(source)), [p[0] for p in points], [p[1] for p in points])
    return gaussian(height, SLOPE_SECONDS * source.clip.fps)


def _shrink(values: Array, share: Array) -> Array:
    """Multiply the changes of a curve from frame to frame by `share`. The first value stays the same."""
    steps = np.diff(values, axis=0) * (share[1:] + share[:-1]) / 2
    return values[:1] + np.concatenate([np.zeros_like(values[:1]), np.cumsum(steps, axis=0)])


# Moves the feet: makes steps shorter, the roll over the toe smaller, and swings lower or wider.
#
# All arrays over frames have the F frames of the healthy clip (the source).


OUTWARD_SIGN = (1.0, -1.0)  # sign of X on the left and on the right side of the figure
# The foot's pitch is multiplied by the effect `strike` while its toe is up, by `push` while its heel is up.
# The factor changes from `strike` to `push` as the heel rises by this angle, radians.
BLEND_PITCH = np.radians(8.0)
# The progress of a swing is measured mainly by time if the swing is shorter than this, else mainly by the
# distance that the foot has covered.
SHORT_SWING_CM = 12.0
# In mid-swing the toe joint stays at least this much above its height in stance. If it is lower in the
# source, it stays at least at its height there.
CLEARANCE_CM = 1.3
# A swing is lowered less if the stances before and after it differ in height. At this difference, it is
# lowered 1 / e times as much as on flat ground.
UNEVEN_CM = 4.0
# Two steps differ by at least this height if they are on different steps of stairs. FOOT_CM: ankle to ball.
STAIR_CM, FOOT_CM = 5.0, 13.5
# The lower height of a swing is blended in over this share of its frames, and out over as many at its end.
BLEND_SHARE = 0.22


@dataclass(frozen=True)
class HurtFoot:
    """One foot over F source frames.

    ankle, ball: (F, 3) positions of the joints with the roles heel and toe, cm. rotation: (F, 4) of the foot
    in the world. toe_rotation: (F, 4) of the toe joint, local.
    """

    ankle: Array = field(repr=False)
    ball: Array = field(repr=False)
    rotation: Array = field(repr=False)
    toe_rotation: Array = field(repr=False)


def reduce_pitch(source: HealthyClip, effects: Effects, side: int) -> HurtFoot:
    """The source's foot with less pitch: turned about its ball while the heel is up, else about its ankle."""
    clip, skeleton = source.clip, source.clip.skeleton
    heel, toe = (skeleton.role(f"{SIDES[side]}_{role}") for role in ("heel", "toe"))
    ankle, ball, rotation = clip.positions[:, heel], clip.positions[:, toe], clip.global_rotations[:, heel]
    along = ball - ankle
    axis = _pitch_axis(rotation, along, ~source.swinging[:, side])
    ahead = np.cross(UP, axis)
    pitch = np.arctan2(np.sum(along * np.cross(axis, ahead), axis=1), np.sum(along * ahead, axis=1))
    stances = source.stances[side]
    middles = np.array([stance.middle for stance in stances])
    flat_pitch = np.interp(
        np.arange(len(clip)), middles, [_median_in_stance(pitch, stance) for stance in stances]
    )
    toe_up = pitch - flat_pitch  # radians; negative while the heel is up
    heel_up = smoothstep(-toe_up / BLEND_PITCH)  # 0..1
    push, strike = (effects.ratio(name)[:, side] for name in ("push", "strike"))
    # Toes also point down before landing, when they reach for the ground. This is reduced like a push-off.
    pitch_ratio = strike + (push - strike) * heel_up
    tilt = quat.from_axis_angle(axis, toe_up * (pitch_ratio - 1))
    new_along = quat.rotate(tilt, along)
    # While the heel is up, the ankle moves so that the ball stays in its place.
    ankle = ankle + np.where(toe_up < 0, 1.0, 0.0)[:, None] * (along - new_along)
    ankle = ankle - UP * _push_off_lowering(source, ball[:, 1], push, side)[:, None]
    # The toe joint bends less, too: its rotation is closer to its mean over about a second.
    mean_rotation = quat.normalize(gaussian(quat.continuous(clip.rotations[:, toe]), 0.5 * clip.fps))
    toe_rotation = quat.slerp(mean_rotation, clip.rotations[:, toe], pitch_ratio)
    return HurtFoot(ankle, ankle + new_along, quat.mul(tilt, rotation), toe_rotation)


def _push_off_lowering(source: HealthyClip, ball: Array, push: Array, side: int) -> Array:
    """(F,) cm by which a foot with less push-off is lower.

    A healthy foot rolls over its toes, so its ball rises before the foot leaves the ground. With less
    push-off, the ball rises less. Over the swing, the foot returns to its old height. ball: (F,) height of
    the ball, cm. push: (F,) ratio of the push-off.
    """
    lowering, stances = np.zeros(len(ball)), source.stances[side]
    for stance, following in itertools.zip_longest(stances, stances[1:]):
        middle, off = int(stance.middle), int(stance.off)
        frames = slice(middle, off + 1)
        rise = np.maximum.accumulate(np.maximum(ball[frames] - _median_in_stance(ball, stance), 0.0))
        lowering[frames] = (1 - push[frames]) * rise
        if following and following.land > off:
            land = int(following.land)
            lowering[off : land + 1] = lowering[off] * smoothstep(np.linspace(1.0, 0.0, land + 1 - off))
    return lowering


def _pitch_axis(rotation: Array, along: Array, stands: np.ndarray) -> Array:
    """(F, 3) unit axis about which the foot pitches. Positive angles raise the toe.

    The axis is fixed in the foot: on average over the standing foot, it is horizontal and across the foot.
    rotation: (F, 4) of the foot. along: (F, 3) from ankle to ball. stands: (F,) bool.
    """
    across = np.cross(along, UP)
    size = np.linalg.norm(across, axis=1)
    not_steep = size > 0.3 * np.linalg.norm(along, axis=1)  # a steep foot tells little about its axis
    across_in_foot = quat.rotate(quat.inv(rotation), across)[stands & not_steep]
    mean_axis = across_in_foot.sum(axis=0) if len(across_in_foot) else np.array([-1.0, 0.0, 0.0])
    return quat.rotate(rotation, mean_axis / max(float(np.linalg.norm(mean_axis)), 1e-9))


def _median_in_stance(values: Array, stance: SourceStance) -> Array:
    """Median of values (F, ...) over the middle half of a stance."""
    first = stance.land + 0.25 * (stance.off - stance.land)
    last = stance.land + 0.75 * (stance.off - stance.land)
    return np.median(values[int(first) : int(np.ceil(last)) + 1], axis=0)


def footprints_of(foot: HurtFoot, stances: list[SourceStance]) -> list[Array]:
    """The footprint of each stance: the position (3,) of the ankle, cm."""
    return [_median_in_stance(foot.ankle, stance) for stance in stances]


def place_footprints(
    source: HealthyClip, effects: Effects, path: ShortenedPath, feet: Sequence[HurtFoot]
) -> list[list[Array]]:
    """The new footprints of both feet that `reduce_pitch` returned: a position (3,), cm, for each stance."""
    return [
        [
            _new_footprint(old, stance.middle, source, effects, path, side)
            for old, stance in zip(footprints_of(feet[side], stances), stances, strict=True)
        ]
        for side, stances in enumerate(source.stances)
    ]


def join_steps(
    source: HealthyClip, effects: Effects, feet: Sequence[HurtFoot], footprints: list[list[Array]]
) -> None:
    """Let a body with a badly hurt leg go step by step on stairs. Changes heights in `footprints`.

    Up the stairs the good foot goes first, and the hurt foot joins it on the same step. Down the stairs the
    hurt foot goes first, and the good foot joins it.
    """
    old = [footprints_of(foot, stances) for foot, stances in zip(feet, source.stances, strict=True)]
    # On stairs a foot stands level. On a slope its toe is higher or lower than its ankle.
    toes = [
        [float(_median_in_stance(foot.ball - foot.ankle, stance)[1]) for stance in stances]
        for foot, stances in zip(feet, source.stances, strict=True)
    ]
    level = [float(np.median(heights)) for heights in toes]
    events = sorted((s.middle, side, i) for side in (0, 1) for i, s in enumerate(source.stances[side]))
    for (_, side, i), (when, next_side, k) in itertools.pairwise(events):
        step = old[next_side][k] - old[side][i]
        forward, rise = float(np.hypot(step[0], step[2])), float(step[1])
        tilt = abs(toes[next_side][k] - level[next_side]) / FOOT_CM
        if next_side == side or abs(rise) < STAIR_CM or tilt > 0.5 * abs(rise) / max(forward, FOOT_CM):
            continue
        join = effects.changes["join"][min(round(when), len(source) - 1)]
        hurt = int(join[1] > join[0])
        if (next_side == hurt) == (rise > 0):
            share = min(float(abs(join[1] - join[0])), 1.0)
            here, there = footprints[side][i], footprints[next_side][k]
            there[1] += share * (here[1] - there[1])


def move_foot(
    source: HealthyClip, effects: Effects, foot: HurtFoot, new_footprints: list[Array], side: int
) -> HurtFoot:
    """The foot that `reduce_pitch` returned, moved to new footprints, one for each stance."""
    stances = source.stances[side]
    old_footprints = footprints_of(foot, stances)
    yaw = quat.yaw(np.radians(OUTWARD_SIGN[side] * effects.changes["toe_out"][:, side]))
    ankle, least_ball = np.empty_like(foot.ankle), np.empty(len(source))
    ball = source.clip.positions[:, source.clip.skeleton.role(f"{SIDES[side]}_toe"), 1]
    # Of each stance: height of the ball in the source, cm by which the footprint rises, first and last frame.
    soles = [float(_median_in_stance(ball, stance)) for stance in stances]
    rises = [float(new[1] - old[1]) for old, new in zip(old_footprints, new_footprints, strict=True)]
    spans = [(int(stance.land), int(stance.off)) for stance in stances]
    for (first, last), old, new, sole, rise in zip(
        spans, old_footprints, new_footprints, soles, rises, strict=True
    ):
        frames = slice(first, last + 1)
        least_ball[frames] = sole + rise + np.minimum(ball[frames] - sole, 0.0)
        ankle[frames] = new + quat.rotate(yaw[frames], foot.ankle[frames] - old)
    along = quat.rotate(yaw, foot.ball - foot.ankle)
    lift = effects.ratio("lift")[:, side]
    out = effects.changes["out"][:, side] * source.leg_length * OUTWARD_SIGN[side]
    outward = quat.rotate(source.heading, np.array([1.0, 0.0, 0.0])) * out[:, None]
    for i, ((_, off), (land, _)) in enumerate(itertools.pairwise(spans)):
        if land - off < 2:
            continue
        frames = slice(off, land + 1)
        progress = _progress(foot.ankle[frames])
        # The ankle keeps its distance from the straight line between two footprints, but the line moves.
        line = foot.ankle[off] + (foot.ankle[land] - foot.ankle[off]) * progress
        swing = ankle[off] + (ankle[land] - ankle[off]) * progress + foot.ankle[frames] - line
        u = np.linspace(0.0, 1.0, land - off + 1)  # share of the swing's time
        blend = smoothstep(u / BLEND_SHARE) * smoothstep((1 - u) / BLEND_SHARE)
        evenness = np.exp(-abs(foot.ankle[land, 1] - foot.ankle[off, 1]) / UNEVEN_CM)
        swing[:, 1] -= (1 - lift[frames]) * evenness * blend * (foot.ankle[frames, 1] - line[:, 1])
        swing += outward[frames] * (np.sin(np.pi * u) ** 2)[:, None]
        ground = soles[i] + (soles[i + 1] - soles[i]) * progress[:, 0]
        rise_in_swing = rises[i] + (rises[i + 1] - rises[i]) * progress[:, 0]
        above = ball[frames] - ground
        clearance = np.minimum(above, CLEARANCE_CM * np.sin(np.pi * u))
        least_ball[frames] = ground + rise_in_swing + clearance
        ankle[frames] = swing
    # Raise the foot where its ball would be too low.
    ankle[:, 1] += smooth_above(np.maximum(least_ball - ankle[:, 1] - along[:, 1], 0.0), 1)
    return HurtFoot(ankle, ankle + along, quat.mul(yaw, foot.rotation), foot.toe_rotation)


def _progress(ankle: Array) -> Array:
    """(n, 1) progress of a swing in each frame, from 0 to 1.

    In long swings it is mainly the share of the horizontal distance that the ankle has covered. In short
    swings it is mainly the share of the time that has passed. ankle: (n, 3).
    """
    over_ground = ankle * [1, 0, 1]
    whole = over_ground[-1] - over_ground[0]
    time = smoothstep(np.linspace(0.0, 1.0, len(ankle)))
    time_weight = SHORT_SWING_CM**2  # the share of the distance has the weight whole @ whole
    covered = (over_ground - over_ground[0]) @ whole
    return ((covered + time_weight * time) / (whole @ whole + time_weight))[:, None]


def _new_footprint(
    old: Array, when: float, source: HealthyClip, effects: Effects, path: ShortenedPath, side: int
) -> Array:
    """The new position (3,) of a footprint that is at `old` (3,) in source frame `when`, cm.

    Footprints move with the body. Besides, the hurt foot lands less far ahead, and the feet land further
    apart sideways.
    """
    nearest = min(round(when), len(source) - 1)
    # Only the frames around `when` are read, because a long clip has thousands of footprints.
    near = slice(max(nearest - 1, 0), nearest + 2)
    velocity = (
        np.gradient(source.path[near], axis=0)[nearest - near.start] if len(source) > 1 else np.zeros(2)
    )
    step = effects.changes["step"][near]
    change = interpolate_curve(step[:, side] - step[:, 1 - side], when - near.start)
    # A step lasts half a cycle. Half of its change is made by this foot, the other half by the other foot.
    ahead = change / 2 * velocity * source.cycle_frames[nearest] / 2
    widening = interpolate_curve(effects.changes["width"][near].max(axis=1), when - near.start)
    width = widening * source.leg_length / 2
    outward = quat.rotate(source.heading[nearest], np.array([OUTWARD_SIGN[side] * width, 0.0, 0.0]))
    return path.move_point(old, when) + np.array([ahead[0], 0.0, ahead[1]]) + outward


# Sets the height of the hips so that the standing knee has the desired bend, and places the knees.
#
# The ankle is the joint with the role heel.


# Radians of knee flexion. Below the first value, the bend is too small to tell in which direction the knee
# points. Above the second value, the bend is large enough. Between them, it counts partly.
BENT = np.radians([6.0, 18.0])
STRETCH = (0.985, 0.9985)  # least and greatest value of `Leg.longest_reach`, in leg lengths
# For the height of the hips, the horizontal distance between hip and ankle counts as at most this share of
# the leg's length. Otherwise there would be no height at which a leg reaches a foot that is too far away.
LEVEL_SHARE = 0.97


@dataclass(frozen=True)
class Leg:
    """A leg of the healthy clip, over F frames.

    reach: (F,) cm from hip to ankle. thigh, shank: (F, 4) rotations relative to the pelvis. hinge: (F, 3)
    axis about which the knee bends, relative to the pelvis. thigh_length, shank_length: cm.
    """

    reach: Array = field(repr=False)
    thigh: Array = field(repr=False)
    shank: Array = field(repr=False)
    hinge: Array = field(repr=False)
    thigh_length: float
    shank_length: float

    @property
    def longest_reach(self) -> float:
        """The largest distance from hip to ankle that is allowed, cm."""
        length = self.thigh_length + self.shank_length
        return float(np.clip(self.reach.max(), STRETCH[0] * length, STRETCH[1] * length))


def read_leg(clip: Clip, side: int) -> Leg:
    """Measure a leg in each frame.

    In frames in which the leg is nearly straight, the direction of its knee is taken from the other frames.
    """
    skeleton = clip.skeleton
    hip, knee, ankle = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel"))
    positions = clip.positions
    hip_to_ankle = positions[:, ankle] - positions[:, hip]
    reach = np.linalg.norm(hip_to_ankle, axis=1)
    along = hip_to_ankle / np.maximum(reach, 1e-9)[:, None]
    # How far the knee is from the straight line between hip and ankle, and in which direction.
    hip_to_knee = positions[:, knee] - positions[:, hip]
    aside = hip_to_knee - along * np.sum(hip_to_knee * along, axis=1, keepdims=True)
    size = np.linalg.norm(aside, axis=1, keepdims=True)
    upper, lower = (float(np.linalg.norm(skeleton.offsets[j])) for j in (knee, ankle))
    bend = knee_flexion(reach, upper, lower)
    certainty = np.clip((bend - BENT[0]) / (BENT[1] - BENT[0]), 0.0, 1.0)[:, None]
    thigh = clip.global_rotations[:, hip]
    in_thigh = quat.rotate(quat.inv(thigh), aside / np.maximum(size, 1e-9))
    bends = certainty.sum() > 5  # frames
    usual = np.sum(in_thigh * certainty, axis=0) if bends else _foot_direction(clip, side, thigh)
    usual = usual / max(float(np.linalg.norm(usual)), 1e-9)
    knee_direction = quat.rotate(thigh, in_thigh * certainty + usual * (1 - certainty))
    to_pelvis = quat.inv(clip.global_rotations[:, skeleton.role("hips")])
    return Leg(
        reach,
        quat.mul(to_pelvis, thigh),
        quat.mul(to_pelvis, clip.global_rotations[:, knee]),
        quat.rotate(to_pelvis, np.cross(knee_direction, along)),
        upper,
        lower,
    )


def _foot_direction(clip: Clip, side: int, thigh: Array) -> Array:
    """(3,) mean direction from heel to toe in the coordinates of the thigh.

    A knee that never bends is assumed to point in this direction.
    """
    heel, toe = (clip.skeleton.role(f"{SIDES[side]}_{r}") for r in ("heel", "toe"))
    return np.mean(quat.rotate(quat.inv(thigh), clip.positions[:, toe] - clip.positions[:, heel]), axis=0)


def knee_flexion(reach: Array, upper: float, lower: float) -> Array:
    """(...) radians of knee flexion, 0 if straight, by the law of cosines.

    reach: (...) distance from hip to ankle. upper, lower: lengths of thigh and shank. All are in cm.
    """
    cosine = (reach**2 - upper**2 - lower**2) / (2 * upper * lower)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def reach_at_flexion(flexion: Array, upper: float, lower: float) -> Array:
    """(...) cm from hip to ankle at a knee flexion (...) in radians: the inverse of `knee_flexion`."""
    return np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(flexion))


def hips_height(
    root: Array,
    hips: list[Array],
    ankles: list[Array],
    reaches: list[Array],
    stands: list[Array],
    longest: list[float],
) -> Array:
    """(N,) heights of the root, cm, at which standing legs have their desired length.

    root: (N, 3) positions before the change. Each list holds one entry for each leg. hips: (N, 3) position of
    the hip joint relative to the root. ankles: (N, 3) positions in the world. reaches: (N,) desired distance
    from hip to ankle while the leg stands, cm. stands: (N,) from 0 (swings) to 1 (stands). longest: the leg's
    `Leg.longest_reach`. No leg gets longer than this.
    """
    # Each standing leg asks for a change of the root's height. The root gets their weighted mean, smoothed.
    weighted_change = np.zeros(len(root))
    weight = np.full(len(root), 1e-9)
    for hip, ankle, reach, stand in zip(hips, ankles, reaches, stands, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level_squared = np.minimum(np.sum(apart**2, axis=1), (LEVEL_SHARE * reach) ** 2)
        change = ankle[:, 1] + np.sqrt(reach**2 - level_squared) - hip[:, 1] - root[:, 1]
        weighted_change += stand * change
        weight += stand
    height = root[:, 1] + gaussian(weighted_change, 3.0) / gaussian(weight, 3.0)
    # Lower the root where a leg would still be longer than `longest`.
    excess = np.zeros(len(root))
    for hip, ankle, length in zip(hips, ankles, longest, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level_squared = np.minimum(np.sum(apart**2, axis=1), (LEVEL_SHARE * length) ** 2)
        excess = np.maximum(excess, height + hip[:, 1] - ankle[:, 1] - np.sqrt(length**2 - level_squared))
    return height - smooth_above(np.maximum(excess, 0.0), 2)


def place_leg(
    skeleton: Skeleton, side: int, leg: Leg, when: Array, pelvis: Array, hip: Array, ankle: Array
) -> tuple[Array, Array]:
    """World rotations of thigh and of shank, (N, 4) each, with which the leg reaches from `hip` to `ankle`.

    when: (N,) frames of the healthy clip, with fractions. The rotations and the direction of the knee in
    these frames are kept as far as the new positions allow. pelvis: (N, 4) world rotations. hip, ankle:
    (N, 3) positions in the world.
    """
    bones = [skeleton.offsets[skeleton.role(f"{SIDES[side]}_{r}")] for r in ("knee", "heel")]
    thigh, shank = (
        quat.mul(pelvis, interpolate_rotations(rotations, when)) for rotations in (leg.thigh, leg.shank)
    )
    hinge = quat.rotate(pelvis, interpolate_values(leg.hinge, when))
    knee, end = two_bone_knee(hip, ankle, np.cross(ankle - hip, hinge), leg.thigh_length, leg.shank_length)
    return _point_bone(thigh, hinge, bones[0], knee - hip), _point_bone(shank, hinge, bones[1], end - knee)


def _point_bone(world: Array, hinge: Array, bone: Array, along: Array) -> Array:
    """Turn world rotations (N, 4) of a bone so that it points along `along` (N, 3).

    bone: (3,) vector of the bone at rest. hinge: (N, 3) axis of the knee in the world. The bone's angle to
    this axis may change, but the bone does not roll against the axis.
    """
    turn = bone_axes(along, hinge) @ np.swapaxes(bone_axes(quat.rotate(world, bone), hinge), -1, -2)
    return quat.mul(quat.from_matrix(turn), world)
