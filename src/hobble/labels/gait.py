"""Finds the gait of each frame from the motion, for clips without gait files. Also a rule for crouching."""

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, lowest, mean
from hobble.labels.clip_labels import GAITS

STAND, WALK, JOG, CROUCH = range(4)
GRAVITY = 981.0 / 3600.0  # cm per frame squared, at 60 frames per second

STANDING_SPEED = 0.0019  # leg lengths a frame; a person slower than this stands
# A person crouches if head and hips are both below these heights. The head's height is in lengths of leg and
# trunk together, the hips' height is in leg lengths.
CROUCHED_HEAD = 0.8
CROUCHED_HIPS = 0.85
CERTAIN_DEPTH = 0.08  # if head and hips are lower than these limits by this, the crouch is certain

# The log odds of jog against walk are a weighted sum of measures. The comment of each weight says what its
# measure is. The weights were fitted to the hand-made labels of Holden et al. (2017) and of Ferre (2019), and
# to the clip descriptions of the data set `cmu`. No measure depends on the size of the body, so the weights
# hold for all bodies.
JOG_SPRING = 3.7  # `_spring`: 1 if the hips are lowest over the standing foot, -1 if they are highest there
JOG_FLIGHT = 9.0  # share of the time without a foot down
JOG_DOUBLE_SUPPORT = -9.0  # share of the time with both feet down (double support)
JOG_BOUNCE = 12.5  # vertical acceleration of the hips, g
MOST_BOUNCE = 0.5  # g: a larger acceleration counts as this, because people also bounce in happy walks
JOG_FROUDE = 6.0  # Froude number (speed squared / (gravity * leg length)) minus FASTEST_WALK, limited to 0..1
FASTEST_WALK = 0.5  # Froude number of the fastest walk that people keep up for long
JOG_CONSTANT = -3.2  # added to the sum
# A jog has a flight phase or no double support. So a person walks if double support is at least
# LEAST_DOUBLE_SUPPORT, flight is at most NO_FLIGHT, and `_spring` is below CLEAR_SPRING, even if the person
# bounces much.
LEAST_DOUBLE_SUPPORT = 0.1
NO_FLIGHT = 0.01
CLEAR_SPRING = 0.5
# Some people hop a little in a slow, happy walk. So a person also walks if the Froude number is below
# SLOW_FROUDE, flight is at most SOME_FLIGHT, and `_spring` is below SOME_SPRING (the hips do not clearly sink
# over the standing foot). In the data set `styles` (walks in many moods), the mean flight is .06 or less in
# each happy walk, and .16 in the slowest run. If SOME_SPRING were .25, slow jogs of Holden et al. (2017)
# would count as walks.
SLOW_FROUDE, SOME_FLIGHT, SOME_SPRING = 0.35, 0.1, 0.2
WALK_ODDS = -1.0  # where one of these two rules finds a walk, the log odds of jogging are at most this
CERTAIN_ODDS = 2.0  # log odds that count as full evidence
DATA_SET_ODDS = 1.0  # log odds added if the data set says that a clip is mainly a jog; subtracted for a walk
SWITCH_COST = 18.0  # a change of gait costs as much as this many frames of full evidence
FADE_FRAMES = 31  # length of the fade from one gait to the next
# What seems to be a walk from standing to jogging may be the first steps of the jog. It counts as jog if it
# has at most LONGEST_START frames and the median log odds of its second half are above CLEARLY_WALKING.
LONGEST_START = 180
CLEARLY_WALKING = -4.0
# Any other walk between standing and jogging, in either order, is divided if it has at most this many frames.
# The half beside the standing counts as standing, the half beside the jog as jogging.
LONGEST_SHORT_WALK = 75


def overwrite_crouch(gait: Array, clip: Clip) -> Array:
    """Replace the share of crouch in the gait (F, 6) of a clip on flat ground. Returns the new gait (F, 6).

    The new share depends on the height of the head only: it is 1 at 80 cm or less, and 0 at 130 cm or more.
    As in the code of Holden et al. (2017), the other shares stay, so the sum may differ from 1.
    """
    head = clip.positions[:, clip.skeleton.role("head"), 1]
    out = gait.copy()
    out[:, CROUCH] = 1 - np.clip((head - 80.0) / 50.0, 0.0, 1.0)
    return out


