"""The feet: when each lands and leaves the ground, where it stands, how it rolls and how it swings.

The pitch of a foot is its angle about the X axis, positive if the toe is up.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.smooth import beside_chord, gaussian, interpolate_curve, smooth_above, smoothstep
from hobble.synthetic.plan import Ground, PlannedPath
from hobble.synthetic.style import LEFT, RIGHT, SIDE_SIGN, Style

X_AXIS = np.array([1.0, 0.0, 0.0])
ANKLE_HEIGHT = 7.0  # cm from the sole up to the ankle joint
ANKLE_TO_TOE = np.array([0.0, -4.5, 13.5])  # x, y, z from the ankle joint to the toe joint of a flat foot, cm
# cm and radians: a standing figure keeps a foot in place if it would move and turn by less than these.
SMALLEST_STEP = (7.0, np.radians(12.0))
# cm: least distance between the ankles, and least sideways distance where one is ahead
MIN_ANKLE_DISTANCE, MIN_ANKLE_WIDTH = 8.0, 5.0
CADENCE_SPREAD = 0.025  # standard deviation of the cadence
CADENCE_SECONDS = 0.6  # seconds over which it varies
STANDING_SPEED = 12.0  # cm/s: a slower figure counts as standing
# Points along the foot, cm in front of the ankle, that should all be on the same step of stairs. The last
# three are in front of the toes, so that the foot does not stand close to the next step.
SOLE = np.array([-11.0, -5.0, 0.0, 6.0, 13.5, 20.5, 27.0, 32.0, 37.0])
# On a tread that is too short for them, the first three of these should be level, and the others not higher.
SHORT_SOLE = np.array([0.0, 6.0, 13.5, 20.0, 25.0, -7.0])
EDGE = 4.0  # cm: at an edge of stairs the ground rises or falls by more from one of these points to the next
MOST_TREAD = 50.0  # cm: on deeper treads, people set more than one foot
EDGE_PHASE = 0.05  # phase, or half a cycle later, in which the body is over an edge between short treads
# cm by which a foot may be moved forward or backward, away from an edge; the smallest are tried first.
SHIFTS = sorted(np.arange(-20.0, 21.0, 2.0), key=abs)


@dataclass(frozen=True)
class Stance:
    """A foot on the ground from frame `land` to frame `leave`. First its toe comes down, then its heel rises.

    `land` and `leave` may have fractions. They count frames of the planned path, which begins before the clip
    and ends after it. ankle: (3,) position of the ankle while the foot is flat, cm. turn: (4,) world rotation
    of the flat foot. swings: whether the foot swung to this place. If not, it already stood there.

    land_pitch, off_pitch: pitch as the foot lands and as it leaves, radians. rest_pitch: (F,) pitch of a
    standing foot, radians; all stances share this array. flat: share of the stance after which the toe is
    down. heel_off: share of the stance after which the heel leaves the ground. power: exponent of the heel's
    rise over time.
    """

    land: float
    leave: float
    ankle: Array
    turn: Array
    swings: bool
    land_pitch: float
    off_pitch: float
    rest_pitch: Array
    flat: float
    heel_off: float
    power: float

    @property
    def middle(self) -> float:
        """The frame, with fractions, in the middle of the stance."""
        return (self.land + self.leave) / 2

    def pitch(self, t: Array | float, lands: bool = True, leaves: bool = True) -> Array:
        """The pitch, radians, at frames `t` in the stance or just outside it.

        lands: whether the stance begins with a landing. leaves: whether it ends with a swing. Without a
        landing or a swing, the foot has the pitch of a standing foot at that end.
        """
        share = (np.asarray(t, float) - self.land) / (self.leave - self.land)  # of the stance
        down = share / self.flat
        rise = np.clip((share - self.heel_off) / (1 - self.heel_off), 0, None)
        rest = interpolate_curve(self.rest_pitch, t)
        landing = (self.land_pitch - rest) * (1 - smoothstep(down)) if lands else 0.0
        leaving = (self.off_pitch - rest) * rise**self.power if leaves else 0.0
        return np.asarray(rest + landing + leaving)

    def toe_at(self, pitch: Array) -> Array:
        """(..., 3) position of the toe joint at pitches (...).

        The toe joint stands still while the heel is up, and moves on an arc about the ankle while the toe is
        up.
        """
        rotation = quat.mul(self.turn, quat.from_axis_angle(X_AXIS, -np.maximum(pitch, 0.0)))
        return self.ankle + quat.rotate(rotation, ANKLE_TO_TOE)

    def ankle_at(self, pitch: Array) -> Array:
        """(..., 3) position of the ankle at pitches (...).

        The ankle stands still while the toe is up, and moves on an arc about the toe joint while the heel is
        up.
        """
        rotation = quat.mul(self.turn, quat.from_axis_angle(X_AXIS, -np.minimum(pitch, 0)))
        return self.ankle + quat.rotate(self.turn, ANKLE_TO_TOE) - quat.rotate(rotation, ANKLE_TO_TOE)


def phase_curve(style: Style, fps: float, rng: np.random.Generator) -> Array:
    """(F,) phase in cycles. It starts near 0 to 1 and only grows. The right foot lands at whole numbers.

    The cadence varies at random over some steps, as that of people does.
    """
    start = rng.random()
    slow = gaussian(rng.normal(size=len(style.frequency)), CADENCE_SECONDS * fps)
    return start + np.cumsum(style.frequency * (1 + CADENCE_SPREAD * slow / slow.std())) / fps


def climb_stairs(phase: Array, path: PlannedPath, ground: Ground) -> Array:
    """(F,) the phase in cycles, changed so that each step goes to the next tread of stairs if it is short."""
    heights = ground(path.position[:, 0], path.position[:, 1])
    edges = np.flatnonzero(np.abs(np.diff(heights)) > EDGE)
    way = np.cumsum(path.speed) / path.fps
    change, short = np.gradient(phase), np.zeros(len(edges), bool)
    for i, (edge, following) in enumerate(pairwise(edges.tolist())):
        if (tread := way[following] - way[edge]) < MOST_TREAD:
            short[i : i + 2] = True
            frames = slice(max(0, 2 * edge - following), following)  # the first step goes to the first tread
            change[frames] = path.speed[frames] / path.fps / (2 * tread)
    if not short.any():
        return phase
    phase = phase[0] + np.cumsum(change)
    apart = np.unwrap((phase[edges[short]] - EDGE_PHASE) % 0.5, period=0.5)
    return np.asarray(phase - np.interp(np.arange(len(phase)), edges[short], apart))


def landing_frames(phase: Array, side: int) -> Array:
    """Frames, with fractions, in which a foot lands.

    phase: (F,) from `phase_curve`. side: LEFT or RIGHT.
    """
    foot_phase = phase - (0.5 if side == LEFT else 0.0)  # the foot lands at whole numbers
    whole = np.arange(np.ceil(foot_phase[0]), np.floor(foot_phase[-1]) + 1)
    return np.interp(whole, foot_phase, np.arange(len(foot_phase), dtype=float))


def plan_stances(
    path: PlannedPath, style: Style, phase: Array, ground: Ground, rng: np.random.Generator
) -> tuple[list[Stance], list[Stance]]:
    """Two lists: the stances of the left foot and those of the right foot along the path, in order of time.

    phase: (F,) from `phase_curve`. rng: for small random shifts of the feet.
    """
    frames, speed = np.arange(len(path), dtype=float), path.speed
    # The duty is the share of the cycle in which the foot is on the ground. A foot that landed at phase p
    # leaves the ground at phase p + duty, that is, in the frame in which phase - duty is p.
    phase_less_duty = [phase - style.duty[:, side] for side in (LEFT, RIGHT)]
    events = [(land, side) for side in (LEFT, RIGHT) for land in landing_frames(phase, side)[:-1]]
    planned: tuple[list[Stance], list[Stance]] = ([], [])
    rest_pitch = np.radians(style.rest_pitch)
    for land, side in sorted(events):
        landing_phase = interpolate_curve(phase, land)
        # Here the duty is that of the frame in which the foot leaves, not of the landing. So a walker who has
        # become faster since the landing lifts the foot sooner.
        leave = np.interp(landing_phase, phase_less_duty[side], frames)
        mid_stance = np.interp((landing_phase + interpolate_curve(phase, leave)) / 2, phase, frames)
        previous, other_foot = (planned[s][-1] if planned[s] else None for s in (side, 1 - side))
        ankle, turn = _place_foot(path, style, ground, side, mid_stance, other_foot, rng)
        standing = interpolate_curve(speed, mid_stance) < STANDING_SPEED
        stays = previous is not None and standing and _is_same_place(previous, ankle, turn)
        if previous is not None and stays:
            ankle, turn = previous.ankle, previous.turn

        planned[side].append(
            Stance(
                land,
                leave,
                ankle,
                turn,
                swings=not stays,
                land_pitch=np.radians(_at(style.land_pitch[:, side], land)),
                off_pitch=np.radians(_at(style.off_pitch[:, side], leave)),
                rest_pitch=rest_pitch,
                flat=_at(style.flat, land),
                heel_off=_at(style.heel_off[:, side], (land + leave) / 2),
                power=_at(style.roll, leave),
            )
        )
    return planned


def _at(curve: Array, when: float) -> float:
    """The value of a curve (F,) at a frame with fractions."""
    return float(interpolate_curve(curve, when))


def _place_foot(
    path: PlannedPath,
    style: Style,
    ground: Ground,
    side: int,
    mid_stance: float,
    other_foot: Stance | None,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Where a foot stands: near the body's place in mid-stance, but never across the other foot.

    Returns the ankle's position (3,), cm, and the foot's world rotation (4,). mid_stance: frame of the path.
    other_foot: the last stance of the other foot, None if it has none yet.
    """

    moving = 1 - _at(path.gait[:, 0], mid_stance)  # column 0 is the share of standing
    facing = _at(path.facing, mid_stance)
    toe_out = np.radians(_at(style.toe_out[:, side], mid_stance))
    # From the body's place to the ankle, cm. Steps of a moving figure differ at random by some millimetres.
    to_left = SIDE_SIGN[side] * _at(style.width, mid_stance) + moving * rng.normal(0, 0.6)
    forward = -_at(style.behind, mid_stance) + moving * rng.normal(0, 0.8)
    yaw = facing + SIDE_SIGN[side] * toe_out
    x = _at(path.position[:, 0], mid_stance) + to_left * np.cos(facing) + forward * np.sin(facing)
    z = _at(path.position[:, 1], mid_stance) - to_left * np.sin(facing) + forward * np.cos(facing)
    if other_foot is not None:
        from_other = x - other_foot.ankle[0], z - other_foot.ankle[2]
        # In a turn, the other foot is on the same arc, further back. Seen from the facing direction in
        # between, it is straight behind.
        between = (facing + _at(path.facing, other_foot.middle)) / 2
        ahead = from_other[0] * np.sin(between) + from_other[1] * np.cos(between)
        apart = SIDE_SIGN[side] * (from_other[0] * np.cos(between) - from_other[1] * np.sin(between))
        least = max(MIN_ANKLE_WIDTH, np.sqrt(max(MIN_ANKLE_DISTANCE**2 - ahead**2, 0.0)))
        to_left = SIDE_SIGN[side] * max(0.0, least - apart)
        x, z = x + to_left * np.cos(facing), z - to_left * np.sin(facing)
    return _plant_foot(ground, np.array([x, z]), yaw)


