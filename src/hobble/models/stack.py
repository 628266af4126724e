"""Layers prepared to run on a CPU. Each has K sets of weights, whose outputs are blended by given shares.

The blended outputs sum_k c_k (W_k x + b_k), with shares c_k, equal the output of blended weights, because a
layer is linear before its activation. So no blended matrix has to be written to memory. For one character,
the speed is limited by reading weights from memory. In a crowd, each set of weights is read once for all
characters that use it. A character's prediction has the same bits alone and in any crowd, because its sums
always have the same order (`hobble.models.tiles`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import STORAGES, Network, inverse
from hobble.models.tiles import WIDTH, aligned, in_panels, multiply, panels_of

# Columns of `Stack.plan`, which has a row for each layer: numbers of inputs and outputs, the index in
# `Stack.weights` where the layer's weights begin, and the indices in `Stack.numbers` where its factors and
# its biases begin. There are so few arrays because each one costs 0.3 microseconds when it is passed to a
# compiled function.
INPUTS, OUTPUTS, WEIGHTS, FACTORS, BIASES = range(5)


class Stack:
    """Layers of weights (K, out, in) and biases (K, out), an ELU between them, packed for `blend_layers`.

    storage: type of the stored weights: "float32", or "int16" with a factor for each row, to halve the memory
    traffic. mean, std: (Y,) statistics to bring the last layer's outputs to raw units, by default 0 and 1.
    Raises ValueError for another storage.

    Its fields: `sets` is K. `weights` is a flat array of all weights in panels (`hobble.models.tiles`), layer
    by layer and set by set. `numbers` is a flat float32 array of mean and std, then for each layer the
    factors of all rows and the biases of all sets. `plan`: see INPUTS to BIASES.
    """

    def __init__(
        self,
        weights: Sequence[Array],
        biases: Sequence[Array],
        storage: str = "float32",
        mean: Array | None = None,
        std: Array | None = None,
    ) -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        outputs = weights[-1].shape[1]
        mean, std = np.zeros(outputs) if mean is None else mean, np.ones(outputs) if std is None else std
        self.sets = len(weights[0])
        self.weights = aligned(sum(_panel_numbers(w) for w in weights), storage)
        numbers, plan, at, size = [mean, std], [], 0, 2 * outputs
        for table, bias in zip(weights, biases, strict=True):
            sets, outputs, inputs = table.shape
            stored, factors = _pack(table, storage)
            panels = in_panels(stored).ravel()
            self.weights[at : at + panels.size] = panels
            plan.append([inputs, outputs, at, size, size + sets * outputs])
            numbers += [factors.ravel(), bias.ravel()]
            at, size = at + panels.size, size + 2 * sets * outputs
        self.numbers = np.concatenate([np.asarray(array, np.float32) for array in numbers])
        self.plan = np.array(plan, np.int64)


class StackPredictor:
    """Base of the predictors that run a `Stack`: standardises inputs."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._x_mean, self._x_inverse = (
            np.ascontiguousarray(a, np.float32) for a in (network.x_mean, inverse(network.x_std))
        )

    def standardise(self, x: Array, z: Array) -> None:
        """z = (x - mean) / std, both (C, X) float32."""
        standardise(x, self._x_mean, self._x_inverse, z)

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y (C, Y) float32 for standardised inputs z (C, X) at phases (C,), 0 to 1, into `out`."""
        raise NotImplementedError

    def predict(self, x: Array, phase: Array, out: Array | None = None) -> Array:
        """Y (C, Y) float32 of X (C, X) float32 at phases (C,), 0 to 1: `standardise`, then `evaluate`."""
        z = np.empty_like(x)
        self.standardise(x, z)
        if out is None:
            out = np.empty((len(x), len(self.network.y_mean)), np.float32)
        self.evaluate(z, phase, out)
        return out


def _panel_numbers(table: Array) -> int:
    sets, outputs, inputs = table.shape
    return int(sets * panels_of(outputs) * WIDTH * inputs)


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) in the storage type, and the factors (K, out) of their rows."""
    if storage == "float32":
        return np.asarray(weights, np.float32), np.ones(weights.shape[:2], np.float32)
    factors = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / factors[..., None]).astype(np.int16), factors.astype(np.float32)


@njit(fastmath=True)
def standardise(x: Any, mean: Any, factor: Any, z: Any) -> None:
    """z = (x - mean) * factor, column by column."""
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * factor[i]