def automatic_gait(clip: Clip, down: np.ndarray, dominant: str | None) -> Array:
    """Find the gait from the motion. Returns shares (F, 6) of GAITS, whose sum is 1.

    down: (F, 4) contacts from `hobble.labels.footfall.find_stance_contacts`. dominant: the clip's main gait,
    or None if it is not known. It decides between walk and jog if both are about equally likely. "jump" and
    "bump" are not recognised: if `dominant` is one of them, all frames get it, except those in which the
    person stands.
    """
    odds = jog_odds(clip, down) + {"jog": DATA_SET_ODDS, "walk": -DATA_SET_ODDS}.get(dominant or "", 0.0)
    gait = _likeliest_path(_evidence(clip, odds))
    # At every change the shares fade linearly over FADE_FRAMES.
    shares = np.clip(mean(np.eye(len(GAITS))[_without_short_walks(gait, odds)], FADE_FRAMES), 0.0, 1.0)
    if dominant in ("jump", "bump"):
        shares[:, GAITS.index(dominant)] = 1 - shares[:, STAND]
        shares[:, [WALK, JOG, CROUCH]] = 0.0
    return shares


def jog_odds(clip: Clip, down: np.ndarray) -> Array:
    """(F,) log odds that a person in motion jogs rather than walks. down: (F, 4) contacts."""
    left, right = down[:, :2].any(axis=1), down[:, 2:].any(axis=1)
    flight = gaussian((~left & ~right).astype(float), 20.0)
    double_support = gaussian((left & right).astype(float), 20.0)
    froude = _speed(clip) ** 2 / (GRAVITY * clip.skeleton.leg_length)
    spring = _spring(clip)
    odds = (
        JOG_SPRING * spring
        + JOG_FLIGHT * flight
        + JOG_DOUBLE_SUPPORT * double_support
        + JOG_BOUNCE * np.minimum(_bounce(clip), MOST_BOUNCE)
        + JOG_FROUDE * np.clip(froude - FASTEST_WALK, 0.0, 1.0)
        + JOG_CONSTANT
    )
    walks = (double_support >= LEAST_DOUBLE_SUPPORT) & (flight <= NO_FLIGHT) & (spring < CLEAR_SPRING)
    slow_walk = (froude < SLOW_FROUDE) & (flight <= SOME_FLIGHT) & (spring < SOME_SPRING)
    return np.where(walks | slow_walk, np.minimum(odds, WALK_ODDS), odds)


def _evidence(clip: Clip, odds: Array) -> Array:
    """(F, 4) evidence, -1 to 1, for each of the first four GAITS compared with walking."""
    speed = _speed(clip) / clip.skeleton.leg_length
    stand = np.clip((STANDING_SPEED - speed) / STANDING_SPEED, -1.0, 1.0)
    head, hips = _relative_heights(clip)
    crouch = np.clip(np.minimum(CROUCHED_HEAD - head, CROUCHED_HIPS - hips) / CERTAIN_DEPTH, -1.0, 1.0)
    stand = np.where(crouch > 0, -1.0, stand)
    jog = np.clip(odds / CERTAIN_ODDS, -1.0, 1.0)
    return np.stack([stand, np.zeros(len(clip)), jog, crouch], axis=1)


def _speed(clip: Clip) -> Array:
    """(F,) speed of the hips along the ground, cm a frame."""
    if len(clip) < 3:
        return np.zeros(len(clip))
    ground = gaussian(clip.positions[:, clip.skeleton.role("hips")][:, [0, 2]], 3.0)
    return gaussian(np.linalg.norm(np.gradient(ground, axis=0), axis=1), 10.0)


