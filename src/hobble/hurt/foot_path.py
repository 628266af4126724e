"""Moves the feet: shorter steps, less roll over the toe, a lower or wider swing.

All arrays have the frames of the healthy clip (the source).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.curve_value import value_at
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, smooth_above
from hobble.hurt.body_parts import SIDES
from hobble.hurt.effects import Effects
from hobble.hurt.healthy_clip import UP, HealthyClip, SourceStance
from hobble.hurt.interpolate import smoothstep
from hobble.hurt.shortened_path import ShortenedPath

SIGN = (1.0, -1.0)  # sign of X on the left and on the right side of the figure
# The foot's pitch is multiplied by the effect `strike` while its toe is up, by `push` while its heel is up.
# The factor changes from `strike` to `push` as the heel rises by this angle, radians.
BLEND_PITCH = np.radians(8.0)
# The progress of a swing is measured mainly by time if its distance is shorter than this, else mainly by the
# distance that is covered.
SHORT_SWING_CM = 12.0
# In mid-swing the toe joint stays at least this much above its height in stance, or at its height in the
# source if this is lower.
CLEARANCE_CM = 1.3
# A swing is lowered less if the stances before and after it differ in height: at this difference, 1 / e times
# as much as on flat ground.
UNEVEN_CM = 4.0
JOGGING = 0.65  # in a jog, the change of a step's length is smaller by this share
# The lower height of a swing is blended in over this share of its frames, and out over as many at its end.
BLEND_SHARE = 0.22


@dataclass(frozen=True)
class HurtFoot:
    """One foot over F source frames.

    ankle, ball: (F, 3) positions of the joints with the roles heel and toe, cm. turn: (F, 4) rotation of the
    foot in the world. toes: (F, 4) local rotation of the toe joint.
    """

    ankle: Array = field(repr=False)
    ball: Array = field(repr=False)
    turn: Array = field(repr=False)
    toes: Array = field(repr=False)


def rolled_foot(source: HealthyClip, effects: Effects, side: int) -> HurtFoot:
    """The source's foot with less pitch: turned about its ball while the heel is up, else about its ankle."""
    clip, skeleton = source.clip, source.clip.skeleton
    heel, toe = (skeleton.role(f"{SIDES[side]}_{role}") for role in ("heel", "toe"))
    ankle, ball, turn = clip.positions[:, heel], clip.positions[:, toe], clip.global_rotations[:, heel]
    along = ball - ankle
    axis = _hinge(turn, along, ~source.swinging[:, side])
    ahead = np.cross(UP, axis)
    pitch = np.arctan2(np.sum(along * np.cross(axis, ahead), axis=1), np.sum(along * ahead, axis=1))
    middles = np.array([s.middle for s in source.stances[side]])
    flat = np.interp(np.arange(len(clip)), middles, [_middle(pitch, s) for s in source.stances[side]])
    raised = pitch - flat
    heel_up = smoothstep(-raised / BLEND_PITCH)
    push, strike = (effects.ratio(name)[:, side] for name in ("push", "strike"))
    # Toes also point down before landing, when they reach for the ground. This is reduced like a push-off.
    pitch_ratio = strike + (push - strike) * heel_up
    tilt = quat.from_axis_angle(axis, raised * (pitch_ratio - 1))
    new_along = quat.rotate(tilt, along)
    ankle = ankle + np.where(raised < 0, 1.0, 0.0)[:, None] * (along - new_along)
    ankle = ankle - UP * _lowered_push_off(source, ball[:, 1], push, side)[:, None]
    rest = quat.normalize(gaussian(quat.continuous(clip.rotations[:, toe]), 0.5 * clip.fps))
    toes = quat.slerp(rest, clip.rotations[:, toe], pitch_ratio)
    return HurtFoot(ankle, ankle + new_along, quat.mul(tilt, turn), toes)


def _lowered_push_off(source: HealthyClip, ball: Array, push: Array, side: int) -> Array:
    """(F,) cm by which a foot with less push-off is lower.

    A healthy foot rolls over its toes, so its ball rises before the foot leaves the ground. ball: (F,) height
    of the ball. push: (F,) ratio of the push-off. The difference fades over the swing.
    """
    lower, stances = np.zeros(len(ball)), source.stances[side]
    for stance, following in itertools.zip_longest(stances, stances[1:]):
        middle, off = int(stance.middle), int(stance.off)
        part = slice(middle, off + 1)
        rise = np.maximum.accumulate(np.maximum(ball[part] - _middle(ball, stance), 0.0))
        lower[part] = (1 - push[part]) * rise
        if following and following.land > off:
            land = int(following.land)
            lower[off : land + 1] = lower[off] * smoothstep(np.linspace(1.0, 0.0, land + 1 - off))
    return lower


def _hinge(turn: Array, along: Array, stands: np.ndarray) -> Array:
    """(F, 3) axis of the foot's pitch, positive for toe up: horizontal and across a standing foot.

    turn: (F, 4) rotation of the foot. along: (F, 3) from ankle to ball. stands: (F,) bool.
    """
    across = np.cross(along, UP)
    size = np.linalg.norm(across, axis=1)
    in_foot = quat.rotate(quat.inv(turn), across)[stands & (size > 0.3 * np.linalg.norm(along, axis=1))]
    usual = in_foot.sum(axis=0) if len(in_foot) else np.array([-1.0, 0.0, 0.0])
    return quat.rotate(turn, usual / max(float(np.linalg.norm(usual)), 1e-9))