def _plant_foot(ground: Ground, place: Array, yaw: float) -> tuple[Array, Array]:
    """Ankle position (3,), cm, and world rotation (4,) of a foot that stands flat near `place` (x, z), cm.

    If possible, the whole foot is on one step of stairs. yaw: direction of the foot, radians.
    """
    ahead = np.array([np.sin(yaw), np.cos(yaw)])

    def heights(along: Array) -> Array:
        return ground(place[0] + along * ahead[0], place[1] + along * ahead[1])

    def fits(shift: float, short: bool) -> bool:
        # At an edge of stairs, two neighbouring points differ by 7 cm or more. On slopes and bumps the
        # difference is less than 4 cm.
        sole = heights(shift + (SHORT_SOLE if short else SOLE))
        level = np.max(np.abs(np.diff(sole[:3] if short else sole))) < EDGE
        return bool(level and (not short or sole.max() - sole[0] < EDGE))

    shift = next((s for short in (False, True) for s in SHIFTS if fits(s, short)), SHIFTS[-1])
    under_ankle, under_toe = heights(shift + np.array([0.0, ANKLE_TO_TOE[2]]))
    x, z = place + shift * ahead
    pitch = np.arctan2(under_toe - under_ankle, ANKLE_TO_TOE[2])
    turn = quat.mul(quat.yaw(yaw), quat.from_axis_angle(X_AXIS, -pitch))
    return np.array([x, under_ankle + ANKLE_HEIGHT, z]), turn


