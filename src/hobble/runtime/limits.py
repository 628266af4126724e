"""Limits the target speed and gait of each character to what its hurt or sad body can do.

A channel is a group of network inputs that tell how hurt or how sad the body is. The network's file may have
speed limits for each channel.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hobble.channels.speed_limits import combine_limits
from hobble.core.quat import Array
from hobble.models.network import Network

# cm a frame: if the caller names no gait, a target of at least this speed is a jog. It is half way between
# walking at 2.5 and jogging at 7.5.
JOG_FROM = 5.0
LAME_BELOW = 4.5  # cm a frame: a body whose limit for a jog is lower is lame, and walks instead
HURRY_FACTOR = 1.25  # if the target is a jog, a lame body walks up to this many times its walking limit


class SpeedLimiter:
    """Limits the targets of C characters by the speed limits of each channel of the network.

    columns: channel -> its columns among the channel values. characters: C.
    """

    def __init__(self, network: Network, columns: Mapping[str, slice], characters: int) -> None:
        self._channel_limits = [(columns[name], limits) for name, limits in network.limits.items()]
        self._gaits = {name: network.gaits.index(name) for name in ("stand", "walk", "jog")}
        # Highest speeds in each gait, cm a frame, and the channel values for which they were computed.
        self._allowed = np.full((characters, len(network.gaits)), np.inf)
        self._values: Array | None = None

    def limit(self, values: Array, velocity: Array, shares: Array) -> None:
        """Limit target velocities (C, 2) and shares of the gaits (C, G), in place.

        values: (C, K) channel values. A body that cannot jog as fast as LAME_BELOW gets a hurried walk
        instead of a jog.
        """
        if not self._channel_limits:
            return
        if self._values is None or not np.array_equal(values, self._values):
            self._values = values.copy()
            of_each = [limits.highest_speeds(values[:, columns]) for columns, limits in self._channel_limits]
            self._allowed[:] = combine_limits(of_each, self._channel_limits[0][1].usual)
        if not np.isfinite(self._allowed).any():
            return
        walk, jog = self._gaits["walk"], self._gaits["jog"]
        lame = self._allowed[:, jog] < LAME_BELOW
        hurry = 1.0 + (HURRY_FACTOR - 1.0) * np.where(lame, shares[:, jog], 0.0)
        shares[lame, walk] += shares[lame, jog]
        shares[lame, jog] = 0.0
        # The limit in a mixture of gaits is the mean of their limits, weighted by share, without standing.
        moving = shares.copy()
        moving[:, self._gaits["stand"]] = 0.0
        total = moving.sum(axis=1)
        weighted = (moving * np.where(moving > 0, self._allowed, 0.0)).sum(axis=1)
        highest = np.where(total > 0, hurry * weighted / np.maximum(total, 1e-9), np.inf)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        velocity *= np.minimum(1.0, highest / np.maximum(speed, 1e-9))[:, None]
