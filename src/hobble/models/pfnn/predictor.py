"""Evaluating the network at a phase: three modes, float32 or int16 storage, one character or a crowd.

The outputs are blended and not the weights: sum_k c_k (W_k x + b_k) is the same number (the layer is linear
before its activation), and no blended matrix is ever written to memory. One character is limited by how fast
weights stream from memory, so its kernel reads each once; a crowd shares the weights and goes through matrix
products.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import STORAGES, inverse
from hobble.models.pfnn.forward import weights_at

if TYPE_CHECKING:
    from hobble.models.pfnn.network import Pfnn

MODES = {"constant": 50, "linear": 10, "cubic": None}


class PfnnPredictor:
    """A network prepared for one phase mode.

    mode: "constant" (50 phases, the one at or before the phase), "linear" (10, blended), "cubic" (exact).
    storage: "float32", or "int16" with a scale for each row: half the memory traffic, poses within 0.1 mm.
    """

    def __init__(self, network: Pfnn, mode: str = "cubic", storage: str = "float32") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        self.network, self.mode, self.storage = network, mode, storage
        tables = phase_tables(network, mode)
        self.points = len(tables[0][0])
        packed = [_pack(w, storage) for w, _ in tables]
        self._weights = tuple(q for q, _ in packed)
        self._scales = tuple(s for _, s in packed)
        self._biases = tuple(np.ascontiguousarray(b, np.float32) for _, b in tables)
        self._statistics = tuple(
            np.ascontiguousarray(a, np.float32)
            for a in (network.x_mean, inverse(network.x_std), network.y_mean, network.y_std)
        )
        self._work = np.zeros((2, max(network.sizes)), np.float32)
        self._kind = 4 if mode == "cubic" else 2 if mode == "linear" else 1

    def predict(self, x: Array, phase: Array, out: Array | None = None) -> Array:
        """Y (C, outputs) float32 of X (C, inputs) float32 at phases (C,) in cycles."""
        z = np.empty_like(x)
        self.standardise(x, z)
        if out is None:
            out = np.empty((len(x), self.network.layout.y_size), np.float32)
        self.evaluate(z, phase, out)
        return out

    def standardise(self, x: Array, z: Array) -> None:
        """z = (x - mean) / std, both (C, inputs) float32."""
        _standardise(x, self._statistics[0], self._statistics[1], z)

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y of standardised inputs z at phases (C,) into `out`."""
        if len(z) <= CROWD:
            _evaluate(
                self._weights, self._scales, self._biases, self._statistics[2], self._statistics[3],
                self._kind, z, phase, self._work, out,
            )  # fmt: skip
        else:
            _evaluate_crowd(
                self._weights, self._scales, self._biases, self._statistics[2], self._statistics[3],
                self._kind, z, phase, out,
            )  # fmt: skip


# For more characters than this, sharing the weights that were read pays for gathering those who need them.
CROWD = 2
BLOCK = 4  # characters that go through a layer's weights together


def phase_tables(network: Pfnn, mode: str) -> list[tuple[Array, Array]]:
    """What a mode looks up or blends: for each layer weights (points, out, in) and biases (points, out).

    50 or 10 points, or the control points themselves. Raises ValueError for an unknown mode.
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


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) as stored, and the factor of each row (K, out)."""
    if storage == "float32":
        return np.ascontiguousarray(weights, np.float32), np.ones(weights.shape[:2], np.float32)
    scale = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / scale[..., None]).astype(np.int16), scale.astype(np.float32)


@njit(fastmath=True)
def _standardise(x: Any, mean: Any, inverse: Any, z: Any) -> None:
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * inverse[i]


