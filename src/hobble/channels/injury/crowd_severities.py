"""Links and severities of the figures in a crowd."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hobble.core.quat import Array
from hobble.evaluation.crowd import channel_values
from hobble.models.network import Network

INJURY = "injury"  # the channel


def links(network: Network) -> tuple[str, ...]:
    """The links of a network's injury channel; empty if it has none."""
    return network.channels.get(INJURY, ())


def hurt_links(network: Network) -> tuple[str, ...]:
    """The links that were hurt in training."""
    return network.trained(INJURY)


def severities(network: Network, each: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """{"injury": (C, L) severities} of C figures; {} without such a channel. each: link -> severity."""
    return channel_values(network, INJURY, each)
