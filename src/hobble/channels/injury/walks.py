"""What figures of a crowd are told of this channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hobble.core.quat import Array
from hobble.evaluation.crowd import channel_values
from hobble.models.network import Network

INJURY = "injury"  # the channel


def links(network: Network) -> tuple[str, ...]:
    """The links that a network is told; none where it knows no injuries."""
    return network.channels.get(INJURY, ())


def hurt_links(network: Network) -> tuple[str, ...]:
    """Those that were hurt in training."""
    return network.trained(INJURY)


def severities(network: Network, each: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """What a stretch tells figures given as link -> severity."""
    return channel_values(network, INJURY, each)