# Only the functions called from outside are kept on disk, and what they call is forced into them: into
# functions of their own the compiler may look the first time and not when they come from disk, and then
# rounds sums in another order.
@njit(forceinline=True, cache=False)
def _phase(phase: float, kind: int, points: int, index: Any, share: Any) -> None:
    """Fill the `kind` points that phase blends and their coefficients."""
    # A phase of exactly 1 is the end of the cycle, not its start: in constant mode the two have different
    # weights.
    wrapped = phase if phase == 1.0 else phase - np.floor(phase)
    # In single precision, as the original looks its phase up: .04 * 50 is 2, not just below it.
    scaled = np.float64(np.float32(wrapped) * np.float32(points)) if kind == 1 else wrapped * points
    first = min(int(scaled), points - 1)
    t = scaled - first
    if kind == 1:
        index[0], share[0] = first, 1.0
    elif kind == 2:
        index[0], index[1] = first, (first + 1) % points
        share[0], share[1] = 1.0 - t, t
    else:
        for k in range(4):
            index[k] = (first + k - 1 + points) % points
        share[0] = 0.5 * (-t + 2 * t * t - t * t * t)
        share[1] = 0.5 * (2 - 5 * t * t + 3 * t * t * t)
        share[2] = 0.5 * (t + 4 * t * t - 3 * t * t * t)
        share[3] = 0.5 * (-t * t + t * t * t)


@njit(fastmath=True, forceinline=True, cache=False)
def _layer1(w: Any, s: Any, b: Any, x: Any, y: Any) -> None:
    for r in range(w.shape[0]):
        a = np.float32(0)
        for c in range(w.shape[1]):
            a += np.float32(w[r, c]) * x[c]
        y[r] = a * s[r] + b[r]


@njit(fastmath=True, forceinline=True, cache=False)
def _layer2(w: Any, s: Any, b: Any, k: Any, share: Any, x: Any, y: Any) -> None:
    i, j = k[0], k[1]
    for r in range(w.shape[1]):
        a0, a1 = np.float32(0), np.float32(0)
        for c in range(w.shape[2]):
            a0 += np.float32(w[i, r, c]) * x[c]
            a1 += np.float32(w[j, r, c]) * x[c]
        y[r] = share[0] * (a0 * s[i, r] + b[i, r]) + share[1] * (a1 * s[j, r] + b[j, r])


@njit(fastmath=True, forceinline=True, cache=False)
def _layer4(w: Any, s: Any, b: Any, k: Any, share: Any, x: Any, y: Any) -> None:
    i, j, m, n = k[0], k[1], k[2], k[3]
    for r in range(w.shape[1]):
        a0, a1, a2, a3 = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for c in range(w.shape[2]):
            a0 += np.float32(w[i, r, c]) * x[c]
            a1 += np.float32(w[j, r, c]) * x[c]
            a2 += np.float32(w[m, r, c]) * x[c]
            a3 += np.float32(w[n, r, c]) * x[c]
        y[r] = (
            share[0] * (a0 * s[i, r] + b[i, r])
            + share[1] * (a1 * s[j, r] + b[j, r])
            + share[2] * (a2 * s[m, r] + b[m, r])
            + share[3] * (a3 * s[n, r] + b[n, r])
        )


@njit(fastmath=True)
def _evaluate(
    weights: Any,
    scales: Any,
    biases: Any,
    mean: Any,
    std: Any,
    kind: int,
    z: Any,
    phase: Any,
    work: Any,
    out: Any,
) -> None:
    index, share = np.empty(kind, np.int64), np.empty(kind, np.float32)
    last = len(weights) - 1
    for c in range(z.shape[0]):
        _phase(phase[c], kind, weights[0].shape[0], index, share)
        h = z[c]
        for i in range(len(weights)):
            y = work[i % 2, : weights[i].shape[1]]
            if kind == 1:
                k = index[0]
                _layer1(weights[i][k], scales[i][k], biases[i][k], h, y)
            elif kind == 2:
                _layer2(weights[i], scales[i], biases[i], index, share, h, y)
            else:
                _layer4(weights[i], scales[i], biases[i], index, share, h, y)
            if i < last:
                for r in range(y.size):
                    if y[r] < 0:
                        y[r] = np.exp(y[r]) - np.float32(1)
            h = y
        for r in range(h.size):
            out[c, r] = h[r] * std[r] + mean[r]


