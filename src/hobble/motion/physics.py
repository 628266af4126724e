"""Checks a clip by physics: which way is down, whether it plays at its true speed, whether its feet stand.

Balance shows which way is down. While only one foot stands, the force of the ground acts at a point under
this foot, the zero moment point, and points to the body's centre of mass (Vukobratovic and Borovac 2004). The
force has two parts: one holds the body against gravity, and one accelerates it. So the standing feet and the
accelerations in a few steps show the direction of gravity, even if the body leans or the ground slopes.
"""

from dataclasses import dataclass

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, true_runs
from hobble.motion import Problem
from hobble.motion.axes import UP, unit
from hobble.motion.body import SIDES
from hobble.motion.rig import leg_length
from hobble.motion.root import facing_directions

GRAVITY = 981.0  # cm / s2
# TRUNK, HEAD: shares of the body's mass (de Leva 1996). TRUNK_CENTRE: where the trunk's centre of mass is,
# between the hips (0) and the shoulders (1). The head's centre of mass is taken to be at the head's joint.
TRUNK, TRUNK_CENTRE = 0.4346, 0.55
HEAD = 0.0694
# Segments on each side of the body: share of the body's mass, role of the first joint, role of the second
# joint, and where the segment's centre of mass is, between the first joint (0) and the second (1).
SEGMENTS = (
    (0.0271, "shoulder", "elbow", 0.577),
    (0.0162, "elbow", "wrist", 0.457),
    (0.0061, "wrist", "wrist", 0.0),
    (0.1416, "hip", "knee", 0.41),
    (0.0433, "knee", "heel", 0.446),
    (0.0137, "heel", "toe", 0.5),
)
# Seconds: standard deviation of the Gaussian that smooths positions before accelerations are computed.
SMOOTH = 0.04
# Leg lengths a second: the ball of a standing foot is slower than this. Ball and heel of a swinging foot are
# faster.
SLOW_FOOT = 0.4
UPRIGHT = 0.6  # leg lengths: hips at least this far above the standing foot, or the figure sits or kneels
SHORTEST_STANCE = 0.06  # seconds: each foot must stand alone for at least this time, or no direction is found
# PRESSED: the point between ankle (0) and ball (1) at which the force of the ground acts, for a figure that
# moves forward at the speeds SPEEDS. Speeds are divided by the square root of gravity times leg length. The
# points are means over 172 clips: of the data sets `cmu`, `styles` and `patients`, of Ferre et al. and of
# Holden et al. (2017).
SPEEDS, PRESSED = (-0.1, 0.0, 0.1), (0.45, 0.25, 1.0)
# In these clips, the direction found in runs leans forward by mistake: by LEAN degrees at the speeds
# RUN_SPEEDS, which are divided like SPEEDS. This lean is subtracted.
RUN_SPEEDS, LEAN = (0.5, 0.9), (0.0, 3.5)


@dataclass(frozen=True)
class Balance:
    """The direction against gravity, found from how the body balances.

    up: (2,) x and z of this direction, scaled to y = 1. In 172 clips, the standard deviation of its error is
    1 degree to the side and 1.9 degrees forward; in short clips it is twice as large. left: (2,) x and z of
    the mean direction to the body's left, a unit vector. seconds: how long the figure stood on the left foot
    alone or on the right foot alone, whichever is shorter.
    """

    up: Array
    left: Array
    seconds: float

    @property
    def aside(self) -> float:
        """Degrees by which the direction against gravity leans from Y towards the body's left."""
        return float(np.degrees(np.arcsin(np.clip(self.up @ self.left, -1.0, 1.0))))