def _middle(values: Array, stance: SourceStance) -> Array:
    """Median of values (F, ...) over the middle half of a stance."""
    a, b = stance.land + 0.25 * (stance.off - stance.land), stance.land + 0.75 * (stance.off - stance.land)
    return np.median(values[int(a) : int(np.ceil(b)) + 1], axis=0)


def ankle_places(foot: HurtFoot, stances: list[SourceStance]) -> list[Array]:
    """For each stance, where the ankle is, (3,)."""
    return [_middle(foot.ankle, stance) for stance in stances]


def move_foot(
    source: HealthyClip, effects: Effects, path: ShortenedPath, foot: HurtFoot, side: int
) -> HurtFoot:
    """The foot that `rolled_foot` returned, moved so that it follows the body's new path."""
    stances = source.stances[side]
    old = ankle_places(foot, stances)
    new = [
        _moved(place, s.middle, source, effects, path, side) for place, s in zip(old, stances, strict=True)
    ]
    yaw = quat.yaw(np.radians(SIGN[side] * effects.sided["toe_out"][:, side]))
    ankle, least_ball = np.empty_like(foot.ankle), np.empty(len(source))
    ball = source.clip.positions[:, source.clip.skeleton.role(f"{SIDES[side]}_toe"), 1]
    soles = [float(_middle(ball, stance)) for stance in stances]
    rises = [float(b[1] - a[1]) for a, b in zip(old, new, strict=True)]
    spans = [(int(s.land), int(s.off)) for s in stances]
    for (first, last), place, new_place, sole, rise in zip(spans, old, new, soles, rises, strict=True):
        part = slice(first, last + 1)
        least_ball[part] = sole + rise + np.minimum(ball[part] - sole, 0.0)
        ankle[part] = new_place + quat.rotate(yaw[part], foot.ankle[part] - place)
    along = quat.rotate(yaw, foot.ball - foot.ankle)
    lift = effects.ratio("lift")[:, side]
    out = effects.sided["out"][:, side] * source.leg * SIGN[side]
    outward = quat.rotate(source.heading, np.array([1.0, 0.0, 0.0])) * out[:, None]
    for i, ((_, off), (land, _)) in enumerate(itertools.pairwise(spans)):
        if land - off < 2:
            continue
        part = slice(off, land + 1)
        progress = _progress(foot.ankle[part])
        line = foot.ankle[off] + (foot.ankle[land] - foot.ankle[off]) * progress
        moved = ankle[off] + (ankle[land] - ankle[off]) * progress + foot.ankle[part] - line
        u = np.linspace(0.0, 1.0, land - off + 1)
        edge = smoothstep(u / BLEND_SHARE) * smoothstep((1 - u) / BLEND_SHARE)
        even = np.exp(-abs(foot.ankle[land, 1] - foot.ankle[off, 1]) / UNEVEN_CM)
        moved[:, 1] -= (1 - lift[part]) * even * edge * (foot.ankle[part, 1] - line[:, 1])
        moved += outward[part] * (np.sin(np.pi * u) ** 2)[:, None]
        ground = soles[i] + (soles[i + 1] - soles[i]) * progress[:, 0]
        up = rises[i] + (rises[i + 1] - rises[i]) * progress[:, 0]
        above = ball[part] - ground
        least_ball[part] = ground + up + np.minimum(above, CLEARANCE_CM * np.sin(np.pi * u))
        ankle[part] = moved
    ankle[:, 1] += smooth_above(np.maximum(least_ball - ankle[:, 1] - along[:, 1], 0.0), 1)
    return HurtFoot(ankle, ankle + along, quat.mul(yaw, foot.turn), foot.toes)


def _progress(ankle: Array) -> Array:
    """(n, 1) progress of a swing in each frame, from 0 to 1.

    It is the covered share of the horizontal distance, and in short swings mainly that of the time.
    """
    over_ground = ankle * [1, 0, 1]
    whole = over_ground[-1] - over_ground[0]
    time = smoothstep(np.linspace(0.0, 1.0, len(ankle)))
    by_time = SHORT_SWING_CM**2
    return ((((over_ground - over_ground[0]) @ whole) + by_time * time) / (whole @ whole + by_time))[:, None]


def _moved(
    place: Array, when: float, source: HealthyClip, effects: Effects, path: ShortenedPath, side: int
) -> Array:
    """The new place (3,) of a footprint at `place` in source frame `when`.

    Footprints move with the body. Besides, the hurt foot lands less far ahead, and both feet land wider
    apart.
    """
    at = min(round(when), len(source) - 1)
    # Only the frames around `when` are read, because a long clip has thousands of footprints.
    near = slice(max(at - 1, 0), at + 2)
    speed = np.gradient(source.path[near], axis=0)[at - near.start] if len(source) > 1 else np.zeros(2)
    step = effects.sided["step"][near] * (1 - JOGGING * source.jog[near])[:, None]
    ahead = value_at(step[:, side] - step[:, 1 - side], when - near.start)
    ahead = ahead / 2 * speed * source.cycle[at] / 2
    width = value_at(effects.sided["width"][near].max(axis=1), when - near.start) * source.leg / 2
    outward = quat.rotate(source.heading[at], np.array([SIGN[side] * width, 0.0, 0.0]))
    return path.move_point(place, when) + np.array([ahead[0], 0.0, ahead[1]]) + outward
