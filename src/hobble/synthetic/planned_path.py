"""Turns the segments of a plan into curves over time: the body's position, facing, velocity and gait."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hobble.core.quat import Array
from hobble.synthetic.recipes import CROUCH, JOG, STAND, WALK, Segment

GAITS = (STAND, WALK, JOG, CROUCH)
BLEND_SIGMA = 0.30  # seconds: sigma of the Gaussian that blends segments; a change takes about a second


@dataclass(frozen=True)
class PlannedPath:
    """A path of F frames at `fps`.

    The clip is frames `first` to F - `first` - 1. The frames before and after the clip are padding, in which
    its first steps can begin and its last steps can end.

    position: (F, 2) x and z in cm. facing: (F,) radians from +Z, positive to the left. velocity: (F, 2) cm/s
    to the left and forward, relative to the facing. gait: (F, 4) share of each gait of GAITS; they sum to 1.
    """

    fps: float
    first: int
    position: Array
    facing: Array
    velocity: Array
    gait: Array

    def __len__(self) -> int:
        return len(self.facing)

    @property
    def speed(self) -> Array:
        """(F,) speed over the ground, cm/s."""
        return np.linalg.norm(self.velocity, axis=1)


def plan_path(segments: Sequence[Segment], frames: int, fps: float) -> PlannedPath:
    """The path of a plan (a list of segments) for a clip of `frames` frames, with padding at both ends."""
    first = padding_frames(fps)
    total = frames + 2 * first
    segment = _segment_of_frame(segments, frames, fps)
    segment = np.pad(segment, (first, total - first - len(segment)), mode="edge")
    heading = np.radians([s.heading for s in segments])
    speed = np.array([s.speed for s in segments])
    planned_velocity = np.stack([speed * np.sin(heading), speed * np.cos(heading)], axis=1)[segment]
    turn_rate = np.array([np.radians(s.turn) / s.seconds for s in segments])[segment]  # radians a second
    gait = np.eye(len(GAITS))[[GAITS.index(s.gait) for s in segments]][segment]
    sigma = BLEND_SIGMA * fps
    velocity = gaussian_filter1d(planned_velocity, sigma, axis=0, mode="nearest")
    turn_rate = gaussian_filter1d(turn_rate, sigma * 0.8, mode="nearest")
    facing = np.cumsum(turn_rate) / fps
    facing -= facing[first]
    sin, cos = np.sin(facing), np.cos(facing)
    world_velocity = np.stack(
        [velocity[:, 0] * cos + velocity[:, 1] * sin, velocity[:, 1] * cos - velocity[:, 0] * sin], 1
    )
    position = np.cumsum(world_velocity, axis=0) / fps
    return PlannedPath(
        fps,
        first,
        position - position[first],
        facing,
        velocity,
        gaussian_filter1d(gait, sigma, axis=0, mode="nearest"),
    )


def padding_frames(fps: float) -> int:
    """Number of frames of padding on each side of a clip: four seconds."""
    return round(4 * fps)


def _segment_of_frame(segments: Sequence[Segment], frames: int, fps: float) -> np.ndarray:
    """(frames,) index of the segment of each frame."""
    ends = np.cumsum([s.seconds for s in segments])
    segment = np.searchsorted(ends, np.arange(frames) / fps, side="right")
    return np.minimum(segment, len(segments) - 1)


def gait_keys(segments: Sequence[Segment], frames: int, fps: float) -> list[tuple[int, str]]:
    """The gait labels as keys (frame, label). Frames count from 0. Labels fade linearly from key to key.

    A fade from one gait to another takes about a second, like the change of the motion.
    """
    labels = [segments[i].gait for i in _segment_of_frame(segments, frames, fps)]
    half_fade = round(1.6 * BLEND_SIGMA * fps)  # frames
    keys = [(0, labels[0])]
    for i in (i for i in range(1, frames) if labels[i] != labels[i - 1]):
        start = max(i - half_fade, keys[-1][0] + 1)
        end = min(max(i + half_fade, start + 1), frames - 1)
        if start < end:
            keys += [(start, labels[i - 1]), (end, labels[i])]
    return keys