def _bounce(clip: Clip) -> Array:
    """(F,) root mean square of the hips' vertical acceleration over about half a second, in g."""
    if len(clip) < 3:
        return np.zeros(len(clip))
    height = gaussian(clip.positions[:, clip.skeleton.role("hips"), 1], 2.0)
    vertical = np.clip(np.gradient(np.gradient(height)) / GRAVITY, -2.0, 2.0)
    return np.sqrt(gaussian(vertical**2, 15.0))


def _spring(clip: Clip) -> Array:
    """(F,) correlation of the hips' height with the distance between the heel joints, over about a cycle.

    The heels are close together while one foot stands and the other foot swings past it. At this moment, the
    hips of a walking person are highest, because the leg works as an inverted pendulum. The hips of a jogging
    person are lowest, because the leg works as a spring (Cavagna et al. 1977). So the correlation is negative
    for a walk and positive for a jog.
    """
    skeleton, positions = clip.skeleton, clip.positions
    height = gaussian(positions[:, skeleton.role("hips"), 1], 1.5)
    apart = positions[:, skeleton.role("left_heel")] - positions[:, skeleton.role("right_heel")]
    apart = np.linalg.norm(apart[:, [0, 2]], axis=1)
    height, apart = height - gaussian(height, 15.0), apart - gaussian(apart, 15.0)
    spread = gaussian(height**2, 25.0) * gaussian(apart**2, 25.0)
    return gaussian(height * apart, 25.0) / np.sqrt(spread + 1e-3)


def _relative_heights(clip: Clip) -> tuple[Array, Array]:
    """Heights of head and hips above the floor, (F,) each, divided by the length of the bones below them.

    The floor is the mean of two heights: the lowest height of each toe in the 61 frames around a frame.
    """
    skeleton, y = clip.skeleton, clip.positions[..., 1]
    toes = y[:, [skeleton.role("left_toe"), skeleton.role("right_toe")]]
    floor = lowest(toes, 61).mean(axis=1)
    head, hips, leg = skeleton.role("head"), skeleton.role("hips"), skeleton.leg_length
    trunk = sum(float(np.linalg.norm(skeleton.offsets[j])) for j in skeleton.path_up(head, hips))
    return (y[:, head] - floor) / (leg + trunk), (y[:, hips] - floor) / leg


def _likeliest_path(evidence: Array) -> Array:
    """(F,) the most likely gait of each frame: an index of the G gaits.

    Of all sequences of gaits, this one has the highest sum of `evidence` (F, G), minus SWITCH_COST for each
    change of gait (Viterbi algorithm).
    """
    frames, gaits = evidence.shape
    if not frames:
        return np.zeros(0, int)
    # best: for each gait, the sum of the best sequence that ends with it. came_from: its gait a frame before.
    best, came_from = evidence[0].copy(), np.zeros((frames, gaits), int)
    unchanged = np.arange(gaits)
    for i in range(1, frames):
        top = int(np.argmax(best))
        stay = best >= best[top] - SWITCH_COST
        came_from[i] = np.where(stay, unchanged, top)
        best = np.where(stay, best, best[top] - SWITCH_COST) + evidence[i]
    path = np.empty(frames, int)
    path[-1] = np.argmax(best)
    for i in range(frames - 1, 0, -1):
        path[i - 1] = came_from[i, path[i]]
    return path


def _without_short_walks(gait: Array, odds: Array) -> Array:
    """Replace short walks between standing and jogging, as LONGEST_START and LONGEST_SHORT_WALK say.

    gait: (F,) indices of GAITS. odds: (F,) from `jog_odds`. Returns the new gaits (F,).
    """
    out = gait.copy()
    edges = np.concatenate([[0], np.flatnonzero(np.diff(gait)) + 1, [len(gait)]])
    for a, b in itertools.pairwise(edges[1:-1]):
        before, after = gait[a - 1], gait[b]
        if gait[a] != WALK or {before, after} != {STAND, JOG}:
            continue
        if after == JOG and b - a <= LONGEST_START and np.median(odds[(a + b) // 2 : b]) > CLEARLY_WALKING:
            out[a:b] = JOG
        elif b - a <= LONGEST_SHORT_WALK:
            middle = (a + b) // 2
            out[a:middle], out[middle:b] = before, after
    return out
