"""Where the ankle is and how the foot is turned in every frame: rolling in stance, swinging between stances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.synthetic.footsteps import FOOT, Stance
from hobble.synthetic.gait import SIGN, Style
from hobble.synthetic.ground import Ground

X_AXIS = np.array([1.0, 0.0, 0.0])
SOLE_HEIGHT = 2.0  # a moving joint of the foot keeps at least this and the clearance over the ground


@dataclass(frozen=True)
class Foot:
    """One foot over F frames: ankle (F, 3), foot (F, 4) and toes (F, 4) in the world; support: (F,) 1 in stance."""

    ankle: Array
    foot: Array
    toes: Array
    support: Array


def move_foot(steps: list[Stance], style: Style, side: int, ground: Ground) -> Foot:
    """The path of one foot through its stances. Frames before the first and after the last one stay zero."""
    frames = len(style.lag)
    foot = Foot(
        np.zeros((frames, 3)), np.tile(quat.IDENTITY, (frames, 1)), np.zeros((frames, 4)), np.zeros(frames)
    )
    rolls = [_Roll.of(step, style, side) for step in steps]
    for i, (here, there) in enumerate(zip(rolls, rolls[1:], strict=False)):
        rests = not there.step.swings
        leave = there.step.land if rests else here.step.leave
        t = _frames(here.step.land, leave)
        pitch = here.pitch(t, lands=here.step.swings or i == 0, leaves=not rests)
        _stand(foot, t, here, pitch)
        if not rests:
            _swing(foot, here, there, style, side, ground)
    return foot


def _frames(start: float, end: float) -> np.ndarray:
    return np.arange(int(np.ceil(start)), int(np.ceil(end)))


@dataclass(frozen=True)
class _Roll:
    """A stance and the course of the foot's pitch in it: down from its landing, flat, up over the toe."""

    step: Stance
    land: float
    off: float
    flat: float
    heel_off: float

    @classmethod
    def of(cls, step: Stance, style: Style, side: int) -> _Roll:
        t = np.arange(len(style.lag), dtype=float)
        land = np.interp(step.land, t, style.land_pitch[:, side])
        off = np.interp(step.leave, t, style.off_pitch[:, side])
        flat = np.interp(step.land, t, style.flat)
        heel_off = np.interp((step.land + step.leave) / 2, t, style.heel_off[:, side])
        return cls(step, np.radians(land), np.radians(off), float(flat), float(heel_off))

    def pitch(self, t: Array, lands: bool = True, leaves: bool = True) -> Array:
        """Radians, + toe up, at frames `t` within or just outside of the stance."""
        u = (np.asarray(t, float) - self.step.land) / (self.step.leave - self.step.land)
        down = np.clip(u / self.flat, 0, 1)
        rise = np.clip((u - self.heel_off) / (1 - self.heel_off), 0, None)
        landing = self.land * (1 - down**2 * (3 - 2 * down)) if lands else 0.0
        return landing + (self.off * rise**1.8 if leaves else 0.0)

    def ankle(self, pitch: Array) -> Array:
        """(..., 3): still where the toe is up, on an arc about the still toe joint where the heel is up."""
        turned = quat.mul(self.step.turn, quat.from_axis_angle(X_AXIS, -np.minimum(pitch, 0)))
        return self.step.ankle + quat.rotate(self.step.turn, FOOT) - quat.rotate(turned, FOOT)


def _stand(foot: Foot, t: np.ndarray, roll: _Roll, pitch: Array) -> None:
    foot.ankle[t] = roll.ankle(pitch)
    foot.foot[t] = quat.mul(roll.step.turn, quat.from_axis_angle(X_AXIS, -pitch))
    foot.toes[t] = quat.mul(roll.step.turn, quat.from_axis_angle(X_AXIS, -np.maximum(pitch, 0)))
    foot.support[t] = 1.0


def _swing(foot: Foot, here: _Roll, there: _Roll, style: Style, side: int, ground: Ground) -> None:
    start, end = here.step.leave, there.step.land
    t = _frames(start, end)
    if not len(t):
        return
    u = ((t - start) / (end - start))[:, None]
    length = end - start
    step = 0.01
    p0, p1 = here.pitch(start), there.pitch(end)
    v0 = (p0 - here.pitch(start - step)) / step * length
    v1 = (there.pitch(end + step) - p1) / step * length
    pitch = _hermite(p0, v0 * 0.6, p1, v1, u)[:, 0]
    a0, a1 = here.ankle(p0), there.ankle(p1)
    w0 = (a0 - here.ankle(here.pitch(start - step))) / step * length
    w1 = (there.ankle(there.pitch(end + step)) - a1) / step * length
    ankle = _hermite(a0, w0, a1, w1, u)
    ease = (u * u * (3 - 2 * u))[:, 0]
    turn = quat.slerp(here.step.turn, there.step.turn, ease)
    bump = np.sin(np.pi * u[:, 0]) ** 2
    ankle[:, 1] += np.interp(t, np.arange(len(style.lag)), style.lift[:, side]) * bump
    out = quat.rotate(turn, np.array([SIGN[side], 0.0, 0.0]))
    ankle += out * (style.swing_out[t, side] * bump)[:, None]
    rotation = quat.mul(turn, quat.from_axis_angle(X_AXIS, -pitch))
    early, late = np.clip(u[:, 0] / 0.4, 0, 1), np.clip((u[:, 0] - 0.7) / 0.3, 0, 1)
    bend = min(p0, 0.0) * (1 - early**2 * (3 - 2 * early)) + min(p1, 0.0) * late
    toes = quat.mul(rotation, quat.from_axis_angle(X_AXIS, bend))
    ankle[:, 1] += _clear(ankle, rotation, toes, bump, style.clearance[t, side], ground) * bump
    foot.ankle[t], foot.foot[t], foot.toes[t] = ankle, rotation, toes


def _clear(
    ankle: Array, rotation: Array, toes: Array, bump: Array, clearance: Array, ground: Ground
) -> float:
    """How much higher the swing must bulge for heel, toe joint and toe tip to clear the ground."""
    most = 0.0
    toe = ankle + quat.rotate(rotation, FOOT)
    tip = toe + quat.rotate(toes, np.array([0.0, 0.0, 6.0]))
    heel = ankle + quat.rotate(rotation, np.array([0.0, -5.0, -3.0]))
    middle = bump > 0.2
    if middle.any():
        for point in (toe, tip, heel):
            need = ground(point[:, 0], point[:, 2]) + SOLE_HEIGHT + clearance * bump - point[:, 1]
            most = max(most, float(np.max(need[middle] / bump[middle])))
    return most


def _hermite(a: Array, da: Array, b: Array, db: Array, u: Array) -> Array:
    """Cubic from a to b with slopes da and db; u (N, 1)."""
    u2, u3 = u * u, u * u * u
    return a * (2 * u3 - 3 * u2 + 1) + da * (u3 - 2 * u2 + u) + b * (3 * u2 - 2 * u3) + db * (u3 - u2)
