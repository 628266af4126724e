"""Links and severities of a crowd of figures (copies of the character that walk at the same time).

A link is a pair of neighbouring joints. It has one severity.
"""

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
    """The links that were hurt in training; all links if none was."""
    return network.trained(INJURY)


def severities(network: Network, each: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """{"injury": (C, L) severities} of C figures; {} if the network has no such channel.

    each: for each figure, link -> severity. The other links have severity 0.
    """
    return channel_values(network, INJURY, each)
