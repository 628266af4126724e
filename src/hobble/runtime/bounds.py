"""Keeps the network's inputs and outputs within bounds: the range of the training data plus a margin.

Outside these bounds a network may predict anything, and its prediction is part of the next frame's input.
Without bounds, a character that was trained on clips without standing flew apart when it was asked to stand.
With bounds, it stumbles at worst.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.channels.speed_limits import combine_limits
from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import Network

MARGIN_SHARE = 0.25  # margin on each side, as a share of a column's range in training
# If the network's file does not have the ranges of the training data, the bounds of the outputs are
# mean +- (DEFAULT_DEVIATIONS * standard deviation + DEFAULT_MARGIN).
DEFAULT_DEVIATIONS = 15.0
DEFAULT_MARGIN = 50.0  # in the unit of each column: cm for positions
# Then the hips stay within these multiples of their mean height above the ground. Without such limits, a
# character whose ground is switched under it folds up or hangs in the air until the body has followed.
DEFAULT_HIPS = (0.67, 1.175)
# A body that does not crouch keeps its hips above this multiple of its leg's length. (A share of their mean
# height in training sank when training got more crouched frames.)
UPRIGHT_LEGS = 0.75
SPEED_MARGIN = 1.5  # largest joint speed, as a multiple of the fastest joint in training
# A larger number is called unsound, like one that is not finite. A working character never has such values.
LARGEST_SOUND = 1e8


@dataclass(frozen=True)
class Bounds:
    """The allowed values of the network's inputs, x_low to x_high (X,), and outputs, y_low to y_high (Y,).

    The values are float32 and not standardised. fastest: largest movement of a joint, cm a frame. hips:
    lowest and highest height of the hips in training, cm above the ground; or DEFAULT_HIPS times the mean
    height. upright: a body that does not crouch keeps its hips above this height, cm.
    """

    x_low: Array = field(repr=False)
    x_high: Array = field(repr=False)
    y_low: Array = field(repr=False)
    y_high: Array = field(repr=False)
    fastest: float
    hips: tuple[float, float]
    upright: float

    @classmethod
    def of(cls, network: Network) -> Bounds:
        """The bounds of a network. Channel inputs get no bounds, because each channel has its own range."""
        layout, facts = network.layout, network.training_facts
        assert network.skeleton is not None
        hips_height = layout.y_joint_position.start + 3 * network.skeleton.role("hips") + 1
        low, high = (float(share * network.y_mean[hips_height]) for share in DEFAULT_HIPS)
        if facts is None:
            spread = DEFAULT_DEVIATIONS * network.y_std + DEFAULT_MARGIN
            x = np.full(layout.x_size, LARGEST_SOUND, np.float32)
            spread[layout.y_joint_rotation] = 2 * np.pi  # angles of joints stay within a full turn
            return cls(
                -x, x, network.y_mean - spread, network.y_mean + spread, LARGEST_SOUND, (low, high), low
            )
        x_margin = MARGIN_SHARE * (facts.x_high - facts.x_low)
        y_margin = MARGIN_SHARE * (facts.y_high - facts.y_low)
        x_low, x_high = facts.x_low - x_margin, facts.x_high + x_margin
        for name, _ in layout.channels:
            x_low[layout.x_channel(name)], x_high[layout.x_channel(name)] = -LARGEST_SOUND, LARGEST_SOUND
        y_low, phase_change = facts.y_low - y_margin, layout.y_phase_change
        # The phase may run backwards only as fast as it did in training.
        y_low[phase_change] = np.maximum(y_low[phase_change], np.minimum(facts.y_low[phase_change], 0.0))
        hips = float(facts.y_low[hips_height]), float(facts.y_high[hips_height])
        fastest = SPEED_MARGIN * facts.fastest
        upright = max(UPRIGHT_LEGS * network.skeleton.leg_length, hips[0])
        return cls(x_low, x_high, y_low, facts.y_high + y_margin, fastest, hips, upright)


@njit
def limit_rows(rows: Any, low: Any, high: Any) -> None:
    """Limit the values of rows (C, N), in place, to the range from low (N,) to high (N,).

    A number that is not finite or is larger than LARGEST_SOUND becomes the middle of its column's range.
    """
    for c in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            value = rows[c, k]
            if not abs(value) < LARGEST_SOUND:  # also true for NaN
                value = 0.5 * (low[k] + high[k])
            rows[c, k] = min(max(value, low[k]), high[k])


# Limits the target speed and gait of each character to what its hurt or sad body can do.
#
# A channel is a group of network inputs that tell how hurt or how sad the body is. The network's file may
# have speed limits for each channel.


# cm a frame: if the caller names no gait, a target of at least this speed is a jog. It is half way between
# walking at 2.5 and jogging at 7.5.
JOG_FROM = 5.0
LAME_BELOW = 2.2  # cm a frame: a body whose limit for a jog is lower is lame, and walks instead
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

        A target at or above the usual speed of a healthy body in this gait becomes at most `highest`, the
        limit. A slower target is slowed by the same share, `highest / usual`. So a limp shows at any speed.
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
        usual = moving @ self._channel_limits[0][1].usual / np.maximum(total, 1e-9)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        velocity *= np.minimum(1.0, highest / np.maximum(np.maximum(speed, usual), 1e-9))[:, None]
