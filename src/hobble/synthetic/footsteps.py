"""When each foot lands and leaves the ground, and where it stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.curve_value import value_at
from hobble.core.quat import Array
from hobble.synthetic.planned_ground import Ground
from hobble.synthetic.planned_path import PlannedPath
from hobble.synthetic.style import LEFT, RIGHT, SIGN, Style

ANKLE_HEIGHT = 7.0  # cm, of the ankle joint above the sole; the toe joint is 4.5 cm lower
FOOT = np.array([0.0, -4.5, 13.5])  # cm from the ankle joint to the toe joint in a flat foot
STAY = (7.0, np.radians(12.0))  # cm and radians: a standing figure takes no step that is smaller than both
APART = 8.0  # cm: least sideways distance between the ankles
STILL = 12.0  # cm/s: a slower figure stands
# Points along the foot, cm from the ankle, that must all be on the same step of stairs. The last ones are in
# front of the toes, to leave room.
SOLE = np.array([-11.0, -5.0, 0.0, 6.0, 13.5, 20.5, 27.0, 32.0, 37.0])
SHIFTS = sorted(np.arange(-20.0, 21.0, 2.0), key=abs)  # cm by which a foot may be moved away from an edge


@dataclass(frozen=True)
class PlannedStance:
    """A foot on the ground from frame `land` to frame `leave`.

    Both are frames of the planned path, which is longer than the clip at both ends, and may have fractions.
    ankle: (3,) position of the ankle while the foot is flat, cm. turn: (4,) world rotation of the flat foot.
    swings: whether the foot swung to this place. If not, it already stood there.
    """

    land: float
    leave: float
    ankle: Array
    turn: Array
    swings: bool = True


def phase_curve(style: Style, fps: float, start: float) -> Array:
    """(F,) phase in cycles, not wrapped, from about `start`. The right foot lands at whole numbers."""
    return start + np.cumsum(style.frequency) / fps


def landings(phase: Array, side: int) -> Array:
    """Frames (with fractions) in which the foot `side` lands, from the unwrapped phase (F,)."""
    foot_phase = phase - (0.5 if side == LEFT else 0.0)  # the foot lands at whole numbers
    whole = np.arange(np.ceil(foot_phase[0]), np.floor(foot_phase[-1]) + 1)
    return np.interp(whole, foot_phase, np.arange(len(foot_phase), dtype=float))


def stances(
    path: PlannedPath, style: Style, phase: Array, ground: Ground, rng: np.random.Generator
) -> tuple[list[PlannedStance], list[PlannedStance]]:
    """All stances of the left and of the right foot along the path, in the order of their landings.

    phase: (F,) from `phase_curve`. rng: for small random shifts of the feet.
    """
    frames, speed = np.arange(len(path), dtype=float), path.speed
    leaving = [phase - style.duty[:, side] for side in (LEFT, RIGHT)]
    events = [(land, side) for side in (LEFT, RIGHT) for land in landings(phase, side)[:-1]]
    out: tuple[list[PlannedStance], list[PlannedStance]] = ([], [])
    for land, side in sorted(events):
        here = value_at(phase, land)
        # The duty (share of the cycle on the ground) is taken as the foot leaves, not as it lands. A walker
        # who has become faster in between lifts the foot sooner.
        leave = np.interp(here, leaving[side], frames)
        middle = np.interp((here + value_at(phase, leave)) / 2, phase, frames)
        before, other = (out[s][-1] if out[s] else None for s in (side, 1 - side))
        ankle, turn = _footprint(path, style, ground, side, middle, other, rng)
        standing = value_at(speed, middle) < STILL
        if before and standing and _is_same_place(before, ankle, turn):
            out[side].append(PlannedStance(land, leave, before.ankle, before.turn, swings=False))
        else:
            out[side].append(PlannedStance(land, leave, ankle, turn))
    return out


def _footprint(
    path: PlannedPath,
    style: Style,
    ground: Ground,
    side: int,
    middle: float,
    other: PlannedStance | None,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """The place of a foot: near the body's place in mid-stance, but never crossed over the other foot.

    Returns the ankle's position (3,) and the foot's world rotation (4,). middle: frame of mid-stance. other:
    the last stance of the other foot.
    """

    def value(curve: Array) -> float:
        return float(value_at(curve, middle))

    moving = 1 - value(path.gait[:, 0])
    facing = value(path.facing)
    toe_out = np.radians(value(style.toe_out[:, side]))
    out = SIGN[side] * value(style.width) + moving * rng.normal(0, 0.6)
    along = -value(style.behind) + moving * rng.normal(0, 0.8)
    yaw = facing + SIGN[side] * toe_out
    x = value(path.position[:, 0]) + out * np.cos(facing) + along * np.sin(facing)
    z = value(path.position[:, 1]) - out * np.sin(facing) + along * np.cos(facing)
    if other is not None:
        apart = SIGN[side] * ((x - other.ankle[0]) * np.cos(facing) - (z - other.ankle[2]) * np.sin(facing))
        aside = SIGN[side] * max(0.0, APART - apart)
        x, z = x + aside * np.cos(facing), z - aside * np.sin(facing)
    return _planted(ground, np.array([x, z]), yaw)


def _planted(ground: Ground, place: Array, yaw: float) -> tuple[Array, Array]:
    """Ankle position (3,) and world rotation (4,) of a flat foot near `place` (x, z), cm.

    If possible, the whole foot is on one step of stairs. yaw: direction of the foot, radians.
    """
    ahead = np.array([np.sin(yaw), np.cos(yaw)])

    def heights(along: Array) -> Array:
        return ground(place[0] + along * ahead[0], place[1] + along * ahead[1])

    for shift in SHIFTS:
        sole = heights(shift + SOLE)
        if np.max(np.abs(np.diff(sole))) < 4.0:
            break
    heel, toe = heights(shift + np.array([0.0, 13.5]))
    x, z = place + shift * ahead
    pitch = np.arctan2(toe - heel, 13.5)
    turn = quat.mul(quat.yaw(yaw), quat.from_axis_angle([1.0, 0.0, 0.0], -pitch))
    return np.array([x, heel + ANKLE_HEIGHT, z]), turn


def _is_same_place(old: PlannedStance, ankle: Array, turn: Array) -> bool:
    moved = np.linalg.norm(ankle - old.ankle)
    return bool(moved < STAY[0] and quat.angle(old.turn, turn) < STAY[1])
