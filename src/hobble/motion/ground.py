"""Feet on the ground: where the floor of a clip is, whether its world is tilted, and heels that stand still.

In a tilted world, the ground under the feet is tilted, and the body balances along a line that is tilted
equally. On a real slope only the ground is tilted, and the body still balances along Y.
"""

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import lowest, smoothstep, true_runs
from hobble.motion import Problem
from hobble.motion.axes import UP
from hobble.motion.body import SIDES
from hobble.motion.physics import find_balance
from hobble.motion.rig import leg_length

SOLE = 3.0  # cm: height of the toe joint of a standing foot above the floor
# A clip is moved if its floor is further than this from height 0, cm. The second limit holds for figures that
# are not upright: the toes of a crawling figure hardly show where the floor is.
MOST_OFF, MOST_OFF_CRAWLING = 3.0, 15.0
UPRIGHT = 0.8  # leg lengths: in an upright figure, the hips are at least this high above the toes
# cm: on flat ground, the heights of standing feet (10th and 90th percentile) differ by at most this. In
# running they differ by 9, on gentle bumps by 14.
EVEN = 12.0
STEP = 0.25  # seconds: in a run or walk, some foot comes down within this time before and after any moment
SLOW_RISE = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
# If the feet stand in fewer frames, or for fewer seconds, they do not show where the floor is.
FEWEST_FRAMES, SHORTEST = 4, 1 / 12

# A plane, called the ground, is fitted to the balls of standing feet. Its axes are the horizontal direction
# along which the feet spread most and the one across it.
# Degrees: smaller tilts are ignored. LEAST_TILT is for axes along which the feet spread widely. Along these,
# flat ground seems tilted by at most 1.2 degrees in 172 clips of CMU, Holden et al. (2017) and Ferre et al.,
# and of the data sets `styles` and `patients` (config/datasets). LEAST_TILT_NARROW is for axes along which
# the feet spread less, and for clips that show the ground or the balance of the body less well.
LEAST_TILT, LEAST_TILT_NARROW = 4.0, 6.0
# Body and ground show the same tilt if they differ by less than this share of the ground's tilt.
MOST_APART = 0.6
FAR = 2.5  # cm; if the median distance of standing feet from the ground is larger, its slope is not used
# cm; if the 90th percentile of these distances is larger, tilts below LEAST_TILT_NARROW are ignored.
UNEVEN = 4.0
# Degrees by which the direction in which a body balances may lean to one side of Y. The limit is BALANCED if
# each foot stands alone for at least LONG seconds. For shorter times it is higher, up to BALANCED_SHORT at 0
# seconds. In the 172 clips the direction leans by at most 3.9 degrees if the time is at least LONG, and by at
# most 6 degrees if it is shorter.
BALANCED, BALANCED_SHORT, LONG = 5.0, 10.0, 0.2
# Two poses are the same if no component of a quaternion differs by more, which is 2 degrees. Steps of people
# differ by more. A cycle has more frames than SHORTEST_CYCLE.
SAME_POSE, SHORTEST_CYCLE = 0.02, 10
# The spread of feet along an axis is the standard deviation of their positions, in leg lengths. First the
# slope is measured only along axes with a spread above WIDE, then along all axes with a spread above NARROW.
# With less spread, feet show no slope.
WIDE, NARROW = 0.4, 0.05
SLOW = 0.3  # leg lengths a second; the ball of a standing foot is slower
FEWEST = 10  # if there are fewer positions of standing feet, no ground is fitted
# Number of least-squares fits. Each gives more weight to feet that were near the fit before, so that the last
# one nearly minimises the sum of distances from the ground, and a few wrong feet have little effect.
FITS = 12

STANDING = 0.8  # cm a frame at 60 Hz: a slower heel counts as standing
SHORTEST_STAND = 1 / 20  # seconds; a heel that is slow for a shorter time does not stand
RAMP = 1 / 15  # seconds over which the rotation fades in before a heel stands, and out after it
# Largest angle by which a foot is turned about each axis. Half of all frames need at most 0.3 degrees, nine
# of ten at most 3.5.
MOST_TURN = np.radians(10.5)
# cm. If the ankle is less than this above the ball, tilting hardly moves the heel and is reduced. The
# rotation about the vertical is reduced if the ankle is less than this behind the ball.
LOW = 1.5