def find_balance(clip: Clip) -> Balance | None:
    """The direction against gravity, or None if the body does not stand long enough on each foot alone."""
    fps, leg = clip.fps, leg_length(clip.skeleton)
    reach = max(1, round(fps / 20))  # frames: speeds of feet are measured over 50 ms before and after
    if len(clip) < 4 * reach + 3:  # no frame would be left without its ends, where speeds are not reliable
        return None
    at = clip.at_roles()
    ahead, centre = facing_directions(clip.skeleton, clip.positions, fps / 3), centre_of_mass(at)
    velocity = np.gradient(gaussian(at["hips"], 0.1 * fps), axis=0) * fps
    acceleration = np.gradient(np.gradient(gaussian(centre, SMOOTH * fps), axis=0), axis=0) * fps * fps
    # Forward speed, divided by the square root of gravity times leg length.
    speed = np.sum(velocity * ahead, axis=-1) / np.sqrt(GRAVITY * leg)
    lean = np.radians(np.interp(speed, RUN_SPEEDS, LEAN))[:, None] * ahead
    push = acceleration / (GRAVITY + acceleration[:, 1:2])
    feet = [f"{side}_{part}" for side in SIDES for part in ("toe", "heel")]
    slow = {role: _speed(at[role], reach) * fps < SLOW_FOOT * leg for role in feet}  # role -> (F,)
    ups, seconds = [], []
    for side, other in (SIDES, SIDES[::-1]):
        # `alone`: the frames in which the foot of this side stands alone.
        alone = slow[f"{side}_toe"] & ~slow[f"{other}_toe"] & ~slow[f"{other}_heel"]
        alone &= at["hips"][:, 1] - at[f"{side}_heel"][:, 1] > UPRIGHT * leg
        alone[: 2 * reach] = alone[-2 * reach :] = False
        seconds.append(float(alone.sum() / fps))
        if seconds[-1] < SHORTEST_STANCE:
            return None
        # The force points from the foot to the centre of mass. Without its part that accelerates the body
        # (`push`), it points against gravity.
        arm = centre - _pressed_point(at, side, ahead, speed)
        up = (arm / np.maximum(arm[:, 1:2], 1.0) - push - lean)[:, [0, 2]]
        ups.append(_trimmed_mean(up[alone]))
    left = np.cross([0.0, 1.0, 0.0], ahead).mean(axis=0)[[0, 2]]
    return Balance(0.5 * (ups[0] + ups[1]), left / max(float(np.linalg.norm(left)), 1e-9), min(seconds))


def centre_of_mass(at: dict[str, Array]) -> Array:
    """(..., 3) centre of mass of a body. at: role -> positions (..., 3)."""
    hips, shoulders = (0.5 * (at[f"left_{part}"] + at[f"right_{part}"]) for part in ("hip", "shoulder"))
    total = TRUNK * (hips + TRUNK_CENTRE * (shoulders - hips)) + HEAD * at["head"]
    mass = TRUNK + HEAD
    for share, start, end, centre in SEGMENTS:
        for side in SIDES:
            a, b = at[f"{side}_{start}"], at[f"{side}_{end}"]
            total = total + share * (a + centre * (b - a))
            mass += share
    return np.asarray(total / mass)


def _pressed_point(at: dict[str, Array], side: str, ahead: Array, speed: Array) -> Array:
    """(F, 3) the point under a foot at which the force of the ground acts while this foot stands alone.

    Along the direction `ahead` (F, 3) in which the body faces, it is at the share PRESSED of the way from
    ankle to ball. Sideways, it is at the share `middle`. speed: (F,), as for SPEEDS.
    """
    heel, bone, middle = at[f"{side}_heel"], at[f"{side}_toe"] - at[f"{side}_heel"], 0.6
    pressed = np.interp(speed, SPEEDS, PRESSED)[:, None]
    level = np.linalg.norm(bone * [1, 0, 1], axis=-1, keepdims=True)
    return np.asarray(heel + middle * bone + (pressed - middle) * level * ahead)


def _trimmed_mean(values: Array) -> Array:
    """(2,) mean of values (N, 2). In each column, the highest and the lowest tenth are left out."""
    low, high = np.quantile(values, [0.1, 0.9], axis=0)
    inside = (values >= low) & (values <= high)
    return np.asarray((values * inside).sum(axis=0) / inside.sum(axis=0))


def _speed(place: Array, reach: int) -> Array:
    """(F,) speed of a point, cm a frame, measured from `reach` frames before to `reach` frames after.

    place: (F, 3) its positions, cm. The first and last `reach` frames get the speed nearest to them.
    """
    steps = np.linalg.norm(place[2 * reach :] - place[: -2 * reach], axis=-1) / (2 * reach)
    return np.pad(steps, reach, mode="edge")


# Tempo: gravity sets how strongly a walking or running body accelerates. A clip with twice the true frame
# rate shows four times these accelerations. They are smoothed over a part of a step, not over a fixed time,
# so that the result does not depend on the frame rate.


