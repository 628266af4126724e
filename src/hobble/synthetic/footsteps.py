"""Plans the footsteps: when each foot lands and leaves the ground, and where it stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.curve_value import interpolate_curve
from hobble.core.quat import Array
from hobble.synthetic.planned_ground import Ground
from hobble.synthetic.planned_path import PlannedPath
from hobble.synthetic.style import LEFT, RIGHT, SIDE_SIGN, Style

ANKLE_HEIGHT = 7.0  # cm from the sole up to the ankle joint
ANKLE_TO_TOE = np.array([0.0, -4.5, 13.5])  # x, y, z from the ankle joint to the toe joint of a flat foot, cm
# cm and radians: a standing figure keeps a foot in place if it would move and turn by less than these.
SMALLEST_STEP = (7.0, np.radians(12.0))
MIN_ANKLE_DISTANCE = 8.0  # cm: least sideways distance between the ankles
STANDING_SPEED = 12.0  # cm/s: a slower figure counts as standing
# Points along the foot, cm in front of the ankle, that should all be on the same step of stairs. The last
# three are in front of the toes, so that the foot does not stand close to the next step.
SOLE = np.array([-11.0, -5.0, 0.0, 6.0, 13.5, 20.5, 27.0, 32.0, 37.0])
# cm by which a foot may be moved forward or backward, away from an edge; the smallest are tried first.
SHIFTS = sorted(np.arange(-20.0, 21.0, 2.0), key=abs)


@dataclass(frozen=True)
class PlannedStance:
    """A foot on the ground from frame `land` to frame `leave`.

    `land` and `leave` may have fractions. They count frames of the planned path, which begins before the clip
    and ends after it. ankle: (3,) position of the ankle while the foot is flat, cm. turn: (4,) world rotation
    of the flat foot. swings: whether the foot swung to this place. If not, it already stood there.
    """

    land: float
    leave: float
    ankle: Array
    turn: Array
    swings: bool = True


def phase_curve(style: Style, fps: float, start: float) -> Array:
    """(F,) phase in cycles. It starts near `start` and only grows. The right foot lands at whole numbers."""
    return start + np.cumsum(style.frequency) / fps


def landing_frames(phase: Array, side: int) -> Array:
    """Frames, with fractions, in which a foot lands.

    phase: (F,) from `phase_curve`. side: LEFT or RIGHT.
    """
    foot_phase = phase - (0.5 if side == LEFT else 0.0)  # the foot lands at whole numbers
    whole = np.arange(np.ceil(foot_phase[0]), np.floor(foot_phase[-1]) + 1)
    return np.interp(whole, foot_phase, np.arange(len(foot_phase), dtype=float))


def plan_stances(
    path: PlannedPath, style: Style, phase: Array, ground: Ground, rng: np.random.Generator
) -> tuple[list[PlannedStance], list[PlannedStance]]:
    """Two lists: the stances of the left foot and those of the right foot along the path, in order of time.

    phase: (F,) from `phase_curve`. rng: for small random shifts of the feet.
    """
    frames, speed = np.arange(len(path), dtype=float), path.speed
    # The duty is the share of the cycle in which the foot is on the ground. A foot that landed at phase p
    # leaves the ground at phase p + duty, that is, in the frame in which phase - duty is p.
    phase_less_duty = [phase - style.duty[:, side] for side in (LEFT, RIGHT)]
    events = [(land, side) for side in (LEFT, RIGHT) for land in landing_frames(phase, side)[:-1]]
    planned: tuple[list[PlannedStance], list[PlannedStance]] = ([], [])
    for land, side in sorted(events):
        landing_phase = interpolate_curve(phase, land)
        # Here the duty is that of the frame in which the foot leaves, not of the landing. So a walker who has
        # become faster since the landing lifts the foot sooner.
        leave = np.interp(landing_phase, phase_less_duty[side], frames)
        mid_stance = np.interp((landing_phase + interpolate_curve(phase, leave)) / 2, phase, frames)
        previous, other_foot = (planned[s][-1] if planned[s] else None for s in (side, 1 - side))
        ankle, turn = _place_foot(path, style, ground, side, mid_stance, other_foot, rng)
        standing = interpolate_curve(speed, mid_stance) < STANDING_SPEED
        if previous and standing and _is_same_place(previous, ankle, turn):
            planned[side].append(PlannedStance(land, leave, previous.ankle, previous.turn, swings=False))
        else:
            planned[side].append(PlannedStance(land, leave, ankle, turn))
    return planned


def _place_foot(
    path: PlannedPath,
    style: Style,
    ground: Ground,
    side: int,
    mid_stance: float,
    other_foot: PlannedStance | None,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Where a foot stands: near the body's place in mid-stance, but never across the other foot.

    Returns the ankle's position (3,), cm, and the foot's world rotation (4,). mid_stance: frame of the path.
    other_foot: the last stance of the other foot, None if it has none yet.
    """

    def in_mid_stance(curve: Array) -> float:
        return float(interpolate_curve(curve, mid_stance))

    moving = 1 - in_mid_stance(path.gait[:, 0])  # column 0 is the share of standing
    facing = in_mid_stance(path.facing)
    toe_out = np.radians(in_mid_stance(style.toe_out[:, side]))
    # From the body's place to the ankle, cm. Steps of a moving figure differ at random by some millimetres.
    to_left = SIDE_SIGN[side] * in_mid_stance(style.width) + moving * rng.normal(0, 0.6)
    forward = -in_mid_stance(style.behind) + moving * rng.normal(0, 0.8)
    yaw = facing + SIDE_SIGN[side] * toe_out
    x = in_mid_stance(path.position[:, 0]) + to_left * np.cos(facing) + forward * np.sin(facing)
    z = in_mid_stance(path.position[:, 1]) - to_left * np.sin(facing) + forward * np.cos(facing)
    if other_foot is not None:
        from_other = x - other_foot.ankle[0], z - other_foot.ankle[2]
        apart = SIDE_SIGN[side] * (from_other[0] * np.cos(facing) - from_other[1] * np.sin(facing))
        to_left = SIDE_SIGN[side] * max(0.0, MIN_ANKLE_DISTANCE - apart)
        x, z = x + to_left * np.cos(facing), z - to_left * np.sin(facing)
    return _plant_foot(ground, np.array([x, z]), yaw)