def _is_same_place(old: Stance, ankle: Array, turn: Array) -> bool:
    """Whether the foot can stay, because its new ankle position (3,) and rotation (4,) are near the old."""
    moved = np.linalg.norm(ankle - old.ankle)
    return bool(moved < SMALLEST_STEP[0] and quat.angle(old.turn, turn) < SMALLEST_STEP[1])


# Moves a foot through its planned stances: it rolls in a stance, and swings to the next stance.
#
# The pitch of a foot is its angle about the X axis, positive if the toe is up.


HEEL = np.array([0.0, -4.2, -3.0])  # cm from the ankle joint to the heel, approximately
READY = 0.95  # after this share of the swing, the foot has the pitch with which it lands
# Exponents of the time in a swing, which runs from 0 to 1. KICK is below 1, so the foot is highest before the
# middle of the swing. EARLY is below 1, so the foot covers more than half of its way in the first half.
KICK, EARLY = 0.56, 0.81
FOLLOW = 0.35  # the pitch begins the swing with this share of its rate of change at the end of the stance
LANDING_SPEED = 0.36  # speed of the foot as it lands, as a share of its mean speed in the swing
# Where the ground is in the way, the foot is raised more. The raise grows in the first RISE of the swing, and
# shrinks in the last SETTLE of it (shares of the swing).
RISE, SETTLE = 0.2, 0.3
MOST_ARC = 0.25  # a swing leaves the straight way by at most this share of its length
SOLE_HEIGHT = 2.0  # cm: heel, toe joint and toe tip count as this high above the sole


