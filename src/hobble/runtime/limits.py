"""A hurt body is asked for what it can do: the wish is held to how fast such a body goes, its gait to how."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hobble.core.quat import Array
from hobble.models.network import Network

JOG_FROM = 5.0  # cm a frame: between walking at 2.5 and jogging at 7.5
LAME_BELOW = 4.5  # cm a frame: who cannot jog as fast as that walks
HURRIED = 1.25  # times the limit of a walk: how fast those limp who wanted to jog


class Holder:
    """Holds the wishes of C characters to what they can do.

    columns: channel -> its columns among all that is told.
    """

    def __init__(self, network: Network, columns: Mapping[str, slice], characters: int) -> None:
        self._tables = [(columns[name], limits) for name, limits in network.limits.items()]
        self._gaits = {name: network.gaits.index(name) for name in ("stand", "walk", "jog")}
        self._allowed = np.full((characters, len(network.gaits)), np.inf)
        self._told: Array | None = None

    def hold(self, told: Array, velocity: Array, shares: Array) -> None:
        """Shorten velocities (C, 2) to what bodies that are told (C, K) can do in gaits of shares (C, G).

        Both are changed in place. Who cannot run any more limps in a hurry: a jog slower than LAME_BELOW is
        none.
        """
        if not self._tables:
            return
        if self._told is None or not np.array_equal(told, self._told):
            self._told = told.copy()
            each = [limits.allowed(told[:, columns]) for columns, limits in self._tables]
            self._allowed[:] = np.min(each, axis=0)
        if not np.isfinite(self._allowed).any():
            return
        walk, jog = self._gaits["walk"], self._gaits["jog"]
        lame = self._allowed[:, jog] < LAME_BELOW
        hurry = 1.0 + (HURRIED - 1.0) * np.where(lame, shares[:, jog], 0.0)
        shares[lame, walk] += shares[lame, jog]
        shares[lame, jog] = 0.0
        going = shares.copy()
        going[:, self._gaits["stand"]] = 0.0
        whole = going.sum(axis=1)
        limit = (going * np.where(going > 0, self._allowed, 0.0)).sum(axis=1)
        most = np.where(whole > 0, hurry * limit / np.maximum(whole, 1e-9), np.inf)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        velocity *= np.minimum(1.0, most / np.maximum(speed, 1e-9))[:, None]