def _plant_foot(ground: Ground, place: Array, yaw: float) -> tuple[Array, Array]:
    """Ankle position (3,), cm, and world rotation (4,) of a foot that stands flat near `place` (x, z), cm.

    If possible, the whole foot is on one step of stairs. yaw: direction of the foot, radians.
    """
    ahead = np.array([np.sin(yaw), np.cos(yaw)])

    def heights(along: Array) -> Array:
        return ground(place[0] + along * ahead[0], place[1] + along * ahead[1])

    for shift in SHIFTS:
        sole = heights(shift + SOLE)
        # At an edge of stairs, two neighbouring points differ by 7 cm or more. On slopes and bumps the
        # difference is less than 4 cm.
        if np.max(np.abs(np.diff(sole))) < 4.0:
            break
    under_ankle, under_toe = heights(shift + np.array([0.0, ANKLE_TO_TOE[2]]))
    x, z = place + shift * ahead
    pitch = np.arctan2(under_toe - under_ankle, ANKLE_TO_TOE[2])
    turn = quat.mul(quat.yaw(yaw), quat.from_axis_angle([1.0, 0.0, 0.0], -pitch))
    return np.array([x, under_ankle + ANKLE_HEIGHT, z]), turn


def _is_same_place(old: PlannedStance, ankle: Array, turn: Array) -> bool:
    """Whether the foot can stay, because its new ankle position (3,) and rotation (4,) are near the old."""
    moved = np.linalg.norm(ankle - old.ankle)
    return bool(moved < SMALLEST_STEP[0] and quat.angle(old.turn, turn) < SMALLEST_STEP[1])