def put_on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """Move a clip on flat ground up or down so that its floor lies at height 0, if it is too far off.

    Too far is more than MOST_OFF, or more than MOST_OFF_CRAWLING for a figure that is not upright. If the
    heights of its standing feet differ too much for flat ground, too far is more than they differ.

    Returns the clip, a sentence that it was moved, if it was, and doubts.
    """
    lower_toe = clip.positions[:, [clip.skeleton.role(f"{side}_toe") for side in SIDES], 1].min(axis=1)
    slow = np.abs(np.diff(lower_toe)) * clip.fps / 60.0 < SLOW_RISE
    standing = lower_toe[:-1][slow]
    if len(standing) < max(FEWEST_FRAMES, round(SHORTEST * clip.fps)):
        low = float(lower_toe.min())
        lost = f"No foot stands long enough to show the floor, and the toes come down to {low:.0f} cm."
        return clip, [], [lost] if abs(low) > MOST_OFF_CRAWLING else []
    floor = float(np.percentile(standing, 25)) - SOLE
    hips = clip.positions[:, clip.skeleton.role("hips"), 1]
    is_upright = np.median(hips - lower_toe) > UPRIGHT * leg_length(clip.skeleton)
    if abs(floor) <= (MOST_OFF if is_upright else MOST_OFF_CRAWLING):
        return clip, [], []
    # In a run, a toe is slow in the air, too, but within a step it has been lower.
    down = slow & (lower_toe < lowest(lower_toe, 2 * round(clip.fps * STEP) + 1) + SOLE)[:-1]
    low, high = np.percentile(lower_toe[:-1][down] if down.any() else standing, [10, 90])
    doubts = []
    if high - low > EVEN:
        heights = f"The feet stand {low:.0f} to {high:.0f} cm high, too uneven for flat ground"
        doubts = [f"{heights}: set `ground: rocky` for this clip in the data set."]
        if abs(floor) < high - low:
            return clip, [], doubts
    moved = replace(clip, root=clip.root - [0.0, floor, 0.0])
    return moved, [f"The floor lies at {floor:.1f} cm; the clip was moved so that it lies at 0."], doubts


def tilt_problem(clip: Clip) -> Problem | None:
    """A tilted world: what shows the tilt, and by how many degrees."""
    tilt = world_tilt(clip)
    if tilt is None:
        return None
    degrees, what = tilt
    seen = f"{what} by {degrees:.0f} degrees, so the whole world seems tilted"
    return Problem(seen, "Make the floor level in the program that the clip comes from, and export it again.")


