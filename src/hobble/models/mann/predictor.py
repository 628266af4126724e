"""The mode-adaptive network prepared to run: gate, shares and experts in one compiled call.

`hobble.models.mann.forward` explains the network.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.stack import Stack, StackPredictor, blend_layers, exp_below_0

if TYPE_CHECKING:
    from hobble.models.mann.network import Mann

# The fields `weights`, `numbers` and `plan` of a `Stack`. A compiled function cannot take the `Stack` itself.
Layers = tuple[Any, Any, Any]
# An expert with a smaller share is not evaluated. The rounding error of a share near 1 is about as large in
# single precision.
NEGLIGIBLE_SHARE = 1e-7


class MannPredictor(StackPredictor):
    """The network prepared to run, with the experts' weights stored as float32 or int16."""

    network: Mann

    def __init__(self, network: Mann, storage: str = "float32") -> None:
        super().__init__(network)
        self._experts = Stack(network.weights, network.biases, storage, network.y_mean, network.y_std)
        # The gate stays float32: it is small, and rounding it would change the shares of all experts.
        self._gate = Stack([w[None] for w in network.gate_weights], [b[None] for b in network.gate_biases])

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """As in `Predictor`; the phase is ignored."""
        gate, experts = self._gate, self._experts
        _evaluate(
            (gate.weights, gate.numbers, gate.plan), self.network.columns,
            (experts.weights, experts.numbers, experts.plan), experts.sets, z, out,
        )  # fmt: skip


@njit(error_model="numpy")
def _evaluate(gate: Layers, columns: Any, experts: Layers, expert_count: int, z: Any, out: Any) -> None:
    """Write the outputs (C, Y) of C characters, in raw units, into `out`.

    columns: the columns of z that the gate gets. z: (C, X) standardised inputs.
    """
    gate_z = np.empty((z.shape[0], len(columns)), np.float32)
    for c in range(z.shape[0]):
        for i in range(len(columns)):
            gate_z[c, i] = z[c, columns[i]]
    shares = np.empty((z.shape[0], expert_count), np.float32)
    weights, numbers, plan = gate
    # The gate has only one set of weights, whose share is 1. Its outputs are the logits of the shares.
    blend_layers(weights, numbers, plan, np.ones((z.shape[0], 1), np.float32), gate_z, shares)
    for c in range(z.shape[0]):
        _softmax(shares[c])
    expert_weights, expert_numbers, expert_plan = experts
    blend_layers(expert_weights, expert_numbers, expert_plan, shares, z, out)


@njit(forceinline=True, cache=False)
def _softmax(logits: Any) -> None:
    """Turn logits (K,) into shares in place; a share below NEGLIGIBLE_SHARE becomes 0."""
    largest = logits.max()
    total = np.float32(0)
    for k in range(len(logits)):
        logits[k] = exp_below_0(logits[k] - largest)
        total += logits[k]
    for k in range(len(logits)):
        share = logits[k] / total
        logits[k] = share if share > NEGLIGIBLE_SHARE else np.float32(0)
