"""Evaluates the phase-functioned network, fast, for one character or a crowd.

There are three modes. A mode says at which phases weights are stored, and how the outputs of the stored
phases are blended. The weights are stored as float32 or int16.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.pfnn.forward import weights_at
from hobble.models.stack import Stack, StackPredictor, blend_layers

if TYPE_CHECKING:
    from hobble.models.pfnn.network import Pfnn

# Mode -> number of stored phases. None: the control points are stored.
MODES = {"constant": 50, "linear": 10, "cubic": None}
BLENDED = {"constant": 1, "linear": 2, "cubic": 4}  # mode -> how many of the stored phases it blends


class PfnnPredictor(StackPredictor):
    """A network prepared for one mode.

    mode: "constant" (50 phases; the phase is rounded down to one), "linear" (10 phases; two are blended) or
    "cubic" (control points, exact).
    storage: "float32", or "int16" with a factor for each row. int16 halves the memory traffic and changes
    joint positions by less than 0.1 mm.
    points: the number of stored phases or control points.
    """

    def __init__(self, network: Pfnn, mode: str = "cubic", storage: str = "float32") -> None:
        super().__init__(network)
        self.mode, self.storage = mode, storage
        weights, biases = zip(*phase_tables(network, mode), strict=True)
        self.points = len(weights[0])
        self._stack = Stack(weights, biases, storage, network.y_mean, network.y_std)
        self._blended = BLENDED[mode]

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """As in `Predictor`."""
        stack = self._stack
        _evaluate(stack.weights, stack.numbers, stack.plan, self._blended, self.points, z, phase, out)


def phase_tables(network: Pfnn, mode: str) -> list[tuple[Array, Array]]:
    """The tables of a mode: for each layer weights (points, out, in) and biases (points, out).

    The points are 50 or 10 phases, or the control points. Raises ValueError for an unknown mode.
    """
    if mode not in MODES:
        raise ValueError(f"mode {mode!r}: not one of {', '.join(MODES)}")
    points = MODES[mode]
    if points is None:
        return list(zip(network.weights, network.biases, strict=True))
    phases = np.arange(points) / points
    return [
        (weights_at(w, phases), weights_at(b, phases))
        for w, b in zip(network.weights, network.biases, strict=True)
    ]


@njit(error_model="numpy")
def _evaluate(
    weights: Any, numbers: Any, plan: Any, blended: int, points: int, z: Any, phase: Any, out: Any
) -> None:
    """Write Y (C, Y) into `out`. weights, numbers, plan: of a `Stack`. blended: 1, 2 or 4, see BLENDED."""
    shares = np.zeros((z.shape[0], points), np.float32)
    for c in range(z.shape[0]):
        _write_shares(phase[c], blended, points, shares[c])
    blend_layers(weights, numbers, plan, shares, z, out)


@njit(forceinline=True, cache=False)
def _write_shares(phase: float, blended: int, points: int, shares: Any) -> None:
    """Write the shares of the `blended` (1, 2 or 4) points around `phase` into `shares` (points,), all 0."""
    # A phase of exactly 1 is the end of the cycle, not its start. In the mode constant, the weights at the
    # end differ from those at the start.
    wrapped = phase if phase == 1.0 else phase - np.floor(phase)
    # In single precision, as in the program of Holden et al. (2017). In double precision, 50 times 0.04
    # stored as float32 would be just below 2.
    scaled = np.float64(np.float32(wrapped) * np.float32(points)) if blended == 1 else wrapped * points
    first = min(int(scaled), points - 1)
    t = scaled - first
    if blended == 1:
        shares[first] = 1.0
    elif blended == 2:
        shares[first], shares[(first + 1) % points] = 1.0 - t, t
    else:  # the rows of `forward.CATMULL_ROM`
        shares[(first - 1 + points) % points] = 0.5 * (-t + 2 * t * t - t * t * t)
        shares[first] = 0.5 * (2 - 5 * t * t + 3 * t * t * t)
        shares[(first + 1) % points] = 0.5 * (t + 4 * t * t - 3 * t * t * t)
        shares[(first + 2) % points] = 0.5 * (-t * t + t * t * t)
