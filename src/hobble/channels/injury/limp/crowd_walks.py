"""Lets a crowd of figures walk, each with its own injury, and measures the gait cycles of each figure.

A figure is one of several copies of the character that walk at the same time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.channels.injury.crowd_severities import severity_inputs
from hobble.core.quat import Array
from hobble.gait.cycles import WalkCycles, measure_cycles
from hobble.gait.profile import Profile, profile_of_walk
from hobble.measures.walks import FPS, channel_values
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.options import Runtime

WARM_UP_FRAMES = 5 * FPS  # frames that are not measured, while figures reach their speed and begin to limp


@dataclass(frozen=True)
class FigureWalk:
    """The walk of one figure.

    walk: its gait cycles. profile: some fifty numbers that describe these cycles (see `hobble.gait.profile`);
    None if there is no whole cycle. speed: mean speed, cm a frame. frames: length of the walk in frames.
    """

    walk: WalkCycles = field(repr=False)
    profile: Profile | None = field(repr=False)
    speed: float
    frames: int


def walk_figures(
    network: Network,
    injuries: Sequence[Mapping[str, float]],
    speeds: float | Sequence[float],
    gait: str,
    seconds: float,
    runtime: Runtime,
    other_channels: Mapping[str, Sequence[Mapping[str, float]]] | None = None,
) -> list[FigureWalk]:
    """Let figures walk straight ahead for `seconds`, all in the gait `gait`. Returns the walk of each figure.

    injuries: for each figure, link -> severity. speeds: target speed in cm a frame, one for all figures or
    one for each figure. other_channels: name of another channel -> for each figure, column -> value.
    """
    assert network.skeleton is not None
    count, frames = len(injuries), max(4, round(seconds * FPS))
    animation = ProceduralAnimation(network, characters=count, **dict(runtime))
    velocity = np.zeros((count, 2))
    velocity[:, 1] = speeds
    channels = severity_inputs(network, injuries)
    for name, values in (other_channels or {}).items():
        channels |= channel_values(network, name, values)
    shares = np.tile([float(name == gait) for name in network.gaits], (count, 1))
    positions = np.zeros((frames, count, len(network.skeleton.joints), 3), np.float32)
    for frame in range(-WARM_UP_FRAMES, frames):
        pose = animation.next_pose(velocity, gait=shares.copy(), **channels)
        if frame >= 0:
            positions[frame] = pose.positions.reshape(count, -1, 3)
    return [_figure_walk(network, positions[:, i].astype(float)) for i in range(count)]


def _figure_walk(network: Network, positions: Array) -> FigureWalk:
    """The walk of one figure. positions: (F, J, 3) of its joints in the world, cm."""
    assert network.skeleton is not None
    hips = network.skeleton.role("hips")
    # Distance on the ground between the first and the last position, divided by the frames between them.
    speed = float(np.linalg.norm((positions[-1, hips] - positions[0, hips])[::2])) / (len(positions) - 1)
    walk = measure_cycles(network.skeleton, positions, FPS)
    return FigureWalk(walk, profile_of_walk(walk) if len(walk) else None, speed, len(positions))
