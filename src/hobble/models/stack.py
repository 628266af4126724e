"""Layers prepared to run on a CPU. Each layer has K sets of weights; the caller says how to blend them.

Set k has weights W_k and biases b_k, and the caller gives its share c_k. A layer is linear before its
activation, so blending the outputs of the sets, sum_k c_k (W_k x + b_k), gives the same result as blending
the sets. It is faster, because no blended matrix has to be written to memory. For one character, most of the
time is spent on reading weights from memory. In a crowd, each set is read once for all characters that use
it. A character's prediction has the same bits alone and in any crowd, because its sums are always added in
the same order (`hobble.models.tiles`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import STORAGES, Network, inverse_or_0
from hobble.models.tiles import WIDTH, aligned_zeros, in_panels, multiply, panel_count

# Columns of the table `Stack.plan`, which has a row for each layer: the number of inputs, the number of
# outputs, the index in `Stack.weights` where the layer's weights begin, and the indices in `Stack.numbers`
# where its factors and its biases begin. All layers share these three arrays, because each array that is
# passed to a compiled function costs 0.3 microseconds.
INPUTS, OUTPUTS, WEIGHTS, FACTORS, BIASES = range(5)


class Stack:
    """Layers with an ELU between them, packed into flat arrays for `blend_layers`.

    weights, biases: (K, out, in) and (K, out) of each layer. storage: type in which the weights are stored.
    It is "float32", or "int16" to read half as much memory; each row of int16 weights has a factor that
    restores its scale. mean, std: (Y,) by which the last layer's outputs are brought to raw units, by default
    0 and 1. Raises ValueError for another storage.

    Fields: `sets` is K. `weights` has the weights of all layers in panels (`hobble.models.tiles`), layer by
    layer and set by set. `numbers`, float32, has mean and std, then for each layer the factors of the rows of
    all sets and the biases of all sets. `plan` tells where in these arrays each layer begins: see INPUTS to
    BIASES.
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
        self.weights = aligned_zeros(sum(_size_in_panels(w) for w in weights), storage)
        numbers, plan = [mean, std], []
        weights_end, numbers_end = 0, 2 * outputs  # where the next layer's weights and numbers begin
        for layer, bias in zip(weights, biases, strict=True):
            sets, outputs, inputs = layer.shape
            stored, factors = _pack(layer, storage)
            panels = in_panels(stored).ravel()
            self.weights[weights_end : weights_end + panels.size] = panels
            plan.append([inputs, outputs, weights_end, numbers_end, numbers_end + sets * outputs])
            numbers += [factors.ravel(), bias.ravel()]
            weights_end += panels.size
            numbers_end += 2 * sets * outputs
        self.numbers = np.concatenate([np.asarray(array, np.float32) for array in numbers])
        self.plan = np.array(plan, np.int64)


class StackPredictor:
    """Base class of predictors that run a `Stack`. It standardises the inputs; a subclass adds `evaluate`."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._x_mean, self._x_inverse = (
            np.ascontiguousarray(a, np.float32) for a in (network.x_mean, inverse_or_0(network.x_std))
        )

    def standardise(self, x: Array, z: Array) -> None:
        """Write (x - mean) / std into z. x, z: (C, X) float32, a row for each of C characters."""
        standardise_columns(x, self._x_mean, self._x_inverse, z)

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


def _size_in_panels(weights: Array) -> int:
    """How many numbers the weights (K, out, in) of a layer are in panels, padding included."""
    sets, outputs, inputs = weights.shape
    return int(sets * panel_count(outputs) * WIDTH * inputs)


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) in the storage type, and factors (K, out).

    A stored row times its factor is the row of weights, rounded for int16.
    """
    if storage == "float32":
        return np.asarray(weights, np.float32), np.ones(weights.shape[:2], np.float32)
    # A row's largest weight becomes 32767, the largest int16. 1e-30 avoids division by 0 in rows of zeros.
    factors = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / factors[..., None]).astype(np.int16), factors.astype(np.float32)


@njit(fastmath=True)
def standardise_columns(x: Any, mean: Any, factor: Any, z: Any) -> None:
    """z = (x - mean) * factor, column by column."""
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * factor[i]


# The functions below are inlined in the compiled functions that call them, and have no cache on disk. If they
# had one, the compiler could optimise across the calls in the first run, but not in a later run that loads
# them from the cache. Then the rounding would differ between these runs.
@njit(forceinline=True, cache=False)
def blend_layers(weights: Any, numbers: Any, plan: Any, shares: Any, z: Any, out: Any) -> None:
    """Run the layers for C characters and write the last layer's outputs, in raw units, into out (C, Y).

    weights, numbers, plan: fields of a `Stack`. shares: (C, K) float32, the share of each set for each
    character; a set with a share of 0 is not computed. z: (C, X) float32 standardised inputs.
    """
    count, sets, layers = z.shape[0], shares.shape[1], plan.shape[0]
    widest = 0
    for layer in range(layers):
        widest = max(widest, plan[layer, INPUTS], -(-plan[layer, OUTPUTS] // WIDTH) * WIDTH)
    # h, y: inputs and blended outputs of a layer, for all characters. members: the characters that use a set
    # of weights, because their share of it is not 0. Below, `rows` is their number. members_h, sums: their
    # inputs, and the products of these with the set. slots: index in `sums` where each member's sums begin.
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
    """e^x for x <= 0 in float32, with a relative error of 2e-7, in a form that the compiler can vectorise.

    With n = x / ln 2, rounded, and r = x - n ln 2, the result is 2^n e^r. e^r is the Taylor series up to r^6.
    2^n is written directly into the exponent bits of a float32.
    """
    one = np.float32(1)
    x = max(x, np.float32(-87))  # keeps 2^n a normal float32
    n = np.floor(x * np.float32(1.44269504) + np.float32(0.5))
    r = (x - n * np.float32(0.693359375)) + n * np.float32(
        2.12194440e-4
    )  # n ln 2, subtracted in two parts for precision
    p = one + r * np.float32(1 / 6)
    p = one + r * np.float32(1 / 5) * p
    p = one + r * np.float32(1 / 4) * p
    p = one + r * np.float32(1 / 3) * p
    p = one + r * np.float32(1 / 2) * p
    p = one + r * p
    return p * np.uint32(np.uint32(np.int32(n) + np.int32(127)) << np.uint32(23)).view(np.float32)


# The loops below start at index 0 of their arguments, so callers pass slices. If an offset were added to the
# index, the compiler would check for negative indices at every step and would not vectorise.


@njit(forceinline=True, cache=False)
def _copy(x: Any, count: int, to: Any) -> None:
    for i in range(count):
        to[i] = x[i]


@njit(forceinline=True, cache=False)
def _add(sums: Any, factors: Any, biases: Any, share: Any, count: int, y: Any) -> None:
    """Add a set's `count` outputs times its share to y."""
    for r in range(count):
        y[r] += share * (sums[r] * factors[r] + biases[r])


@njit(forceinline=True, cache=False)
def _elu(y: Any, count: int) -> None:
    """Replace y by its ELU: y where y > 0, else e^y - 1."""
    for r in range(count):
        below = exp_below_0(min(y[r], np.float32(0))) - np.float32(1)
        y[r] = y[r] if y[r] > 0 else below


@njit(forceinline=True, cache=False)
def _restore(h: Any, statistics: Any, count: int, out: Any) -> None:
    """Write h std + mean into out. statistics: `count` means, then `count` standard deviations."""
    std = statistics[count:]
    for r in range(count):
        out[r] = h[r] * std[r] + statistics[r]
