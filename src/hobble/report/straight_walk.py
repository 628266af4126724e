"""Generates a walk straight on over flat ground, the same one for all pictures and numbers of a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hobble.models.network import Network
from hobble.runtime.animation import Pose, ProceduralAnimation
from hobble.runtime.options import Runtime

AHEAD = (0.0, 2.5)  # target velocity, cm a frame: the same as for walking in the page's section Play


def walk_straight(
    network: Network, runtime: Runtime, frames: int, channels: Mapping[str, Mapping[str, float]]
) -> Iterator[tuple[ProceduralAnimation, Pose]]:
    """The character and its pose after each frame, at 60 Hz.

    channels: channel -> column -> value; columns that are not given have 0.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    for _ in range(frames):
        yield animation, animation.next_pose(AHEAD, None, "walk", **channels)