FEWEST_STEPS = 4  # steps; with fewer, nothing is estimated: dances and kicks have few steps
BRIEFEST = 4  # frames; shorter steps show no accelerations
# Frames in which the hips are slower than this share of their fast speed (80th percentile) belong to no step.
MOVES = 0.25
# The binary logarithm of how many times too fast a clip plays is half that of its horizontal accelerations in
# g (root mean square) plus TEMPO[0] + TEMPO[1] s + TEMPO[2] c. Here s is the binary logarithm of the length
# of a step in leg lengths, and c is the correlation, from -.5 to .5, of the height of the hips with the
# distance between the ankles: it is negative in walks and positive in runs, in which the hips are lowest over
# the standing foot (Cavagna et al. 1977). TEMPO is a robust fit to 273 clips of CMU, LAFAN1, Holden et al.
# (2017), Ferre et al., and the data sets `styles` and `patients`; the standard deviation is .29.
TEMPO = (1.239, -0.374, -0.429)
STEPS = (0.3, 2.0)  # leg lengths: shortest and longest step for which the fit holds
# A clip gets a warning if it plays so many times too fast or too slow. Of the 273 clips, 7 get one at their
# true rates, 231 at half the rate, 239 at twice the rate, and all at a quarter.
MOST_OFF = 1.62
# If a clip plays at less than this share of its true speed, noise hides its accelerations. Then its cadence
# shows the likely frame rate.
HIDDEN = 0.41
RATES = (24, 25, 30, 60, 120, 240)  # usual frame rates of files
STILL = 3.0  # cm a second: if the hips are slower, the figure may be standing
STANDING = 0.5  # seconds: a figure that rests for a shorter time does not count as standing
# Leg lengths. A step is counted if one ankle moves from half of this behind the other to half of this ahead.
LEAST_STEP = 0.25


def rate_problem(clip: Clip, source_fps: float, scale: float) -> Problem | None:
    """A doubt if no person has the clip's accelerations: the frame rate that would explain them.

    source_fps: frame rate of the clip's file. scale: size of the clip's figure / size of the captured person.
    """
    steps, leg = step_count(clip), leg_length(clip.skeleton)
    times = times_too_fast(clip, steps, scale)
    if times is None or 1 / MOST_OFF < times < MOST_OFF:
        return None
    moves = np.linalg.norm(np.diff(clip.positions[:, clip.skeleton.role("hips")][:, [0, 2]], axis=0), axis=-1)
    step = float(moves.sum()) / steps
    if times < HIDDEN:
        # Cadence grows with step length (Grieve and Gear 1966). With steps of .8 leg lengths it is 110 a
        # minute. The relation is not extended to steps shorter than .4 or longer than 1.76 leg lengths.
        seconds = len(clip) / clip.fps - standing_seconds(moves * clip.fps, clip.fps)
        times = 60.0 * steps / seconds / (110.0 * np.clip(step / (0.8 * leg), 0.5, 2.2) ** 0.6)
    # The usual rate nearest to the one that explains the motion, but never the file's own.
    rate = min((r for r in RATES if r != source_fps), key=lambda r: abs(np.log(r * times / source_fps)))
    # Accelerations grow with the square of the speed.
    seen = f"the body's accelerations are {times**2:.{1 if times > 1 else 2}f} times those of people in steps"
    return Problem(f"{seen} of {step:.0f} cm; at {rate} fps they would be usual (source_fps: {rate})")


