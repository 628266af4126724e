"""Positions of the ankle and rotations of the foot: it rolls in stance and swings to the next stance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.curve_value import value_at
from hobble.core.quat import Array
from hobble.core.smooth import smooth_above
from hobble.synthetic.footsteps import FOOT, PlannedStance
from hobble.synthetic.planned_ground import Ground
from hobble.synthetic.style import Style

X_AXIS = np.array([1.0, 0.0, 0.0])
HEEL = np.array([0.0, -4.2, -3.0])  # cm from the ankle joint to the heel, approximately
READY = 0.95  # after this share of the swing, the foot has the pitch with which it lands
# Exponents of the time in a swing, which runs from 0 to 1. Because they are below 1, the foot is highest
# before the middle of the swing (KICK), and in the middle it has more than half of its way behind it (EARLY).
KICK, EARLY = 0.68, 0.81
FOLLOW = 0.45  # the swing begins with this share of the pitch rate at the end of the stance
LANDING_SPEED = 0.36  # speed of the foot as it lands, as a share of its mean speed in the swing
# Where the ground is in the way, the foot rises over it in the first RISE of the swing, and comes down in the
# last SETTLE (shares of the swing).
RISE, SETTLE = 0.36, 0.3
SOLE_HEIGHT = 2.0  # cm: heel, toe joint and toe tip count as this high above the sole


@dataclass(frozen=True)
class FootPoses:
    """One foot over F frames, in the world.

    ankle: (F, 3) position, cm. foot, toes: (F, 4) rotations.
    """

    ankle: Array
    foot: Array
    toes: Array


def move_foot(steps: list[PlannedStance], style: Style, side: int, ground: Ground) -> FootPoses:
    """The path of one foot through its stances, `steps`.

    side: LEFT or RIGHT of `hobble.synthetic.style`. Frames before the first landing, and from the last
    landing on, are not set: there positions are 0 and rotations the identity.
    """
    frames = len(style.duty)
    turns = np.tile(quat.IDENTITY, (frames, 1))
    foot = FootPoses(np.zeros((frames, 3)), turns, turns.copy())
    rest = np.radians(style.rest_pitch)
    rolls = [_Roll.of(step, style, side, rest) for step in steps]
    for i, (here, there) in enumerate(pairwise(rolls)):
        stays = not there.step.swings  # no swing to the next stance: the foot stands until then
        leave = there.step.land if stays else here.step.leave
        t = _frames(here.step.land, leave)
        pitch = here.pitch(t, lands=here.step.swings or i == 0, leaves=not stays)
        _stand(foot, t, here, pitch)
        if not stays:
            _swing(foot, here, there, style, side, ground)
    return foot


def _frames(start: float, end: float) -> np.ndarray:
    return np.arange(int(np.ceil(start)), int(np.ceil(end)))


@dataclass(frozen=True)
class _Roll:
    """A stance, and the pitch of the foot in it: the toe comes down, the foot is flat, then the heel goes up.

    land_pitch, off_pitch: radians, as the foot lands and as it leaves. rest: (F,) radians, the pitch of a
    standing foot; one array for all stances. flat, heel_off: shares of the stance after which the toe is down
    and the heel leaves the ground. power: exponent of the heel's rise over time.
    """

    step: PlannedStance
    land_pitch: float
    off_pitch: float
    rest: Array
    flat: float
    heel_off: float
    power: float

    @classmethod
    def of(cls, step: PlannedStance, style: Style, side: int, rest: Array) -> _Roll:
        land = value_at(style.land_pitch[:, side], step.land)
        off = value_at(style.off_pitch[:, side], step.leave)
        flat = value_at(style.flat, step.land)
        heel_off = value_at(style.heel_off[:, side], (step.land + step.leave) / 2)
        return cls(
            step,
            float(np.radians(land)),
            float(np.radians(off)),
            rest,
            float(flat),
            float(heel_off),
            float(value_at(style.roll, step.leave)),
        )

    def pitch(self, t: Array | float, lands: bool = True, leaves: bool = True) -> Array:
        """Radians, positive for toe up, at frames `t` in or just outside the stance.

        lands, leaves: whether the stance begins with a landing and ends with a swing. If not, the foot
        keeps the pitch of standing at that end.
        """
        u = (np.asarray(t, float) - self.step.land) / (self.step.leave - self.step.land)
        down = u / self.flat
        rise = np.clip((u - self.heel_off) / (1 - self.heel_off), 0, None)
        rest = value_at(self.rest, t)
        landing = (self.land_pitch - rest) * (1 - _ease(down)) if lands else 0.0
        return np.asarray(rest + landing + ((self.off_pitch - rest) * rise**self.power if leaves else 0.0))

    def toe(self, pitch: Array) -> Array:
        """(3,) position of the toe joint.

        It stands still while the heel is up, and moves on an arc about the ankle while the toe is up.
        """
        turned = quat.mul(self.step.turn, quat.from_axis_angle(X_AXIS, -np.maximum(pitch, 0.0)))
        return self.step.ankle + quat.rotate(turned, FOOT)

    def ankle(self, pitch: Array) -> Array:
        """(..., 3) position of the ankle.

        It stands still while the toe is up, and moves on an arc about the toe joint while the heel is up.
        """
        turned = quat.mul(self.step.turn, quat.from_axis_angle(X_AXIS, -np.minimum(pitch, 0)))
        return self.step.ankle + quat.rotate(self.step.turn, FOOT) - quat.rotate(turned, FOOT)


def _stand(foot: FootPoses, t: np.ndarray, roll: _Roll, pitch: Array) -> None:
    foot.ankle[t] = roll.ankle(pitch)
    foot.foot[t] = quat.mul(roll.step.turn, quat.from_axis_angle(X_AXIS, -pitch))
    foot.toes[t] = quat.mul(roll.step.turn, quat.from_axis_angle(X_AXIS, -np.maximum(pitch, 0)))


def _swing(foot: FootPoses, here: _Roll, there: _Roll, style: Style, side: int, ground: Ground) -> None:
    start, end = here.step.leave, there.step.land
    t = _frames(start, end)
    if not len(t):
        return
    u = (t - start) / (end - start)
    bump = np.sin(np.pi * u**KICK) ** 2
    p0, p1 = here.pitch(start), there.pitch(end)
    rate = (p0 - here.pitch(start - 0.01)) / 0.01 * (end - start) * READY
    pitch = _hermite(p0, rate * FOLLOW, p1, 0.0, np.minimum(u / READY, 1))
    turn = quat.slerp(here.step.turn, there.step.turn, _ease(u))
    rotation = quat.mul(turn, quat.from_axis_angle(X_AXIS, -pitch))
    bend = np.minimum(pitch, 0) * (1 - 0.4 * bump)
    toes = quat.mul(rotation, quat.from_axis_angle(X_AXIS, bend))
    # The toe joint starts at rest and is moving when it lands. Its position and the pitch give the ankle.
    going = _hermite(0.0, 0.0, 1.0, LANDING_SPEED / EARLY, u**EARLY)
    share = np.stack([going, _ease(u), going], axis=1)
    toe = here.toe(p0) + (there.toe(p1) - here.toe(p0)) * share
    toe[:, 1] += style.lift[t, side] * bump
    toe[:, 1] += (
        _lack(toe, rotation, toes, style.clearance[t, side] * bump, ground)
        * _ease(u / RISE)
        * _ease((1 - u) / SETTLE)
    )
    foot.ankle[t], foot.foot[t], foot.toes[t] = toe - quat.rotate(rotation, FOOT), rotation, toes


def _lack(toe: Array, rotation: Array, toes: Array, clearance: Array, ground: Ground) -> Array:
    """(N,) how much higher, cm, the swing must be for heel, toe joint and toe tip to clear the ground."""
    tip = toe + quat.rotate(toes, np.array([0.0, 0.0, 6.0]))
    heel = toe + quat.rotate(rotation, HEEL - FOOT)
    lack = np.zeros(len(toe))
    for point in (toe, tip, heel):
        lack = np.maximum(lack, ground(point[:, 0], point[:, 2]) + SOLE_HEIGHT + clearance - point[:, 1])
    return smooth_above(lack, max(1, len(toe) // 14))


def _ease(u: Array) -> Array:
    """From 0 to 1 with zero slope at both ends."""
    u = np.clip(u, 0, 1)
    return u * u * (3 - 2 * u)


def _hermite(a: Array | float, da: Array | float, b: Array | float, db: Array | float, u: Array) -> Array:
    """The cubic curve from a (at u = 0) to b (at u = 1) with slopes da and db there."""
    u2, u3 = u * u, u * u * u
    return a * (2 * u3 - 3 * u2 + 1) + da * (u3 - 2 * u2 + u) + b * (3 * u2 - 2 * u3) + db * (u3 - u2)
