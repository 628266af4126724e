"""Generates a walk straight ahead over flat ground.

All parts of the report that need such a walk use this one, so that they agree.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hobble.models.network import Network
from hobble.runtime.animation import Pose, ProceduralAnimation
from hobble.runtime.options import Runtime

AHEAD = (0.0, 2.5)  # target velocity, cm a frame: as fast as walking in the page's section Play


def walk_straight(
    network: Network, runtime: Runtime, frames: int, channels: Mapping[str, Mapping[str, float]]
) -> Iterator[tuple[ProceduralAnimation, Pose]]:
    """Yields the character and its pose after each frame, at 60 Hz. The character is always the same object.

    channels: channel -> column -> value. A channel is a group of inputs of the network, such as the
    severities of injuries, and a column is one of them. Columns that are not given have the value 0.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    for _ in range(frames):
        yield animation, animation.next_pose(AHEAD, None, "walk", **channels)
