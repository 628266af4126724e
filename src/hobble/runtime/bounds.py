"""What a network is told and what it answers is kept within what it saw in training, and a little beyond.

A network that is told what it never saw answers anything, and is told that in the next frame: a figure whose
clips hold no standing flew apart when it was to stand. Within bounds the worst is a stumble.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import Network

BEYOND = 0.25  # of the range that a column had in training, to either side
DEVIATIONS = 15.0  # from the mean, for an answer of a network whose file does not tell what it saw,
ROOM = 50.0  # and so many cm more
FASTER = 1.5  # times the fastest joint in training
WILD = 1e8  # nothing in a row is as large; a state that is, is as good as not finite


@dataclass(frozen=True)
class Bounds:
    """x_low, x_high (X,), y_low, y_high (Y,) float32; fastest: cm a frame that a joint may move.

    hips: lowest and highest in training, cm above the ground; no bounds where the file does not tell.
    """

    x_low: Array = field(repr=False)
    x_high: Array = field(repr=False)
    y_low: Array = field(repr=False)
    y_high: Array = field(repr=False)
    fastest: float
    hips: tuple[float, float] = (-WILD, WILD)

    @classmethod
    def of(cls, network: Network) -> Bounds:
        """Those of a network; what channels tell is not bounded here but by the channels."""
        layout, seen = network.layout, network.seen
        if seen is None:
            spread = DEVIATIONS * network.y_std + ROOM
            x = np.full(layout.x_size, WILD, np.float32)
            spread[layout.y_joint_rotation] = 2 * np.pi  # an angle cannot explode
            return cls(-x, x, network.y_mean - spread, network.y_mean + spread, WILD)
        x_more = BEYOND * (seen.x_high - seen.x_low)
        y_more = BEYOND * (seen.y_high - seen.y_low)
        x_low, x_high = seen.x_low - x_more, seen.x_high + x_more
        for name, _ in layout.channels:
            x_low[layout.x_channel(name)], x_high[layout.x_channel(name)] = -WILD, WILD
        y_low, on = seen.y_low - y_more, layout.y_phase_change
        y_low[on] = np.maximum(y_low[on], np.minimum(seen.y_low[on], 0.0))  # a gait does not run backwards
        assert network.skeleton is not None
        height = layout.y_joint_position.start + 3 * network.skeleton.role("hips") + 1
        hips = float(seen.y_low[height]), float(seen.y_high[height])
        return cls(x_low, x_high, y_low, seen.y_high + y_more, FASTER * seen.fastest, hips)


@njit
def keep_within(rows: Any, low: Any, high: Any, wild: Any) -> bool:
    """Bring rows (C, N) in place within low and high (N,); `wild` (C,) says of which a number is not sound.

    A number that is not finite becomes the middle of its range. Returns whether any row was wild.
    """
    any_wild = False
    for c in range(rows.shape[0]):
        wild[c] = False
        for k in range(rows.shape[1]):
            value = rows[c, k]
            if not abs(value) < WILD:
                wild[c] = any_wild = True
                value = 0.5 * (low[k] + high[k])
            rows[c, k] = min(max(value, low[k]), high[k])
    return any_wild


@njit
def unsound(
    position: Any, direction: Any, gait: Any, joints: Any, velocities: Any, rotations: Any, told: Any,
    target: Any, facing: Any, owed: Any, hold: Any, lift: Any, body: Any, added: Any, memory: Any, phase: Any,
    wild: Any,
) -> bool:  # fmt: skip
    """Whether a number of a character's state is not finite or too large; `wild` (C,) says of which."""
    any_wild = False
    for c in range(phase.shape[0]):
        sound = abs(phase[c]) < WILD and abs(body[c]) < WILD
        sound &= _sound(position[c]) and _sound(direction[c]) and _sound(gait[c]) and _sound(joints[c])
        sound &= _sound(velocities[c]) and _sound(rotations[c]) and _sound(told[c]) and _sound(target[c])
        sound &= _sound(facing[c]) and _sound(owed[c]) and _sound(hold[c]) and _sound(lift[c])
        sound &= _sound(added[c]) and _sound(memory[c])
        wild[c] = not sound
        any_wild |= not sound
    return any_wild


@njit
def _sound(array: Any) -> bool:
    total = 0.0
    for value in array.flat:
        total += abs(value)
    return total <= WILD * array.size  # nor is a sum with a number that is not finite
