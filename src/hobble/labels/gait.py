"""Gait shares: the overwritten crouch of flat clips, and the gaits of a clip that nobody labelled."""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, lowest, mean
from hobble.labels.footfall import Swing, feet_up
from hobble.labels.model import GAITS

STAND, WALK, JOG, CROUCH = range(4)
GRAVITY = 981.0 / 3600.0

# Each is where the evidence for a gait outweighs that for walking; set once on the labelled clips.
STANDING_SPEED = 0.15
JOG_BOUNCE = 0.24
JOG_FLIGHT = 0.35
JOG_SPEED = 3.2
CROUCHED_HEAD = 0.8
CROUCHED_HIPS = 0.85
SAID = 0.3
SWITCH = 14.0
FADE = 31
PASSING = 75


def overwrite_crouch(gait: Array, clip: Clip) -> Array:
    """Gait (F, 6) of a clip on flat ground with crouch = 1 - clip((head height - 80) / 50, 0, 1).

    The other columns stay as they are (`pfnn-facts`, Labels), so that shares need not add up to 1.
    """
    head = clip.positions[:, clip.skeleton.role("head"), 1]
    out = gait.copy()
    out[:, CROUCH] = 1 - np.clip((head - 80.0) / 50.0, 0.0, 1.0)
    return out


def automatic_gait(clip: Clip, swings: list[Swing], dominant: str | None) -> Array:
    """Gait shares (F, 6), which add up to 1, of a clip whose feet swing as `swings` say.

    dominant: the gait it mostly shows, which tips the balance where walk and jog are alike. A jump or a bump
    is not recognised; where `dominant` is one of them, every frame but those that stand is that.
    """
    gait = _likeliest_path(_evidence(clip, swings, dominant), SWITCH)
    shares = _fade(_without_passing(gait), len(GAITS))
    if dominant in ("jump", "bump"):
        shares[:, GAITS.index(dominant)] = 1 - shares[:, STAND]
        shares[:, [WALK, JOG, CROUCH]] = 0.0
    return shares


def _evidence(clip: Clip, swings: list[Swing], dominant: str | None) -> Array:
    """(F, 4) how much more each of the first four gaits fits a frame than walking does, -1 to 1."""
    frames = len(clip)
    speed, bounce = _speed_and_bounce(clip)
    flight = gaussian(feet_up(swings, frames).all(axis=1).astype(float), 15.0)
    fast = 0.5 * np.clip(speed - JOG_SPEED, -1.0, 2.0)
    jog = bounce / JOG_BOUNCE + flight / JOG_FLIGHT + fast - 2.0
    jog += {"jog": SAID, "walk": -SAID}.get(dominant or "", 0.0)
    stand = np.clip((STANDING_SPEED - speed) / 0.15, -1.0, 1.0)
    head, hips = _relative_heights(clip)
    low = np.clip(np.minimum(CROUCHED_HEAD - head, CROUCHED_HIPS - hips) / 0.08, -1.0, 1.0)
    stand = np.where(low > 0, -1.0, stand)
    return np.stack([stand, np.zeros(frames), np.clip(jog, -1.0, 1.0), low], axis=1)


def _speed_and_bounce(clip: Clip) -> tuple[Array, Array]:
    """(F,) speed of the hips along the ground, cm a frame, and root mean square of their vertical
    acceleration, g.

    Jogging bounces the hips by a third of a gravity and more, on the spot too; walking by a quarter and less,
    but for turns and brisk walks, which speed tells from a jog.
    """
    if len(clip) < 3:
        return np.zeros(len(clip)), np.zeros(len(clip))
    hips = clip.positions[:, clip.skeleton.role("hips")]
    ground = gaussian(hips[:, [0, 2]], 3.0)
    speed = np.linalg.norm(np.gradient(ground, axis=0), axis=1)
    height = gaussian(hips[:, 1], 2.0)
    vertical = np.clip(np.gradient(np.gradient(height)) / GRAVITY, -2.0, 2.0)
    bounce = np.sqrt(gaussian(vertical**2, 15.0))
    return gaussian(speed, 10.0), bounce


def _relative_heights(clip: Clip) -> tuple[Array, Array]:
    """(F,) heights of head and hips over the feet's lowest about then, in lengths of the bones below them."""
    skeleton, y = clip.skeleton, clip.positions[..., 1]
    toes = y[:, [skeleton.role("left_toe"), skeleton.role("right_toe")]]
    floor = lowest(toes, 61).mean(axis=1)
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    leg = lengths[skeleton.role("left_knee")] + lengths[skeleton.role("left_heel")]
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


def _without_passing(gait: Array) -> Array:
    """Gaits (F,) in which a short walk from standing into a jog, or back, is halved between the two."""
    out = gait.copy()
    edges = np.concatenate([[0], np.flatnonzero(np.diff(gait)) + 1, [len(gait)]])
    for a, b in itertools.pairwise(edges[1:-1]):
        before, after = gait[a - 1], gait[b]
        if gait[a] == WALK and {before, after} == {STAND, JOG} and b - a <= PASSING:
            middle = (a + b) // 2
            out[a:middle], out[middle:b] = before, after
    return out


def _fade(gait: Array, count: int) -> Array:
    """Shares (F, count) of gaits (F,) with a linear fade of FADE frames at every change."""
    return np.clip(mean(np.eye(count)[gait], FADE), 0.0, 1.0)
