"""Gait shares: the overwritten crouch of flat clips, and the gaits of a clip that nobody labelled."""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, lowest, mean
from hobble.labels.model import GAITS

STAND, WALK, JOG, CROUCH = range(4)
GRAVITY = 981.0 / 3600.0  # cm a frame, each frame

# Where a figure stands, in leg lengths a frame, and where it crouches, in the lengths of the bones below.
STANDING_SPEED = 0.0019
CROUCHED_HEAD = 0.8
CROUCHED_HIPS = 0.85

# Log odds of jog against walk, a fit to the hand-made labels of the original release and of Ferre et al. and
# to the descriptions of `cmu`. All measures are free of units, so that they hold for any size of body.
JOG_SPRING = 3.7  # hips that are lowest over the standing foot (a spring), not between two steps (a pendulum)
JOG_FLIGHT = 9.0  # share of the time in which no foot is down
JOG_DOUBLE_SUPPORT = -9.0  # share of the time in which both are
JOG_BOUNCE = 12.5  # vertical acceleration of the hips, g, up to MOST_BOUNCE: a happy walk bounces too
MOST_BOUNCE = 0.5
JOG_FROUDE = 6.0  # above FASTEST_WALK, in Froude numbers: people walk no faster than that for long
FASTEST_WALK = 0.5
JOG_CONSTANT = -3.2
# A figure that has both feet down for this share of the time, always has one down, and does not clearly
# spring, is walking, however much it bounces, as in a happy walk.
LEAST_DOUBLE_SUPPORT = 0.1
NO_FLIGHT = 0.01
CLEAR_SPRING = 0.5
# A slow figure whose feet hardly leave the ground and whose hips hardly spring skips along, and walks: on the
# happy walks of `styles` flight is .06 at most, on its slowest run .16. With a spring of .25 slow jogs of the
# original release would be walks.
SLOW, SOME_FLIGHT, SOME_SPRING = 0.35, 0.1, 0.2
MOST_ODDS_OF_A_WALK = -1.0
CERTAIN_ODDS = 2.0  # log odds that count as full evidence
DATA_SET_ODDS = 1.0  # what the data set says of the clip's main gait counts for so much
SWITCH_COST = 18.0  # frames of full evidence that a change of gait takes
FADE_FRAMES = 31
LONGEST_START = 180  # a doubtful walk between a stand and a jog belongs to the jog, if no longer than this
CLEARLY_WALKING = -4.0  # log odds in the second half of such a walk
LONGEST_PASSAGE = 75  # any other walk between the two is halved, if no longer than this


def overwrite_crouch(gait: Array, clip: Clip) -> Array:
    """Gait (F, 6) of a clip on flat ground with crouch = 1 - clip((head height - 80) / 50, 0, 1).

    The other columns stay as they are (`pfnn-facts`, Labels), so that shares need not add up to 1.
    """
    head = clip.positions[:, clip.skeleton.role("head"), 1]
    out = gait.copy()
    out[:, CROUCH] = 1 - np.clip((head - 80.0) / 50.0, 0.0, 1.0)
    return out


def automatic_gait(clip: Clip, down: np.ndarray, dominant: str | None) -> Array:
    """Gait shares (F, 6), which add up to 1, of a clip whose feet stand as `down` says.

    down: (F, 4) contacts by `contacts.stance`. dominant: the gait that the clip mostly shows; it tips the
    balance where walk and jog are alike. A jump or a bump is not recognised: where `dominant` is one of them,
    every frame but those that stand is that.
    """
    odds = jog_odds(clip, down) + {"jog": DATA_SET_ODDS, "walk": -DATA_SET_ODDS}.get(dominant or "", 0.0)
    gait = _likeliest_path(_evidence(clip, odds), SWITCH_COST)
    shares = _fade(_without_passages(gait, odds), len(GAITS))
    if dominant in ("jump", "bump"):
        shares[:, GAITS.index(dominant)] = 1 - shares[:, STAND]
        shares[:, [WALK, JOG, CROUCH]] = 0.0
    return shares


