"""Stacked layers prepared to run on a CPU: K sets of weights each, whose outputs are blended by given shares.

sum_k c_k (W_k x + b_k) equals blending the weights first, and no blended matrix is ever written to memory.
One character is limited by how fast weights stream from memory; of a crowd, four go through a row together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from hobble.core.quat import Array
from hobble.models.network import STORAGES, Network, inverse

BLOCK = 4  # characters that go through a layer's weights together


class Stack:
    """Layers (K, out, in) with biases (K, out), an ELU between them.

    storage: "float32", or "int16" with a factor for each row: half the memory traffic. Raises ValueError for
    another.
    """

    def __init__(self, weights: Sequence[Array], biases: Sequence[Array], storage: str = "float32") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        packed = [_pack(np.asarray(w, np.float32), storage) for w in weights]
        self.outputs = weights[-1].shape[1]
        self._weights = tuple(w for w, _ in packed)
        self._scales = tuple(s for _, s in packed)
        self._biases = tuple(np.ascontiguousarray(b, np.float32) for b in biases)
        widest = max(w.shape[1] for w in weights)
        self._work = np.zeros((2, BLOCK, widest), np.float32)
        self._block = np.zeros((BLOCK, weights[0].shape[2]), np.float32)

    def run(self, x: Array, shares: Array, out: Array) -> None:
        """Write the last layer's outputs (C, out) of x (C, in) and shares (C, K) into `out`, all float32."""
        _run(self._weights, self._scales, self._biases, x, shares, self._block, self._work, out)


class StackPredictor:
    """What the predictors of networks made of stacks have in common: statistics, and buffers for a crowd."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._x_mean, self._x_inverse, self._y_mean, self._y_std = (
            np.ascontiguousarray(a, np.float32)
            for a in (network.x_mean, inverse(network.x_std), network.y_mean, network.y_std)
        )

    def standardise(self, x: Array, z: Array) -> None:
        """z = (x - mean) / std, both (C, X) float32."""
        standardise(x, self._x_mean, self._x_inverse, z)

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y (C, Y) float32 of standardised inputs z (C, X) at phases (C,) in cycles into `out`."""
        raise NotImplementedError

    def predict(self, x: Array, phase: Array, out: Array | None = None) -> Array:
        """Y (C, Y) float32 of X (C, X) float32 at phases (C,) in cycles."""
        z = np.empty_like(x)
        self.standardise(x, z)
        if out is None:
            out = np.empty((len(x), len(self._y_mean)), np.float32)
        self.evaluate(z, phase, out)
        return out

    def restore(self, out: Array) -> None:
        """Standardised outputs (C, Y) become raw ones, in place."""
        restore(out, self._y_mean, self._y_std)


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) as stored, and the factor of each row (K, out)."""
    if storage == "float32":
        return np.ascontiguousarray(weights), np.ones(weights.shape[:2], np.float32)
    scale = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / scale[..., None]).astype(np.int16), scale.astype(np.float32)


@njit(cache=True, fastmath=True)
def standardise(x: Any, mean: Any, factor: Any, z: Any) -> None:
    """z = (x - mean) * factor, column by column."""
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * factor[i]


@njit(cache=True, fastmath=True)
def restore(y: Any, mean: Any, std: Any) -> None:
    """y = y * std + mean, column by column."""
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            y[c, i] = y[c, i] * std[i] + mean[i]


# Only the functions called from outside are kept on disk, and what they call is forced into them: otherwise
# the compiler may round sums in another order when they come from disk.
@njit(fastmath=True, forceinline=True)
def _one(w: Any, s: Any, b: Any, share: Any, x: Any, y: Any) -> None:
    """y (out,) of one character's x (in,); four sets of weights stream side by side."""
    sets, rows, columns = w.shape
    for r in range(rows):
        total = np.float32(0)
        k = 0
        while k + 4 <= sets:
            w0, w1, w2, w3 = w[k, r], w[k + 1, r], w[k + 2, r], w[k + 3, r]
            a0, a1, a2, a3 = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for c in range(columns):
                a0 += np.float32(w0[c]) * x[c]
                a1 += np.float32(w1[c]) * x[c]
                a2 += np.float32(w2[c]) * x[c]
                a3 += np.float32(w3[c]) * x[c]
            total += share[k] * (a0 * s[k, r] + b[k, r]) + share[k + 1] * (a1 * s[k + 1, r] + b[k + 1, r])
            total += share[k + 2] * (a2 * s[k + 2, r] + b[k + 2, r])
            total += share[k + 3] * (a3 * s[k + 3, r] + b[k + 3, r])
            k += 4
        while k < sets:
            a = np.float32(0)
            for c in range(columns):
                a += np.float32(w[k, r, c]) * x[c]
            total += share[k] * (a * s[k, r] + b[k, r])
            k += 1
        y[r] = total


@njit(fastmath=True, forceinline=True)
def _four(w: Any, s: Any, b: Any, share: Any, x: Any, y: Any) -> None:
    """y (4, out) of four characters' x (4, in): each row of weights is read once for all of them."""
    sets, rows, columns = w.shape
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    for r in range(rows):
        y[0, r], y[1, r], y[2, r], y[3, r] = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for k in range(sets):
            row = w[k, r]
            a0, a1, a2, a3 = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for c in range(columns):
                value = np.float32(row[c])
                a0 += value * x0[c]
                a1 += value * x1[c]
                a2 += value * x2[c]
                a3 += value * x3[c]
            y[0, r] += share[0, k] * (a0 * s[k, r] + b[k, r])
            y[1, r] += share[1, k] * (a1 * s[k, r] + b[k, r])
            y[2, r] += share[2, k] * (a2 * s[k, r] + b[k, r])
            y[3, r] += share[3, k] * (a3 * s[k, r] + b[k, r])


@njit(cache=True, fastmath=True)
def _run(
    weights: Any, scales: Any, biases: Any, x: Any, shares: Any, block: Any, work: Any, out: Any
) -> None:
    count, last = x.shape[0], len(weights) - 1
    of_block = np.zeros((BLOCK, shares.shape[1]), np.float32)
    for start in range(0, count, BLOCK):
        members = min(BLOCK, count - start)
        for m in range(members):
            of_block[m] = shares[start + m]
            block[m] = x[start + m]
        h = block
        for i in range(len(weights)):
            rows = weights[i].shape[1]
            y = work[i % 2, :, :rows]
            if members > 2:
                _four(weights[i], scales[i], biases[i], of_block, h, y)
            else:
                for m in range(members):
                    _one(weights[i], scales[i], biases[i], of_block[m], h[m], y[m])
            if i < last:
                for m in range(members):
                    for r in range(rows):
                        if y[m, r] < 0:
                            y[m, r] = np.exp(y[m, r]) - np.float32(1)
            h = y
        for m in range(members):
            for r in range(out.shape[1]):
                out[start + m, r] = h[m, r]
