"""Gait of each frame: the crouch rule for clips on flat ground, and automatic gaits of unlabelled clips."""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, lowest, mean
from hobble.labels.clip_labels import GAITS

STAND, WALK, JOG, CROUCH = range(4)
GRAVITY = 981.0 / 3600.0  # cm per frame squared, at 60 frames per second

STANDING_SPEED = 0.0019  # leg lengths a frame; a person slower than this stands
# A person crouches if head and hips are both below these heights. The unit of each height is the length of
# the bones between that joint and the ground.
CROUCHED_HEAD = 0.8
CROUCHED_HIPS = 0.85

# Weights of measures in the log odds of jog against walk. They were fitted to the hand-made labels of Holden
# et al. (2017) and of Ferre (2019), and to the clip descriptions of the data set `cmu`. No measure
# depends on the size of the body, so the weights hold for all bodies.
JOG_SPRING = 3.7  # `_spring`: 1 if the hips are lowest over the standing foot, -1 if they are highest there
JOG_FLIGHT = 9.0  # share of the time without a foot down
JOG_DOUBLE_SUPPORT = -9.0  # share of the time with both feet down
JOG_BOUNCE = 12.5  # vertical acceleration of the hips, g
MOST_BOUNCE = 0.5  # g: a larger acceleration counts as this, because happy walks bounce
JOG_FROUDE = 6.0  # Froude number minus FASTEST_WALK, limited to 0..1
FASTEST_WALK = 0.5  # Froude number of the fastest walk that people keep up for long
JOG_CONSTANT = -3.2
# A jog has a flight phase or no double support. So a person walks, however much they bounce, if double
# support is at least LEAST_DOUBLE_SUPPORT, flight at most NO_FLIGHT, and spring below CLEAR_SPRING.
LEAST_DOUBLE_SUPPORT = 0.1
NO_FLIGHT = 0.01
CLEAR_SPRING = 0.5
# Some people hop a little in a slow, happy walk. So a person also walks if they are slow (SLOW_FROUDE), there
# is little flight (SOME_FLIGHT), and the hips do not clearly sink over the standing foot (SOME_SPRING). In
# the data set `styles` (walks in many moods), the mean flight of each happy walk is .06 or less, that of the
# slowest run is .16. If SOME_SPRING were .25, slow jogs of Holden et al. (2017) would count as walks.
SLOW_FROUDE, SOME_FLIGHT, SOME_SPRING = 0.35, 0.1, 0.2
WALK_ODDS = -1.0  # where one of these two rules finds a walk, the log odds of jogging are at most this
CERTAIN_ODDS = 2.0  # log odds that count as full evidence
DATA_SET_ODDS = 1.0  # log odds added if the data set says that a clip is mainly a jog; subtracted for a walk
SWITCH_COST = 18.0  # a change of gait costs as much as this many frames of full evidence
FADE_FRAMES = 31  # frames: length of the fade from one gait to the next
LONGEST_START = 180  # frames: a doubtful walk from standing to jogging counts as jog if at most this long
CLEARLY_WALKING = -4.0  # such a walk is doubtful if the median log odds of its second half are above this
# Frames. Any other walk between standing and jogging is split if it is at most this long: the half beside
# the standing counts as standing, the half beside the jog as jogging.
LONGEST_SHORT_WALK = 75


def overwrite_crouch(gait: Array, clip: Clip) -> Array:
    """Gait (F, 6) of a clip on flat ground, with crouch = 1 - clip((head height - 80) / 50, 0, 1).

    Heights are in cm. As in the code of Holden et al. (2017), the other columns do not change, so the sum may
    differ from 1.
    """
    head = clip.positions[:, clip.skeleton.role("head"), 1]
    out = gait.copy()
    out[:, CROUCH] = 1 - np.clip((head - 80.0) / 50.0, 0.0, 1.0)
    return out


def automatic_gait(clip: Clip, down: np.ndarray, dominant: str | None) -> Array:
    """Gait shares (F, 6) with the sum 1.

    down: (F, 4) contacts by `contacts.stance`. dominant: the clip's main gait, or None. It decides between
    walk and jog if both are about equally likely. Jumps and bumps are not recognised: if `dominant` is one of
    them, all frames get it, except those in which the person stands.
    """
    odds = jog_odds(clip, down) + {"jog": DATA_SET_ODDS, "walk": -DATA_SET_ODDS}.get(dominant or "", 0.0)
    gait = _likeliest_path(_evidence(clip, odds), SWITCH_COST)
    shares = _fade(_without_short_walks(gait, odds), len(GAITS))
    if dominant in ("jump", "bump"):
        shares[:, GAITS.index(dominant)] = 1 - shares[:, STAND]
        shares[:, [WALK, JOG, CROUCH]] = 0.0
    return shares