@dataclass(frozen=True)
class FootPoses:
    """One foot over F frames, in the world.

    ankle: (F, 3) position, cm. foot, toes: (F, 4) rotations.
    """

    ankle: Array
    foot: Array
    toes: Array


def move_foot(stances: list[Stance], path: PlannedPath, style: Style, side: int, ground: Ground) -> FootPoses:
    """The way of one foot through its stances along the path.

    side: LEFT or RIGHT of `hobble.synthetic.style`. In frames before the first landing, and from the last
    landing on, positions are 0 and rotations are the identity.
    """
    frames = len(style.duty)
    rotations = np.tile(quat.IDENTITY, (frames, 1))
    foot = FootPoses(np.zeros((frames, 3)), rotations, rotations.copy())
    for i, (here, there) in enumerate(pairwise(stances)):
        stays = not there.swings  # without a swing, the foot stands until the next stance begins
        t = _frames(here.land, there.land if stays else here.leave)
        pitch = here.pitch(t, lands=here.swings or i == 0, leaves=not stays)
        foot.ankle[t] = here.ankle_at(pitch)
        foot.foot[t] = quat.mul(here.turn, quat.from_axis_angle(X_AXIS, -pitch))
        # While the heel is up, the toes stay flat on the ground.
        foot.toes[t] = quat.mul(here.turn, quat.from_axis_angle(X_AXIS, -np.maximum(pitch, 0)))
        if not stays:
            _swing(foot, here, there, path, style, side, ground)
    return foot


def _frames(start: float, end: float) -> np.ndarray:
    """The whole frames from `start` to `end`, without `end`."""
    return np.arange(int(np.ceil(start)), int(np.ceil(end)))


