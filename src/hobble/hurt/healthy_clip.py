"""Measures the healthy clip (the source) before it is changed: stances, heading, path, lengths of cycles."""

import itertools
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian, smoothstep
from hobble.hurt.effects import LEFT, RIGHT, SIDES
from hobble.labels.clip_labels import GAITS, Labels
from hobble.labels.footfall import find_swings
from hobble.labels.phase import phase_of_footsteps

UP, FORWARD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
CYCLE_SECONDS = 1.1  # assumed length of a cycle in clips without one
LONGEST_CYCLE_SECONDS = 2.5  # a longer time between two landings of a foot is not a cycle
LEAST_SWING = 6  # frames: contacts in the labels shorten a swing, but not below this length
PATH_SECONDS = 0.25  # sigma of the Gaussian that smooths the hips' positions to a path
HEADING_SECONDS = 0.2  # sigma of the Gaussian that smooths the heading
SWAY = 0.3  # a smaller share of movement to a side is only the sway of a walk
STANDING_SPEED = 30.0  # cm/s: below this, movement to a side counts less
PHASE_KNOWN_SECONDS = 0.2  # sigma of the Gaussian that smooths `phase_known`
GAIT_SECONDS = 0.1  # sigma of the Gaussian that smooths the share of a gait


@dataclass(frozen=True)
class SourceStance:
    """A foot on the ground from source frame `land` to `off`."""

    land: int
    off: int

    @property
    def middle(self) -> float:
        """The source frame, with fractions, in the middle of the stance."""
        return (self.land + self.off) / 2


@dataclass(frozen=True)
class HealthyClip:
    """A healthy clip of F frames and its measurements. Pairs are left and right.

    stances: those of each foot, in order, at least one. swinging: (F, 2) bool, whether a foot swings.
    swing_curve: (F, 2) 0 in stance; it rises to 1 and falls back to 0 over a swing. phase: (F,) cycles,
    unwrapped; a whole number as the right foot lands. phase_known: (F,) 1 where the phase is known, 0 where
    it is not, smoothed. jog_share: (F,) share of jogging in the gait, 0 to 1. cycle_frames: (F,) length in
    frames of the cycle around each frame. path: (F, 2) horizontal path of the hips, x and z, cm. heading:
    (F, 4) rotation of the pelvis about Y. aside: (F,) share of the movement to a side or backward, 0 to 1.
    low: (F,) share of crouching in the gait, 0 to 1.
    leg_length: cm from hip to ankle of a straight leg.
    """

    clip: Clip
    stances: list[list[SourceStance]] = field(repr=False)
    swinging: np.ndarray = field(repr=False)
    swing_curve: Array = field(repr=False)
    phase: Array = field(repr=False)
    phase_known: Array = field(repr=False)
    jog_share: Array = field(repr=False)
    cycle_frames: Array = field(repr=False)
    path: Array = field(repr=False)
    heading: Array = field(repr=False)
    aside: Array = field(repr=False)
    low: Array = field(repr=False)
    leg_length: float

    def __len__(self) -> int:
        return len(self.clip)


def measure_healthy_clip(clip: Clip, labels: Labels) -> HealthyClip:
    """Measure a healthy clip. labels: its contacts, footsteps and gait."""
    frames, skeleton = len(clip), clip.skeleton
    all_swings = find_swings(clip)
    stances: list[list[SourceStance]] = []
    swinging, swing_curve = np.zeros((frames, 2), bool), np.zeros((frames, 2))
    for side in (LEFT, RIGHT):
        # `find_swings` numbers the right foot 0, the left one 1.
        swings = [(s.start, min(s.end, frames - 1)) for s in all_swings if s.foot == 1 - side]
        touches = np.asarray(labels.contacts[:, 2 * side : 2 * side + 2].any(axis=1))
        swings = [_without_contacts(start, end, touches) for start, end in swings]
        for start, end in swings:
            swinging[start:end, side] = True
            share = (np.arange(start, end) - start + 0.5) / max(end - start, 1)  # of the swing's time
            swing_curve[start:end, side] = np.sin(np.pi * share) ** 2
        # Stances fill the time before, between and after the swings.
        ends = [0, *itertools.chain(*swings), frames - 1]
        pairs = zip(ends[::2], ends[1::2], strict=True)
        stances.append([SourceStance(land, max(land, off)) for land, off in pairs])
    phase, known = phase_of_footsteps(labels.footsteps, frames)
    change = np.diff(phase, prepend=phase[:1])
    path = gaussian(clip.positions[:, skeleton.role("hips")][:, [0, 2]], PATH_SECONDS * clip.fps)
    heading = _heading(clip)
    return HealthyClip(
        clip,
        stances,
        swinging,
        swing_curve,
        phase[0] + np.cumsum(np.where(change < -0.5, change + 1.0, change)),
        gaussian(known.astype(float), PHASE_KNOWN_SECONDS * clip.fps),
        _share_of_gait(labels, "jog", clip.fps),
        _cycle_lengths(stances, frames, clip.fps),
        path,
        heading,
        _aside(path, heading, clip.fps),
        _share_of_gait(labels, "crouch", clip.fps),
        skeleton.leg_length,
    )


