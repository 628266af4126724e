"""Clip the network's inputs and outputs to the range of the training data plus a margin.

Outside that range a network may predict anything, and its prediction is part of the next frame's input.
Without bounds, a character trained on clips without standing flew apart when it was asked to stand. With
bounds it stumbles at worst.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import Network

MARGIN_SHARE = 0.25  # margin on each side, as a share of a column's range in training
# If the network's file has no ranges, the bounds of the outputs are mean +- (deviations * std + margin).
DEFAULT_DEVIATIONS = 15.0
DEFAULT_MARGIN = 50.0  # in the unit of each column: cm for positions
SPEED_MARGIN = 1.5  # largest joint speed, as a multiple of the fastest joint in training
LARGEST_SOUND = 1e8  # larger numbers are treated as not finite; no value of a working character is as large


@dataclass(frozen=True)
class Bounds:
    """The allowed ranges: x_low, x_high (X,) and y_low, y_high (Y,), float32, in the units of the rows.

    fastest: largest joint movement, cm a frame. hips: lowest and highest height of the hips in training,
    cm above the ground; unbounded if the network's file has no ranges.
    """

    x_low: Array = field(repr=False)
    x_high: Array = field(repr=False)
    y_low: Array = field(repr=False)
    y_high: Array = field(repr=False)
    fastest: float
    hips: tuple[float, float] = (-LARGEST_SOUND, LARGEST_SOUND)

    @classmethod
    def of(cls, network: Network) -> Bounds:
        """The bounds of a network. Channel inputs are not bounded here: each channel has its own range."""
        layout, facts = network.layout, network.training_facts
        if facts is None:
            spread = DEFAULT_DEVIATIONS * network.y_std + DEFAULT_MARGIN
            x = np.full(layout.x_size, LARGEST_SOUND, np.float32)
            spread[layout.y_joint_rotation] = 2 * np.pi  # angles of joints stay within a full turn
            return cls(-x, x, network.y_mean - spread, network.y_mean + spread, LARGEST_SOUND)
        x_more = MARGIN_SHARE * (facts.x_high - facts.x_low)
        y_more = MARGIN_SHARE * (facts.y_high - facts.y_low)
        x_low, x_high = facts.x_low - x_more, facts.x_high + x_more
        for name, _ in layout.channels:
            x_low[layout.x_channel(name)], x_high[layout.x_channel(name)] = -LARGEST_SOUND, LARGEST_SOUND
        y_low, change = facts.y_low - y_more, layout.y_phase_change
        # The phase may run backwards only as fast as it did in training.
        y_low[change] = np.maximum(y_low[change], np.minimum(facts.y_low[change], 0.0))
        assert network.skeleton is not None
        height = layout.y_joint_position.start + 3 * network.skeleton.role("hips") + 1
        hips = float(facts.y_low[height]), float(facts.y_high[height])
        return cls(x_low, x_high, y_low, facts.y_high + y_more, SPEED_MARGIN * facts.fastest, hips)


@njit
def clip_rows(rows: Any, low: Any, high: Any, unsound: Any) -> bool:
    """Clip rows (C, N) in place to low and high (N,).

    Numbers that are not finite or too large become the middle of their column's range, and `unsound` (C,)
    marks their rows. Returns whether any row is marked.
    """
    any_unsound = False
    for c in range(rows.shape[0]):
        unsound[c] = False
        for k in range(rows.shape[1]):
            value = rows[c, k]
            if not abs(value) < LARGEST_SOUND:
                unsound[c] = any_unsound = True
                value = 0.5 * (low[k] + high[k])
            rows[c, k] = min(max(value, low[k]), high[k])
    return any_unsound


@njit
def find_unsound(state: tuple[Any, ...], unsound: Any) -> bool:
    """Mark in `unsound` (C,) the characters whose state has numbers that are not finite or too large.

    state: arrays (C, n), each with its own n. Returns whether any character is marked.
    """
    any_unsound = False
    for c in range(unsound.shape[0]):
        sound = True
        for part in state:
            total = 0.0
            for value in part[c]:
                total += abs(value)
            sound &= total <= LARGEST_SOUND * part.shape[1]  # False for a sum that is not finite
        unsound[c] = not sound
        any_unsound |= not sound
    return any_unsound
