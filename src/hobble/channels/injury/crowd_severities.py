"""The severities of a crowd of figures, as inputs of a network.

A figure is one of several copies of the character that walk at the same time. A link is a pair of
neighbouring joints, such as hip and knee. A severity from 0 to 10 says how much a link hurts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hobble.core.quat import Array
from hobble.measures.walks import channel_values
from hobble.models.network import Network

INJURY = "injury"  # name of the channel


def injury_links(network: Network) -> tuple[str, ...]:
    """Names of the links of a network's injury channel; () if the network lacks this channel."""
    return network.channels.get(INJURY, ())


def links_hurt_in_training(network: Network) -> tuple[str, ...]:
    """Names of the links that were hurt in training; all links if none was hurt."""
    return network.trained_labels(INJURY)


def severity_inputs(network: Network, injuries: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """{"injury": (C, L) severities of C figures and L links}; {} if the network lacks this channel.

    injuries: for each figure, link -> severity. All other links have severity 0.
    """
    return channel_values(network, INJURY, injuries)