def jog_odds(clip: Clip, down: np.ndarray) -> Array:
    """(F,) log odds that a person in motion jogs rather than walks. down: (F, 4) contacts."""
    left, right = down[:, :2].any(axis=1), down[:, 2:].any(axis=1)
    flight = gaussian((~left & ~right).astype(float), 20.0)
    double_support = gaussian((left & right).astype(float), 20.0)
    # Froude number: speed squared / (gravity * leg length).
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
    low = np.clip(np.minimum(CROUCHED_HEAD - head, CROUCHED_HIPS - hips) / 0.08, -1.0, 1.0)
    stand = np.where(low > 0, -1.0, stand)
    jog = np.clip(odds / CERTAIN_ODDS, -1.0, 1.0)
    return np.stack([stand, np.zeros(len(clip)), jog, low], axis=1)


def _speed(clip: Clip) -> Array:
    """(F,) speed of the hips along the ground, cm a frame."""
    if len(clip) < 3:
        return np.zeros(len(clip))
    ground = gaussian(clip.positions[:, clip.skeleton.role("hips")][:, [0, 2]], 3.0)
    return gaussian(np.linalg.norm(np.gradient(ground, axis=0), axis=1), 10.0)


def _bounce(clip: Clip) -> Array:
    """(F,) root mean square of the hips' vertical acceleration over half a second, in units of gravity."""
    if len(clip) < 3:
        return np.zeros(len(clip))
    height = gaussian(clip.positions[:, clip.skeleton.role("hips"), 1], 2.0)
    vertical = np.clip(np.gradient(np.gradient(height)) / GRAVITY, -2.0, 2.0)
    return np.sqrt(gaussian(vertical**2, 15.0))


def _spring(clip: Clip) -> Array:
    """(F,) correlation of the hips' height with the distance between the heel joints, over about a cycle.

    A walking leg is an inverted pendulum: the hips are highest over the standing foot, while the other
    foot swings past it. A jogging leg is a spring: the hips are lowest there (Cavagna et al. 1977).
    """
    skeleton, positions = clip.skeleton, clip.positions
    height = gaussian(positions[:, skeleton.role("hips"), 1], 1.5)
    apart = positions[:, skeleton.role("left_heel")] - positions[:, skeleton.role("right_heel")]
    apart = np.linalg.norm(apart[:, [0, 2]], axis=1)
    height, apart = height - gaussian(height, 15.0), apart - gaussian(apart, 15.0)
    spread = gaussian(height**2, 25.0) * gaussian(apart**2, 25.0)
    return gaussian(height * apart, 25.0) / np.sqrt(spread + 1e-3)


def _relative_heights(clip: Clip) -> tuple[Array, Array]:
    """(F,) heights of head and hips above the floor, each divided by the length of the bones below.

    The floor is the mean of the lowest heights of both toes in the 61 frames around each frame.
    """
    skeleton, y = clip.skeleton, clip.positions[..., 1]
    toes = y[:, [skeleton.role("left_toe"), skeleton.role("right_toe")]]
    floor = lowest(toes, 61).mean(axis=1)
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    leg = skeleton.leg_length
    trunk, joint = 0.0, skeleton.role("head")
    while joint != skeleton.role("hips") and skeleton.parents[joint] >= 0:
        trunk += lengths[joint]
        joint = skeleton.parents[joint]
    head = (y[:, skeleton.role("head")] - floor) / (leg + trunk)
    return head, (y[:, skeleton.role("hips")] - floor) / leg


def _likeliest_path(evidence: Array, switch: float) -> Array:
    """(F,) the sequence of gaits with the highest sum of evidence, less `switch` for each change (Viterbi).

    evidence: (F, G) of G gaits.
    """
    frames, gaits = evidence.shape
    if not frames:
        return np.zeros(0, int)
    best, came_from = evidence[0].copy(), np.zeros((frames, gaits), int)
    unchanged = np.arange(gaits)
    for i in range(1, frames):
        top = int(np.argmax(best))
        stay = best >= best[top] - switch
        came_from[i] = np.where(stay, unchanged, top)
        best = np.where(stay, best, best[top] - switch) + evidence[i]
    path = np.empty(frames, int)
    path[-1] = np.argmax(best)
    for i in range(frames - 1, 0, -1):
        path[i - 1] = came_from[i, path[i]]
    return path


def _without_short_walks(gait: Array, odds: Array) -> Array:
    """Gaits (F,) without short walks between standing and jogging (LONGEST_START, LONGEST_SHORT_WALK).

    odds: (F,) of `jog_odds`.
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


def _fade(gait: Array, count: int) -> Array:
    """(F, count) shares of gaits (F,), with a linear fade of FADE_FRAMES at every change."""
    return np.clip(mean(np.eye(count)[gait], FADE_FRAMES), 0.0, 1.0)