def times_too_fast(clip: Clip, steps: int, scale: float = 1.0) -> float | None:
    """How many times too fast a clip plays, by its accelerations. None if they cannot be measured.

    Values below 1 mean that it plays too slowly. steps: the number of steps in the clip. scale: size of the
    clip's figure / size of the captured person.
    """
    at = clip.at_roles()
    if steps < FEWEST_STEPS or len(clip) < FEWEST_STEPS * BRIEFEST:
        return None
    speed = np.linalg.norm(np.gradient(gaussian(at["hips"][:, [0, 2]], 2.0), axis=0), axis=-1)
    moves = speed > MOVES * np.percentile(speed, 80)
    step_frames = moves.sum() / steps
    if step_frames < BRIEFEST:
        return None
    centre = gaussian(centre_of_mass(at), step_frames / 12)
    acceleration = np.gradient(np.gradient(centre, axis=0), axis=0) * clip.fps**2 / (GRAVITY * scale)
    # At the ends of the clip, smoothed accelerations are unreliable.
    used, edge = moves.copy(), max(2, round(step_frames / 4))
    used[:edge] = used[-edge:] = False
    if not used.any():
        return None
    level = float(np.sqrt(np.mean(np.sum(acceleration[used][:, [0, 2]] ** 2, axis=-1))))
    step = np.log2(np.clip(speed[moves].sum() / steps / leg_length(clip.skeleton), *STEPS))
    height = gaussian(at["hips"][:, 1], step_frames / 16)
    distance = np.linalg.norm((at["left_heel"] - at["right_heel"])[:, [0, 2]], axis=-1)
    # Only changes within a step count, so slower changes are subtracted.
    height, distance = ((values - gaussian(values, step_frames / 2))[used] for values in (height, distance))
    spring = height @ distance / np.sqrt((height @ height) * (distance @ distance) + 1e-9)
    a, b, c = TEMPO
    return float(2.0 ** (0.5 * np.log2(max(level, 1e-6)) + a + b * step + c * np.clip(spring, -0.5, 0.5)))


def step_count(clip: Clip) -> int:
    """How often one ankle passes the other, seen along the facing direction.

    Before and after, the ankles must be apart by half of LEAST_STEP.
    """
    p, role = clip.positions, clip.skeleton.role
    ahead = unit(np.cross(p[:, role("left_hip")] - p[:, role("right_hip")], UP))
    # By how many cm the left ankle is ahead of the right one.
    left_ahead = np.sum((p[:, role("left_heel")] - p[:, role("right_heel")]) * ahead, axis=-1)
    far = 0.5 * LEAST_STEP * leg_length(clip.skeleton)
    foremost = np.sign(left_ahead[np.abs(left_ahead) > far])
    return int(np.count_nonzero(foremost[1:] != foremost[:-1]))


def standing_seconds(speed: Array, fps: float) -> float:
    """For how many seconds the figure stands: the hips are slower than STILL for at least STANDING.

    speed: (F-1,) speed of the hips, cm a second.
    """
    lengths = np.diff(true_runs(speed < STILL), axis=1)
    return float(lengths[lengths >= STANDING * fps].sum() / fps)


# Compares the speed of the hips with that of the feet.
#
# Relative to the hips, a standing foot moves backward as fast as the hips move forward. The two speeds differ
# if the file gives the root's positions in another unit than the bones.


# Allowed range of the quotient: speed of the hips / speed of the lower foot relative to the hips. It is .88
# to 1.17 in 172 reference clips: those of CMU, Holden et al. (2017) and Ferre et al., and of the data sets
# `styles` and `patients` (config/datasets).
LEAST_QUOTIENT, MOST_QUOTIENT = 0.5, 1.7
# The speed of a standing foot relative to the hips is assumed to lie between these percentiles of the lower
# foot's speed.
PERCENTILES = (50.0, 75.0)
IN_PLACE = 0.15  # if the quotient is smaller, the figure walks in place
SLOW = 0.5  # leg lengths a second; slower movements of hips and feet are not compared
# A foot stands if its speed is below STANDS times the speed of the hips. SPAN: seconds over which the two
# speeds are averaged.
STANDS, SPAN = 0.12, 2 / 15
# Limits of the standing share. This is the share of frames in which some foot stands, among the frames in
# which the hips move. Below SELDOM the clip gets a warning, below NEVER it is refused. The share is .29 or
# more in the 172 reference clips, and .2 after 1 cm of noise is added. With rotation channels declared in a
# wrong order it is .12 or less in 40 of 42 tries, but .25 in a walk straight along an axis.
SELDOM, NEVER = 0.27, 0.12
# Allowed range of the factor by which the hips' path must be scaled so that feet stand most often. The factor
# is .85 to 1 in the reference clips. It is below 1 because feet roll. Above NOTED_FACTOR the clip gets a
# warning, since motion that a program has made slides so far.
SHORTEST_FACTOR, NOTED_FACTOR, LONGEST_FACTOR = 0.79, 1.12, 1.25
FACTORS = np.exp(np.linspace(np.log(0.4), np.log(2.5), 47))  # the factors that are tried
FEWEST_FRAMES = 40  # frames in which the hips move; with fewer, the standing share is not computed