def _share_of_gait(labels: Labels, name: str, fps: float) -> Array:
    """(F,) share of the gait `name` in the labels, smoothed."""
    return gaussian(labels.gait[:, GAITS.index(name)], GAIT_SECONDS * fps)


def _without_contacts(start: int, end: int, touches: np.ndarray) -> tuple[int, int]:
    """The swing without the frames at its ends in which the foot touches the ground.

    touches: (F,) bool, whether the labels have a contact of the foot.
    """
    while end - start > LEAST_SWING and touches[start]:
        start += 1
    while end - start > LEAST_SWING and touches[end - 1]:
        end -= 1
    return start, end


def _cycle_lengths(stances: list[list[SourceStance]], frames: int, fps: float) -> Array:
    """(frames,) length of the cycle around each frame: frames from a foot's landing to its next landing.

    The cycles of both feet count. The lengths are interpolated between the middles of the cycles. The first
    stance of a foot is left out, because it begins with the clip and not with a landing.
    """
    cycles = sorted(
        ((a.land + b.land) / 2, b.land - a.land)
        for of_foot in stances
        for a, b in itertools.pairwise(of_foot[1:])
        if b.land - a.land <= LONGEST_CYCLE_SECONDS * fps
    )
    if not cycles:
        return np.full(frames, CYCLE_SECONDS * fps)
    middles, lengths = np.array(cycles).T
    return np.interp(np.arange(frames), middles, lengths)


def _heading(clip: Clip) -> Array:
    """(F, 4) rotation about Y from +Z to the direction in which the pelvis faces."""
    left, right = (clip.positions[:, clip.skeleton.role(f"{side}_hip")] for side in SIDES)
    forward = gaussian(np.cross(left - right, UP), HEADING_SECONDS * clip.fps)
    return quat.yaw(np.arctan2(forward[:, 0], forward[:, 2]))


def _aside(path: Array, heading: Array, fps: float) -> Array:
    """(F,) share of the movement along `path` (F, 2) to a side of `heading` (F, 4) or backward.

    It is 0 for a standing body.
    """
    velocity = np.gradient(path, axis=0) * fps
    ahead, across = (
        np.sum(velocity * quat.rotate(heading, axis)[:, [0, 2]], axis=1) for axis in np.eye(3)[[2, 0]]
    )
    share = np.maximum(np.abs(across), -ahead) / np.maximum(np.linalg.norm(velocity, axis=1), STANDING_SPEED)
    return gaussian(smoothstep((share - SWAY) / (1 - 2 * SWAY)), HEADING_SECONDS * fps)


# Interpolates arrays that have a value for each frame, at times between frames.


def interpolate_values(values: Array, when: Array) -> Array:
    """Interpolate values (F, ...) linearly at the times `when` (N,), in frames. Returns (N, ...)."""
    before, share = _split_times(len(values), when)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return values[before] * (1 - share) + values[np.minimum(before + 1, len(values) - 1)] * share


def interpolate_rotations(rotations: Array, when: Array) -> Array:
    """Interpolate quaternions (F, ..., 4) at the times `when` (N,), in frames. Returns (N, ..., 4)."""
    before, share = _split_times(len(rotations), when)
    share = share.reshape(-1, *[1] * (rotations.ndim - 2))
    return quat.slerp(rotations[before], rotations[np.minimum(before + 1, len(rotations) - 1)], share)


def _split_times(frames: int, when: Array) -> tuple[np.ndarray, Array]:
    """Split each time (N,) into the frame before it, int (N,), and the share of a frame after that, (N,).

    Times outside the clip of `frames` frames are moved to its first or last frame.
    """
    when = np.clip(when, 0.0, frames - 1.0)
    # A time that misses a whole frame only by a rounding error counts as this frame.
    nearest = np.round(when)
    when = np.where(np.abs(when - nearest) < 1e-9, nearest, when)
    before = np.floor(when).astype(int)
    return before, when - before