@njit(fastmath=True, forceinline=True, cache=False)
def _block(w: Any, s: Any, b: Any, x: Any, y: Any) -> None:
    """y (4, out) = W x + b for four characters at once; x: (4, in).

    Two rows by four characters: eight sums that the processor can keep going side by side.
    """
    rows, columns = w.shape
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    zero = np.float32(0)
    sums = np.empty((2, BLOCK), np.float32)
    for r in range(0, rows, 2):
        w0, w1 = w[r], w[min(r + 1, rows - 1)]
        a0, a1, a2, a3, b0, b1, b2, b3 = zero, zero, zero, zero, zero, zero, zero, zero
        for c in range(columns):
            p, q = np.float32(w0[c]), np.float32(w1[c])
            a0 += p * x0[c]
            a1 += p * x1[c]
            a2 += p * x2[c]
            a3 += p * x3[c]
            b0 += q * x0[c]
            b1 += q * x1[c]
            b2 += q * x2[c]
            b3 += q * x3[c]
        sums[0, 0], sums[0, 1], sums[0, 2], sums[0, 3] = a0, a1, a2, a3
        sums[1, 0], sums[1, 1], sums[1, 2], sums[1, 3] = b0, b1, b2, b3
        for k in range(min(2, rows - r)):
            for n in range(BLOCK):
                y[n, r + k] = sums[k, n] * s[r + k] + b[r + k]


@njit(fastmath=True, forceinline=True, cache=False)
def _layer_crowd(w: Any, s: Any, b: Any, index: Any, share: Any, x: Any, y: Any) -> None:
    """y (C, out) of x (C, in): point by point, the characters that blend it in blocks of four."""
    block_x, block_y = np.zeros((BLOCK, w.shape[2]), np.float32), np.zeros((BLOCK, w.shape[1]), np.float32)
    members, shares = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.float32)
    for c in range(y.shape[0]):
        for r in range(y.shape[1]):
            y[c, r] = np.float32(0)
    for point in range(w.shape[0]):
        waiting = 0
        for n in range(index.size + 1):
            if n < index.size:
                if index.flat[n] != point:
                    continue
                members[waiting], shares[waiting] = n // index.shape[1], share.flat[n]
                for r in range(w.shape[2]):
                    block_x[waiting, r] = x[members[waiting], r]
                waiting += 1
            if waiting == BLOCK or (n == index.size and waiting > 0):
                if waiting > 2:
                    _block(w[point], s[point], b[point], block_x, block_y)
                else:
                    for m in range(waiting):
                        _layer1(w[point], s[point], b[point], block_x[m], block_y[m])
                for m in range(waiting):
                    for r in range(w.shape[1]):
                        y[members[m], r] += shares[m] * block_y[m, r]
                waiting = 0


@njit(fastmath=True)
def _evaluate_crowd(
    weights: Any, scales: Any, biases: Any, mean: Any, std: Any, kind: int, z: Any, phase: Any, out: Any
) -> None:
    count = z.shape[0]
    index, share = np.empty((count, kind), np.int64), np.empty((count, kind), np.float32)
    for c in range(count):
        _phase(phase[c], kind, weights[0].shape[0], index[c], share[c])
    h = z
    for i in range(len(weights)):
        y = np.empty((count, weights[i].shape[1]), np.float32)
        _layer_crowd(weights[i], scales[i], biases[i], index, share, h, y)
        if i < len(weights) - 1:
            for c in range(count):
                for r in range(y.shape[1]):
                    if y[c, r] < 0:
                        y[c, r] = np.exp(y[c, r]) - np.float32(1)
        h = y
    for c in range(count):
        for r in range(h.shape[1]):
            out[c, r] = h[c, r] * std[r] + mean[r]