def speed_quotient(clip: Clip) -> float | None:
    """Speed of the hips divided by the speed of the lower foot relative to the hips.

    The lower foot's speed varies over the clip, and any value between its PERCENTILES may be that of a
    standing foot. The value that brings the quotient nearest to 1 is taken. None if the clip has fewer than
    three frames, if hips and foot are slow, or if the figure is not upright.
    """
    role, positions = clip.skeleton.role, clip.positions
    if len(positions) < 3:
        return None
    hips = positions[:, role("hips")]
    balls = np.stack([positions[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    from_hips = np.diff(balls - hips[:, None], axis=0)[..., [0, 2]]
    lower = balls[:-1, :, 1].argmin(axis=1)
    foot = from_hips[np.arange(len(from_hips)), lower]
    hips_speed = float(np.median(np.linalg.norm(np.diff(hips, axis=0)[:, [0, 2]], axis=-1)))
    slow, fast = np.percentile(np.linalg.norm(foot, axis=-1), PERCENTILES)
    leg = leg_length(clip.skeleton)
    height = float(np.median(hips[:, 1] - balls[..., 1].min(axis=1)))
    if max(hips_speed, slow) * clip.fps < SLOW * leg or height < UPRIGHT * leg:
        return None
    return hips_speed / max(float(np.clip(hips_speed, slow, fast)), 1e-3 * hips_speed)


def standing_share(clip: Clip) -> tuple[float, float] | None:
    """The share of frames in which some foot stands, and the factor by which the hips' path is scaled for it.

    The factor is the one of FACTORS that makes the share largest. Only frames in which the hips move count.
    None if there are fewer than FEWEST_FRAMES such frames.
    """
    role, places = clip.skeleton.role, clip.positions[..., [0, 2]]
    span = max(1, round(SPAN * clip.fps))  # frames
    if len(places) <= span:
        return None
    hips = places[:, role("hips")]
    balls = np.stack([places[:, role(f"{side}_toe")] for side in ("left", "right")]) - hips
    # How far the hips move within a span, and how far each foot moves relative to the hips.
    hips_moved, feet_moved = hips[span:] - hips[:-span], balls[:, span:] - balls[:, :-span]
    distance = np.linalg.norm(hips_moved, axis=-1)
    moves = distance * clip.fps / span > SLOW * leg_length(clip.skeleton)
    if moves.sum() < FEWEST_FRAMES:
        return None
    hips_moved, feet_moved, distance = hips_moved[moves], feet_moved[:, moves], distance[moves]
    shares = []
    for factor in FACTORS:
        slide = np.linalg.norm(factor * hips_moved + feet_moved, axis=-1).min(axis=0)
        shares.append(float(np.mean(slide < STANDS * factor * distance)))
    best = int(np.argmax(shares))
    return shares[best], float(FACTORS[best])


def pace_problem(clip: Clip) -> Problem | None:
    """Speeds of feet and hips that contradict each other, or feet that seldom or never stand."""
    quotient = speed_quotient(clip)
    if quotient is None or LEAST_QUOTIENT <= quotient <= MOST_QUOTIENT:
        return _standing_problem(clip)
    if quotient < IN_PLACE:
        return Problem("the legs walk, but the file hardly moves the hips, so the feet slide")
    return _unit_problem(quotient)


def _standing_problem(clip: Clip) -> Problem | None:
    """The part of `pace_problem` that uses `standing_share`."""
    standing = standing_share(clip)
    if standing is None:
        return None
    share, factor = standing
    if share < SELDOM:
        seen = f"the feet slide: while the hips move, a foot stands in {share:.0%} of the frames"
        why = "Noise, or rotation channels that are declared in another order than they were written, do this"
        return Problem(f"{seen}. {why}", "Export the clip again." if share < NEVER else "")
    if not SHORTEST_FACTOR <= factor <= LONGEST_FACTOR:
        return _unit_problem(1 / factor)
    slides = f"the feet slide: the hips go {1 / factor:.2f} times as fast as the feet step"
    return Problem(slides) if factor > NOTED_FACTOR else None


def _unit_problem(quotient: float) -> Problem:
    """A root and bones in different units. quotient: speed of the hips / speed of the feet."""
    seen = f"the hips go {quotient:.{2 if quotient < 10 else 0}f} times as fast as the feet step"
    why = "the root's positions seem to be in another unit than the OFFSETs"
    return Problem(f"{seen}, so {why}", "Export the clip again with one unit.")