# Only functions called from Python are cached on disk; the functions that they call are inlined. If the
# inner functions had caches of their own, the compiler could optimise across the calls in the first run, but
# not after loading these functions from the cache. Then the rounding would change.
@njit(forceinline=True, cache=False)
def blend_layers(weights: Any, numbers: Any, plan: Any, shares: Any, z: Any, out: Any) -> None:
    """Run the layers and write their outputs, in raw units, into out (C, Y).

    weights, numbers, plan: of a `Stack`. shares: (C, K) float32 of the sets; a set with a share of 0 is not
    computed. z: (C, X) float32 standardised inputs.
    """
    count, sets, layers = z.shape[0], shares.shape[1], plan.shape[0]
    widest = 0
    for layer in range(layers):
        widest = max(widest, plan[layer, INPUTS], -(-plan[layer, OUTPUTS] // WIDTH) * WIDTH)
    # h, y: inputs and blended outputs of a layer. members_h, sums: inputs and outputs of one set of weights,
    # for the characters that use it (`members`). slots: where the sums of each of them begin.
    room = np.empty((4, count * widest), np.float32)
    h, y, members_h, sums = room[0], room[1], room[2], room[3]
    members, slots = np.empty(count, np.int64), np.empty(count, np.int64)
    for c in range(count):
        _copy(z[c], z.shape[1], h[c * z.shape[1] :])
    for layer in range(layers):
        inputs, outputs = plan[layer, INPUTS], plan[layer, OUTPUTS]
        padded = -(-outputs // WIDTH) * WIDTH
        y[: count * outputs] = np.float32(0)
        for k in range(sets):
            rows = 0
            for c in range(count):
                if shares[c, k] != 0:
                    members[rows], slots[rows] = c, rows * padded
                    rows += 1
            if rows == 0:
                continue
            for m in range(rows if rows < count else 0):
                _copy(h[members[m] * inputs :], inputs, members_h[m * inputs :])
            sums[: rows * padded] = np.float32(0)
            start = plan[layer, WEIGHTS] + k * padded * inputs
            x = h if rows == count else members_h
            multiply(weights, start, padded // WIDTH, inputs, x, rows, sums, slots)
            factors = numbers[plan[layer, FACTORS] + k * outputs :]
            biases = numbers[plan[layer, BIASES] + k * outputs :]
            for m in range(rows):
                c = members[m]
                _add(sums[m * padded :], factors, biases, shares[c, k], outputs, y[c * outputs :])
        if layer < layers - 1:
            _elu(y, count * outputs)
        h, y = y, h
    outputs = out.shape[1]
    for c in range(count):
        _restore(h[c * outputs :], numbers, outputs, out[c])


@njit(forceinline=True, cache=False)
def exp_below_0(x: Any) -> Any:
    """e^x for x <= 0 in float32, with a relative error of 2e-7, in a form that the compiler can vectorise."""
    one = np.float32(1)
    x = max(x, np.float32(-87))
    n = np.floor(x * np.float32(1.44269504) + np.float32(0.5))
    r = (x - n * np.float32(0.693359375)) + n * np.float32(2.12194440e-4)  # n ln 2 in two parts
    p = one + r * np.float32(1 / 6)
    p = one + r * np.float32(1 / 5) * p
    p = one + r * np.float32(1 / 4) * p
    p = one + r * np.float32(1 / 3) * p
    p = one + r * np.float32(1 / 2) * p
    p = one + r * p
    return p * np.uint32(np.uint32(np.int32(n) + np.int32(127)) << np.uint32(23)).view(np.float32)


# The loops below start at index 0 of their arguments. With an offset in the index, the compiler checks for
# negative indices at every step and does not vectorise.


@njit(forceinline=True, cache=False)
def _copy(x: Any, count: int, to: Any) -> None:
    for i in range(count):
        to[i] = x[i]


@njit(forceinline=True, cache=False)
def _add(sums: Any, factors: Any, biases: Any, share: Any, count: int, y: Any) -> None:
    for r in range(count):
        y[r] += share * (sums[r] * factors[r] + biases[r])


@njit(forceinline=True, cache=False)
def _elu(y: Any, count: int) -> None:
    for r in range(count):
        below = exp_below_0(min(y[r], np.float32(0))) - np.float32(1)
        y[r] = y[r] if y[r] > 0 else below


@njit(forceinline=True, cache=False)
def _restore(h: Any, statistics: Any, count: int, out: Any) -> None:
    """out = h std + mean; statistics: the means, then the standard deviations."""
    std = statistics[count:]
    for r in range(count):
        out[r] = h[r] * std[r] + statistics[r]