def _cycle_length(clip: Clip) -> int:
    """The frames of a cycle that the whole clip only repeats, at least twice; else those of the clip."""
    rotations = clip.rotations.reshape(len(clip), -1)
    same = np.flatnonzero(np.abs(rotations[: len(clip) // 2 + 1] - rotations[0]).max(axis=1) < SAME_POSE)
    same = same[same > SHORTEST_CYCLE]
    repeats = (n for n in same if np.abs(rotations[n:] - rotations[:-n]).max() < SAME_POSE)
    return int(next(repeats, len(clip)))


def world_tilt(clip: Clip) -> tuple[float, str] | None:
    """Degrees by which the world is tilted, and what is tilted, in words. None if nothing shows a tilt."""
    leg, body = leg_length(clip.skeleton), find_balance(clip)
    if body is None:
        return None
    feet = _standing_balls(clip, SLOW * leg)
    if len(feet) >= FEWEST:
        horizontal = feet[:, [0, 2]] - feet[:, [0, 2]].mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(horizontal.T))
        slope, distances = _fitted_plane(horizontal @ axes, feet[:, 1])
        # (2,) parts, along the two axes, of the ground's normal and of the direction up the body.
        normal, lean = -slope / np.sqrt(1 + slope @ slope), body.up @ axes
        spread = np.sqrt(np.maximum(variances, 0.0))
        least = LEAST_TILT if distances[1] < UNEVEN else LEAST_TILT_NARROW
        for used, smallest in ((spread > WIDE * leg, least), (spread > NARROW * leg, LEAST_TILT_NARROW)):
            sine = float(np.linalg.norm(normal[used]))
            same = np.linalg.norm((lean - normal)[used]) < MOST_APART * sine
            if distances[0] < FAR and sine > np.sin(np.radians(smallest)) and same:
                words = f"the ground under {len(feet)} standing feet slopes, and the body leans with it,"
                return float(np.degrees(np.arcsin(min(sine, 1.0)))), words
        # The slope along an axis is uncertain by the usual distance of feet from the plane / their spread.
        error = distances[0] / np.maximum(spread, 1e-9)
        if np.linalg.norm(np.abs(slope) + error) < np.tan(np.radians(LEAST_TILT)):
            return None
    # A cycle that `hobble motion --loops` repeated shows no more than the cycle alone. Counted eight times,
    # its short stands would seem long enough to judge the balance strictly.
    if (cycle := _cycle_length(clip)) < len(clip):
        body = find_balance(clip.part(slice(cycle)))
    if body is None or abs(body.aside) < np.interp(body.seconds, [0.0, LONG], [BALANCED_SHORT, BALANCED]):
        return None
    side = "left" if body.aside > 0 else "right"
    return abs(body.aside), f"the body, on one foot, balances on a line that leans to its {side}"


def _standing_balls(clip: Clip, slow: float) -> Array:
    """Positions (N, 3) of the balls of both feet, each in the frames in which this foot stands, cm.

    slow: cm a second; the ball of a standing foot is slower.
    """
    balls = clip.positions[:, [clip.skeleton.role(f"{side}_toe") for side in SIDES]]
    reach = max(1, round(clip.fps / 20))  # speeds are measured from this many frames before to as many after
    speed = np.linalg.norm(balls[2 * reach :] - balls[: -2 * reach], axis=-1) * clip.fps / (2 * reach)
    return np.asarray(balls[reach : len(balls) - reach][speed < slow])


def _fitted_plane(horizontal: Array, height: Array) -> tuple[Array, Array]:
    """Fit a plane to points. horizontal: (N, 2) their horizontal positions, cm. height: (N,) in cm.

    Returns the slopes (2,) along both horizontal axes, and the median and the 90th percentile (2,) of the
    vertical distances of the points from the plane, cm.
    """
    points = np.column_stack([horizontal, np.ones(len(horizontal))])
    weight = np.ones(len(horizontal))
    for _ in range(FITS):
        fit = np.linalg.lstsq(points * weight[:, None], height * weight, rcond=None)[0]
        distances = np.abs(height - points @ fit)
        weight = 1.0 / np.sqrt(np.maximum(distances, 0.3))  # at least 0.3 cm, so that no weight is infinite
    return fit[:2], np.percentile(distances, [50, 90])


def steady_heels(foot: Array, heel: Array, toe: Array, fps: float) -> Array:
    """World rotations (F, 4) of a foot about its ball that keep a standing heel as still as in the source.

    Source and target are the skeletons before and after retargeting. The rotations are needed because the
    target's ankle may be higher above the ball than the source's. Then the same rotation of the foot moves
    the heel further over the ground.

    foot: (F, 3) cm from heel to ball in the world, on the target. heel, toe: (F, 3) cm, positions of heel and
    ball on the source, scaled to the target.
    """
    # From the source's heel to the target's, with both balls at the same place.
    apart = toe - foot - heel
    slide = np.zeros_like(foot)
    runs = _standing_runs(heel, STANDING * 60.0 / fps, round(fps * SHORTEST_STAND))
    for first, stop in runs:
        slide[first:stop] = apart[first:stop] - np.median(apart[first:stop], axis=0)
    slide = _bridged(slide, runs, round(fps * RAMP))
    level = foot * [1, 0, 1]
    length = np.linalg.norm(level, axis=1, keepdims=True)
    ahead = level / np.maximum(length, 1e-9)
    left = np.cross(UP, ahead)
    # A small pitch moves the heel over the ground by the angle times the heel's height above the ball, which
    # is -rise. So the angle that undoes a slide is slide / rise. If the rise is small, a pitch has little
    # effect. The formula then goes to 0 instead of to infinity.
    rise = foot[:, 1]
    pitch = np.sum(slide * ahead, axis=1) * rise**3 / (rise**4 + LOW**4)
    yaw = np.sum(slide * left, axis=1) / np.maximum(length[:, 0], LOW)
    return quat.mul(quat.yaw(_limited(yaw)), quat.from_axis_angle(left, _limited(pitch)))


def _limited(angle: Array) -> Array:
    """The angle in radians, limited smoothly to MOST_TURN. Small angles hardly change."""
    return angle / (1 + (angle / MOST_TURN) ** 6) ** (1 / 6)


def _standing_runs(point: Array, slow: float, shortest: int) -> list[tuple[int, int]]:
    """The runs of frames in which a point (F, 3) is slower than `slow`, cm a frame.

    Returns the first frame of each run and the frame after its last. shortest: runs of fewer frames are left
    out.
    """
    speed = np.linalg.norm(np.diff(point, axis=0), axis=1)
    # A slow step from one frame to the next belongs to both.
    return [(int(a), int(b) + 1) for a, b in true_runs(speed < slow) if b + 1 - a >= shortest]


def _bridged(values: Array, runs: list[tuple[int, int]], ramp: int) -> Array:
    """(F, 3) numbers that equal `values` (F, 3) within the runs and are smooth between them.

    They fade out over `ramp` frames after a run and fade in over `ramp` frames before the next. Between runs
    that are at most two ramps apart, they change smoothly from the last value of one run to the first value
    of the next. runs: as `_standing_runs` returns them.
    """
    # Keyframes and the numbers there. All frames of the runs are keyframes. So are the ends of the ramps,
    # with 0.
    key_frames: list[int] = [-ramp - 1]
    key_values: list[Array] = [np.zeros((1, 3))]
    for first, stop in runs:
        if first - key_frames[-1] > 2 * ramp:
            key_frames += [key_frames[-1] + ramp, first - ramp]
            key_values.append(np.zeros((2, 3)))
        key_frames += range(first, stop)
        key_values.append(values[first:stop])
    key_frames += [key_frames[-1] + ramp, max(len(values), key_frames[-1] + ramp) + 1]
    key_values.append(np.zeros((2, 3)))
    keys, key_value, frame = np.array(key_frames), np.concatenate(key_values), np.arange(len(values))
    after = np.searchsorted(keys, frame, side="right")
    share = (frame - keys[after - 1]) / (keys[after] - keys[after - 1])
    share = smoothstep(share)[:, None]
    return key_value[after - 1] * (1 - share) + key_value[after] * share