def jog_odds(clip: Clip, down: np.ndarray) -> Array:
    """(F,) log odds that a moving figure jogs and does not walk; down: (F, 4) contacts."""
    left, right = down[:, :2].any(axis=1), down[:, 2:].any(axis=1)
    flight = gaussian((~left & ~right).astype(float), 20.0)
    double_support = gaussian((left & right).astype(float), 20.0)
    # Froude number: the square of the speed over gravity times the length of the leg.
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
    skips = (froude < SLOW) & (flight <= SOME_FLIGHT) & (spring < SOME_SPRING)
    return np.where(walks | skips, np.minimum(odds, MOST_ODDS_OF_A_WALK), odds)


def _evidence(clip: Clip, odds: Array) -> Array:
    """(F, 4) how much more each of the first four gaits fits a frame than walking does, -1 to 1."""
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
    """(F,) root mean square of the vertical acceleration of the hips over half a second, g."""
    if len(clip) < 3:
        return np.zeros(len(clip))
    height = gaussian(clip.positions[:, clip.skeleton.role("hips"), 1], 2.0)
    vertical = np.clip(np.gradient(np.gradient(height)) / GRAVITY, -2.0, 2.0)
    return np.sqrt(gaussian(vertical**2, 15.0))


def _spring(clip: Clip) -> Array:
    """(F,) correlation of the height of the hips with the distance between the ankles over about a cycle.

    A walking leg is a pendulum turned upside down: the hips are highest over the standing foot, while the
    other foot passes it. A jogging leg is a spring: there the hips are lowest (Cavagna et al. 1977).
    """
    skeleton, positions = clip.skeleton, clip.positions
    height = gaussian(positions[:, skeleton.role("hips"), 1], 1.5)
    apart = positions[:, skeleton.role("left_heel")] - positions[:, skeleton.role("right_heel")]
    apart = np.linalg.norm(apart[:, [0, 2]], axis=1)
    height, apart = height - gaussian(height, 15.0), apart - gaussian(apart, 15.0)
    spread = gaussian(height**2, 25.0) * gaussian(apart**2, 25.0)
    return gaussian(height * apart, 25.0) / np.sqrt(spread + 1e-3)


def _relative_heights(clip: Clip) -> tuple[Array, Array]:
    """(F,) heights of head and hips over the feet's lowest about then, in lengths of the bones below them."""
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
    """(F,) the gaits with most evidence (F, G) in all, less `switch` for each change (Viterbi)."""
    frames, gaits = evidence.shape
    if not frames:
        return np.zeros(0, int)
    best, came_from = evidence[0].copy(), np.zeros((frames, gaits), int)
    own = np.arange(gaits)
    for i in range(1, frames):
        top = int(np.argmax(best))
        stay = best >= best[top] - switch
        came_from[i] = np.where(stay, own, top)
        best = np.where(stay, best, best[top] - switch) + evidence[i]
    path = np.empty(frames, int)
    path[-1] = np.argmax(best)
    for i in range(frames - 1, 0, -1):
        path[i - 1] = came_from[i, path[i]]
    return path


def _without_passages(gait: Array, odds: Array) -> Array:
    """Gaits (F,) without the short walks by which a figure gets from standing into a jog and back.

    odds: (F,) of `jog_odds`. Setting off into a jog is part of the jog, unless it is clearly a walk.
    """
    out = gait.copy()
    edges = np.concatenate([[0], np.flatnonzero(np.diff(gait)) + 1, [len(gait)]])
    for a, b in itertools.pairwise(edges[1:-1]):
        before, after = gait[a - 1], gait[b]
        if gait[a] != WALK or {before, after} != {STAND, JOG}:
            continue
        if after == JOG and b - a <= LONGEST_START and np.median(odds[(a + b) // 2 : b]) > CLEARLY_WALKING:
            out[a:b] = JOG
        elif b - a <= LONGEST_PASSAGE:
            middle = (a + b) // 2
            out[a:middle], out[middle:b] = before, after
    return out


def _fade(gait: Array, count: int) -> Array:
    """Shares (F, count) of gaits (F,) with a linear fade of FADE_FRAMES at every change."""
    return np.clip(mean(np.eye(count)[gait], FADE_FRAMES), 0.0, 1.0)
