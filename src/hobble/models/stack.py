"""Layers prepared to run on a CPU: K sets of weights each, whose outputs are blended by given shares.

sum_k c_k (W_k x + b_k) equals blending the weights first, but writes no blended matrix to memory. One
character is limited by reading the weights from memory. In a crowd, four characters share each row read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import STORAGES, Network, inverse

BLOCK = 4  # characters of a crowd that are multiplied with a row of weights together
SINGLE_UP_TO = 2  # up to this many characters, each is computed by itself
NEGLIGIBLE = 1e-7  # smaller shares are below single precision next to a share near 1


class Stack:
    """Layers (K, out, in) with biases (K, out), an ELU between them.

    storage: "float32", or "int16" with a factor for each row: half the memory traffic. Raises ValueError for
    any other.
    """

    def __init__(self, weights: Sequence[Array], biases: Sequence[Array], storage: str = "float32") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        packed = [_pack(np.asarray(w, np.float32), storage) for w in weights]
        self.outputs = weights[-1].shape[1]
        self._weights = tuple(w for w, _ in packed)
        self._scales = tuple(s for _, s in packed)
        self._biases = tuple(np.ascontiguousarray(b, np.float32) for b in biases)

    def run(self, x: Array, shares: Array, out: Array) -> None:
        """Write the last layer's outputs (C, out) of x (C, in) and shares (C, K) into `out`, all float32."""
        _run(self._weights, self._scales, self._biases, np.ascontiguousarray(x), shares, out)


class StackPredictor:
    """Base of the predictors that use `Stack`: standardises inputs and restores outputs."""

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
        """Turn standardised outputs (C, Y) into raw ones in place."""
        restore(out, self._y_mean, self._y_std)


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) in their storage type, and the factor of each row (K, out)."""
    if storage == "float32":
        return np.ascontiguousarray(weights), np.ones(weights.shape[:2], np.float32)
    scale = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / scale[..., None]).astype(np.int16), scale.astype(np.float32)


@njit(fastmath=True)
def standardise(x: Any, mean: Any, factor: Any, z: Any) -> None:
    """z = (x - mean) * factor, column by column."""
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * factor[i]


@njit(fastmath=True)
def restore(y: Any, mean: Any, std: Any) -> None:
    """y = y * std + mean, column by column."""
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            y[c, i] = y[c, i] * std[i] + mean[i]


# Only functions called from Python are cached on disk; their callees are inlined. Otherwise the compiler may
# sum in another order after loading from the cache, which changes the rounding.
@njit(fastmath=True, forceinline=True, cache=False)
def _run_one(w: Any, s: Any, b: Any, share: Any, x: Any, y: Any) -> None:
    """y (out,) of one character's x (in,). Four sets of weights are read side by side; those with a
    negligible share are skipped."""
    rows, columns = w.shape[1], w.shape[2]
    used, count = np.empty(w.shape[0], np.int64), 0
    for k in range(w.shape[0]):
        if share[k] > NEGLIGIBLE:
            used[count] = k
            count += 1
    for r in range(rows):
        total = np.float32(0)
        first = 0
        while first + 4 <= count:
            i, j, m, n = used[first], used[first + 1], used[first + 2], used[first + 3]
            w0, w1, w2, w3 = w[i, r], w[j, r], w[m, r], w[n, r]
            a0, a1, a2, a3 = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for c in range(columns):
                a0 += np.float32(w0[c]) * x[c]
                a1 += np.float32(w1[c]) * x[c]
                a2 += np.float32(w2[c]) * x[c]
                a3 += np.float32(w3[c]) * x[c]
            total += share[i] * (a0 * s[i, r] + b[i, r]) + share[j] * (a1 * s[j, r] + b[j, r])
            total += share[m] * (a2 * s[m, r] + b[m, r]) + share[n] * (a3 * s[n, r] + b[n, r])
            first += 4
        for k in used[first:count]:
            row, a = w[k, r], np.float32(0)
            for c in range(columns):
                a += np.float32(row[c]) * x[c]
            total += share[k] * (a * s[k, r] + b[k, r])
        y[r] = total


@njit(fastmath=True, forceinline=True, cache=False)
def _run_crowd(w: Any, s: Any, b: Any, shares: Any, x: Any, y: Any) -> None:
    """y (C, out) of x (C, in). A row of weights stays in the cache for all characters, four at a time."""
    sets, rows, columns = w.shape
    zero, last = np.float32(0), x.shape[0] - 1
    for r in range(rows):
        for start in range(0, x.shape[0], BLOCK):
            # If the last block is not full, its last character is computed several times.
            i, j = start, min(start + 1, last)
            m, n = min(start + 2, last), min(start + 3, last)
            x0, x1, x2, x3 = x[i], x[j], x[m], x[n]
            y0, y1, y2, y3 = zero, zero, zero, zero
            for k in range(sets):
                row, factor, bias = w[k, r], s[k, r], b[k, r]
                a0, a1, a2, a3 = zero, zero, zero, zero
                for c in range(columns):
                    value = np.float32(row[c])
                    a0 += value * x0[c]
                    a1 += value * x1[c]
                    a2 += value * x2[c]
                    a3 += value * x3[c]
                y0 += shares[i, k] * (a0 * factor + bias)
                y1 += shares[j, k] * (a1 * factor + bias)
                y2 += shares[m, k] * (a2 * factor + bias)
                y3 += shares[n, k] * (a3 * factor + bias)
            y[i, r], y[j, r], y[m, r], y[n, r] = y0, y1, y2, y3


@njit(fastmath=True)
def _run(weights: Any, scales: Any, biases: Any, x: Any, shares: Any, out: Any) -> None:
    count, h = x.shape[0], x
    for i in range(len(weights)):
        y = np.empty((count, weights[i].shape[1]), np.float32)
        if count > SINGLE_UP_TO:
            _run_crowd(weights[i], scales[i], biases[i], shares, h, y)
        else:
            for m in range(count):
                _run_one(weights[i], scales[i], biases[i], shares[m], h[m], y[m])
        if i < len(weights) - 1:
            for m in range(count):
                for r in range(y.shape[1]):
                    if y[m, r] < 0:
                        y[m, r] = np.exp(y[m, r]) - np.float32(1)
        h = y
    for m in range(count):
        for r in range(out.shape[1]):
            out[m, r] = h[m, r]