def _swing(
    foot: FootPoses, here: Stance, there: Stance, path: PlannedPath, style: Style, side: int, ground: Ground
) -> None:
    """Set the frames of the swing from the stance `here` to the stance `there`."""
    start, end = here.leave, there.land
    t = _frames(start, end)
    if not len(t):
        return
    u = (t - start) / (end - start)  # time in the swing, 0 to 1
    bump = np.sin(np.pi * u**KICK) ** 2  # how much the swing is raised: 0 at both ends, 1 in between
    first_pitch, last_pitch = here.pitch(start), there.pitch(end)
    # The rate of change at the end of the stance, radians in the time READY of the swing.
    rate = (first_pitch - here.pitch(start - 0.01)) / 0.01 * (end - start) * READY
    pitch = _hermite(first_pitch, rate * FOLLOW, last_pitch, 0.0, np.minimum(u / READY, 1))
    turn = quat.slerp(here.turn, there.turn, smoothstep(u))
    rotation = quat.mul(turn, quat.from_axis_angle(X_AXIS, -pitch))
    # While the heel is up, the toes are bent up as in a stance, but by up to 40% less in the swing.
    bend = np.minimum(pitch, 0) * (1 - 0.4 * bump)
    toes = quat.mul(rotation, quat.from_axis_angle(X_AXIS, bend))
    # The toe joint starts at rest and is moving when it lands. Its position and the pitch give the ankle.
    along = _hermite(0.0, 0.0, 1.0, LANDING_SPEED / EARLY, u**EARLY)
    share = np.stack([along, smoothstep(u), along], axis=1)  # of the way in x, y and z
    first_toe = here.toe_at(first_pitch)
    toe = first_toe + (there.toe_at(last_pitch) - first_toe) * share
    toe[:, [0, 2]] += _arc(path.position, here, there, along)
    toe[:, 1] += style.lift[t, side] * bump
    toe += quat.rotate(turn, SIDE_SIGN[side] * X_AXIS) * (style.circle[t] * bump)[:, None]
    toe[:, 1] += (
        _missing_height(toe, rotation, toes, style.clearance[t, side] * bump, ground)
        * smoothstep(u / RISE)
        * smoothstep((1 - u) / SETTLE)
    )
    foot.ankle[t], foot.foot[t], foot.toes[t] = toe - quat.rotate(rotation, ANKLE_TO_TOE), rotation, toes


def _arc(body: Array, here: Stance, there: Stance, along: Array) -> Array:
    """(N, 2) cm by which a swing is beside the straight way (x, z): in a turn it follows the body's arc.

    In turns of 50 to 70 degrees a second, people's feet leave the straight way by 5 to 25 cm, and the knee of
    the inner leg bends as far as on a straight walk (CMU). body: (F, 2) place of the body. along: (N,) share
    of the way that the foot has made.
    """
    beside, length = beside_chord(body, here.middle, there.middle, along)
    widest = max(float(np.linalg.norm(beside, axis=1).max()), 1e-9)
    # A foot on the inside of a turn makes less way than the body, on a smaller arc.
    way = float(np.linalg.norm((there.ankle - here.ankle)[[0, 2]]))
    return beside * way * min(1 / length, MOST_ARC / widest)


def _missing_height(toe: Array, rotation: Array, toes: Array, clearance: Array, ground: Ground) -> Array:
    """(N,) how much higher, cm, the swing must be so that heel, toe joint and toe tip clear the ground.

    toe: (N, 3) toe joint. rotation, toes: (N, 4) of foot and toes. clearance: (N,) height of the sole above
    the ground that is wanted, cm.
    """
    tip = toe + quat.rotate(toes, np.array([0.0, 0.0, 6.0]))  # 6 cm in front of the toe joint
    heel = toe + quat.rotate(rotation, HEEL - ANKLE_TO_TOE)
    missing = np.zeros(len(toe))
    for point in (toe, tip, heel):
        lowest = ground(point[:, 0], point[:, 2]) + SOLE_HEIGHT + clearance
        missing = np.maximum(missing, lowest - point[:, 1])
    return smooth_above(missing, max(1, len(toe) // 14))


def _hermite(a: Array | float, da: Array | float, b: Array | float, db: Array | float, u: Array) -> Array:
    """The cubic curve from a (at u = 0) to b (at u = 1) with slopes da and db there."""
    u2, u3 = u * u, u * u * u
    return a * (2 * u3 - 3 * u2 + 1) + da * (u3 - 2 * u2 + u) + b * (3 * u2 - 2 * u3) + db * (u3 - u2)
