"""Changes path and feet of a healthy clip (the source): makes steps shorter, the roll over the toe smaller,
and swings lower or wider.

All arrays over frames have the F frames of the source.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.smooth import beside_chord, gaussian, interpolate_curve, smooth_above, smoothstep
from hobble.hurt.effects import SIDES, Effects
from hobble.hurt.healthy_clip import FORWARD, UP, HealthyClip, SourceStance

SLOPE_SECONDS = 0.3  # sigma of the Gaussian that smooths the height of the ground over time
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
# A swing is lowered less if the next stance is higher or lower than the slope of the ground explains. At this
# difference, it is lowered 1 / e times as much as on flat ground.
UNEVEN_CM = 4.0
# Two steps differ by at least this height if they are on different steps of stairs. FOOT_CM: ankle to ball.
STAIR_CM, FOOT_CM = 5.0, 13.5
# Least distance of the ankles in a step to another step of stairs: its edge is between them. On short treads
# it is SHORT_LEAD_CM, and the other foot comes beside the first one, if it would be BESIDE_CM ahead of it.
LEAD_CM, SHORT_LEAD_CM, BESIDE_CM = 40.0, 25.0, 16.0
# Ground that rises or falls by these shares of the way is stairs, of which a healthy step takes one each.
# Bodies that move by less than LEAST_WAY cm a frame stand.
STAIRS, LEAST_WAY = (0.3, 0.4), 0.2
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


def shorten(
    source: HealthyClip, effects: Effects, stride_ratio: Array, ground: Array, step_by_step: Array
) -> Array:
    """(F, 3) by how much the body moves, cm, if its path gets shorter so that its speed is that of `effects`.

    stride_ratio: (F,) new duration of a stride / old duration. ground: (F,) height of the ground below the
    body. Climbs and descents shrink like the path, so that slopes keep their angle. step_by_step: (F,) from
    `one_tread_a_stride`.
    """
    path = np.stack([source.path[:, 0], ground, source.path[:, 1]], axis=1)
    share = effects.ratio("speed") * stride_ratio  # length of a stride = speed * duration
    share = (share + step_by_step * (0.5 - share))[:, None]
    steps = np.diff(path, axis=0) * (share[1:] + share[:-1]) / 2
    return path[:1] + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]) - path


def one_tread_a_stride(effects: Effects, slope: Array) -> Array:
    """(F,) 0 to 1, how much a stride goes from one tread of steep stairs to the next, not over two.

    So a body with a badly hurt leg makes half of the way. slope: (F,) from `slope_below`.
    """
    return smoothstep((slope - STAIRS[0]) / (STAIRS[1] - STAIRS[0])) * np.abs(_right_joins(effects))


def _right_joins(effects: Effects) -> Array:
    """(F,) how much a body goes step by step: up to 1 with a hurt right leg, down to -1 with a left one."""
    return np.clip(effects.changes["join"][:, 1] - effects.changes["join"][:, 0], -1.0, 1.0)


def ground_below(source: HealthyClip, feet: Sequence[HurtFoot]) -> Array:
    """(F,) height of the ground below the body, cm, from the footprints of both feet.

    The median height of each foot counts as 0. Otherwise, if one ankle is higher than the other in stance,
    flat ground would seem to rise and fall with each step.
    """
    points: list[tuple[float, float]] = []
    for foot, stances in zip(feet, source.stances, strict=True):
        heights = np.array([footprint[1] for footprint in footprints_of(foot, stances)])
        points += zip((stance.middle for stance in stances), heights - np.median(heights), strict=True)
    when, height = np.array(sorted(points)).T
    return gaussian(np.interp(np.arange(len(source)), when, height), SLOPE_SECONDS * source.clip.fps)


def slope_below(source: HealthyClip, ground: Array) -> Array:
    """(F,) rise or fall of the ground (F,) below the body, as a share of the way; 0 if the body stands."""
    way = np.linalg.norm(np.gradient(source.path, axis=0), axis=1)
    return np.abs(np.gradient(ground)) / np.maximum(way, LEAST_WAY)


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
    middles, in_stance = zip(*((s.middle, _median_in_stance(pitch, s)) for s in stances), strict=True)
    flat_pitch = np.interp(np.arange(len(clip)), middles, in_stance)
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
        off = stance.off
        frames = slice(int(stance.middle), off + 1)
        rise = np.maximum.accumulate(np.maximum(ball[frames] - _median_in_stance(ball, stance), 0.0))
        lowering[frames] = (1 - push[frames]) * rise
        if following and (land := following.land) > off:
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
    first, last = (stance.land + share * (stance.off - stance.land) for share in (0.25, 0.75))
    return np.median(values[int(first) : int(np.ceil(last)) + 1], axis=0)


def _tilts(foot: HurtFoot, stances: list[SourceStance]) -> Array:
    """The slope of the foot in each stance: rise of the toe over the foot's length.

    On stairs a foot stands level. On a slope its toe is higher or lower than usual.
    """
    toes = np.array([_median_in_stance(foot.ball - foot.ankle, stance)[1] for stance in stances])
    return np.asarray((toes - np.median(toes)) / FOOT_CM)


def footprints_of(foot: HurtFoot, stances: list[SourceStance]) -> list[Array]:
    """The footprint of each stance: the position (3,) of the ankle, cm."""
    return [_median_in_stance(foot.ankle, stance) for stance in stances]


def place_footprints(
    source: HealthyClip, effects: Effects, shift: Array, feet: Sequence[HurtFoot]
) -> list[list[Array]]:
    """The new footprints of both feet that `reduce_pitch` returned: a position (3,), cm, for each stance.

    Footprints move with the body, by `shift` (F, 3). Besides, the hurt foot lands less far ahead, and further
    out: the body stays over the sound leg.
    """
    velocity = np.gradient(source.path, axis=0)
    placed: list[list[Array]] = []
    for side, stances in enumerate(source.stances):
        step = effects.changes["step"][:, side] - effects.changes["step"][:, 1 - side]
        placed.append([])
        for stance, old in zip(stances, footprints_of(feet[side], stances), strict=True):
            when, nearest = stance.middle, min(round(stance.middle), len(source) - 1)
            moved = old + np.array([interpolate_curve(curve, when) for curve in shift.T])
            # A step lasts half a cycle. Half of its change is made by this foot, the other half by the other.
            change = interpolate_curve(step, when)
            ahead = change / 2 * velocity[nearest] * source.cycle_frames[nearest] / 2
            width = interpolate_curve(effects.changes["width"][:, side], when) * source.leg_length
            outward = quat.rotate(source.heading[nearest], np.array([OUTWARD_SIGN[side] * width, 0.0, 0.0]))
            placed[side].append(moved + np.array([ahead[0], 0.0, ahead[1]]) + outward)
    return placed


def join_steps(
    source: HealthyClip,
    effects: Effects,
    feet: Sequence[HurtFoot],
    footprints: list[list[Array]],
    step_by_step: Array,
) -> None:
    """Let a body with a badly hurt leg go step by step on stairs. Changes `footprints`.

    Up the stairs the good foot goes first, and the hurt foot joins it on the same step. Down the stairs the
    hurt foot goes first, and the good foot joins it. step_by_step: (F,) from `one_tread_a_stride`.
    """
    old = [footprints_of(foot, stances) for foot, stances in zip(feet, source.stances, strict=True)]
    tilts = [_tilts(foot, stances) for foot, stances in zip(feet, source.stances, strict=True)]
    events = sorted((s.middle, side, i) for side in (0, 1) for i, s in enumerate(source.stances[side]))
    join = _right_joins(effects)
    joined = False  # whether the last step was joined: then the next one goes to another step of the stairs
    for (_, side, i), (when, next_side, k) in itertools.pairwise(events):
        step, frame = old[next_side][k] - old[side][i], min(round(when), len(source) - 1)
        forward, rise = float(np.hypot(step[0], step[2])), float(step[1])
        tilt = abs(tilts[next_side][k])
        share, hurt = abs(float(join[frame])), int(join[frame] > 0)
        here, there = footprints[side][i], footprints[next_side][k]
        stairs = next_side != side and abs(rise) >= STAIR_CM
        stairs &= tilt <= 0.5 * abs(rise) / max(forward, FOOT_CM)
        ahead = quat.rotate(source.heading[frame], FORWARD)
        before, beside = float((there - here) @ ahead), step_by_step[frame]
        if joins := stairs and (next_side == hurt) == (rise > 0):
            there[1] += share * (here[1] - there[1])
            there -= beside * min(before, max(before / 2, BESIDE_CM)) * ahead
        elif stairs or joined:
            least = LEAD_CM + beside * (SHORT_LEAD_CM - LEAD_CM)
            there += share * max(least - before, 0.0) * ahead
        joined = joins


def move_foot(
    source: HealthyClip,
    effects: Effects,
    foot: HurtFoot,
    new_footprints: list[Array],
    shift: Array,
    side: int,
) -> HurtFoot:
    """The foot that `reduce_pitch` returned, moved to new footprints, one for each stance.

    shift: (F, 3) by how much the body moves, cm, from `shorten`.
    """
    stances = source.stances[side]
    old_footprints = footprints_of(foot, stances)
    yaw = quat.yaw(np.radians(OUTWARD_SIGN[side] * effects.changes["toe_out"][:, side]))
    ankle, least_ball = np.empty_like(foot.ankle), np.empty(len(source))
    ball = source.clip.positions[:, source.clip.skeleton.role(f"{SIDES[side]}_toe"), 1]
    # Of each stance: height of the ball in the source, cm by which the footprint rises.
    soles = [float(_median_in_stance(ball, stance)) for stance in stances]
    rises = [float(new[1] - old[1]) for old, new in zip(old_footprints, new_footprints, strict=True)]
    for stance, old, new, sole, rise in zip(
        stances, old_footprints, new_footprints, soles, rises, strict=True
    ):
        frames = slice(stance.land, stance.off + 1)
        least_ball[frames] = sole + rise + np.minimum(ball[frames] - sole, 0.0)
        ankle[frames] = new + quat.rotate(yaw[frames], foot.ankle[frames] - old)
    along = quat.rotate(yaw, foot.ball - foot.ankle)
    # To the side and backward a healthy knee bends little, so a limp shows only if the foot is lifted less.
    lift, tilts = effects.ratio("lift")[:, side] ** (1 + 2 * source.aside), _tilts(foot, stances)
    out = effects.changes["out"][:, side] * source.leg_length * OUTWARD_SIGN[side]
    outward = quat.rotate(source.heading, np.array([1.0, 0.0, 0.0])) * out[:, None]
    for i, (here, there) in enumerate(itertools.pairwise(stances)):
        off, land = here.off, there.land
        if land - off < 2:
            continue
        frames = slice(off, land + 1)
        progress = _progress(foot.ankle[frames])
        # The ankle keeps its distance from the straight line between two footprints, but the line moves.
        line = foot.ankle[off] + (foot.ankle[land] - foot.ankle[off]) * progress
        swing = ankle[off] + (ankle[land] - ankle[off]) * progress + foot.ankle[frames] - line
        # In a turn, a foot swings along an arc. It gets narrower as the arc of the body does.
        swing[:, [0, 2]] += beside_chord(shift[:, [0, 2]], here.middle, there.middle, progress[:, 0])[0]
        u = np.linspace(0.0, 1.0, land - off + 1)  # share of the swing's time
        blend = smoothstep(u / BLEND_SHARE) * smoothstep((1 - u) / BLEND_SHARE)
        step = foot.ankle[land] - foot.ankle[off]
        sloping = (tilts[i] + tilts[i + 1]) / 2 * np.hypot(step[0], step[2])
        evenness = np.exp(-min(abs(step[1]), abs(step[1] - sloping)) / UNEVEN_CM)
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
