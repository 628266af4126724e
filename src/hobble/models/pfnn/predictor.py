"""Evaluating the network at a phase: three modes, float32 or int16 storage, one character or a crowd.

Outputs are blended, not weights: sum_k c_k (W_k x + b_k) is the same (a layer is linear before its
activation), and no blended matrix is written to memory. One character is limited by reading weights from
memory; a crowd reads each weight once for all characters that use it. A character's prediction has the same
bits alone and in any crowd, because its sums always have the same order (`hobble.models.tiles`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.network import STORAGES, inverse
from hobble.models.pfnn.forward import weights_at
from hobble.models.tiles import WIDTH, aligned, in_panels, multiply, panels_of

if TYPE_CHECKING:
    from hobble.models.pfnn.network import Pfnn

MODES = {"constant": 50, "linear": 10, "cubic": None}  # mode: stored phases; None: the control points


class PfnnPredictor:
    """A network prepared for one phase mode.

    mode: "constant" (50 phases, rounded down), "linear" (10 phases, blended), "cubic" (exact).
    storage: "float32", or "int16" with a scale for each row: half the memory traffic, poses within 0.1 mm.
    """

    def __init__(self, network: Pfnn, mode: str = "cubic", storage: str = "float32") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        self.network, self.mode, self.storage = network, mode, storage
        tables = phase_tables(network, mode)
        self.points = len(tables[0][0])
        self._x_mean, self._x_inverse, y_mean, y_std = (
            np.ascontiguousarray(a, np.float32)
            for a in (network.x_mean, inverse(network.x_std), network.y_mean, network.y_std)
        )
        self._weights, self._numbers, self._plan = _flatten(tables, storage, y_mean, y_std)
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
        _standardise(x, self._x_mean, self._x_inverse, z)

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y of standardised inputs z at phases (C,) into `out`."""
        _evaluate(self._weights, self._numbers, self._plan, self._kind, self.points, z, phase, out)


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


# Columns of the plan, one row per layer: numbers of inputs and outputs, and where weights, scales and biases
# begin. Everything is in a few flat arrays, since each array argument costs 0.3 microseconds.
INPUTS, OUTPUTS, WEIGHTS, SCALES, BIASES = range(5)


def _flatten(
    tables: list[tuple[Array, Array]], storage: str, y_mean: Array, y_std: Array
) -> tuple[Array, Array, Array]:
    """All layers in flat arrays: (weights, numbers, plan).

    weights: (n,) in panels, point by point. numbers: (n,) float32: y_mean, y_std, then for each layer the
    row factors and the biases at each point. plan: see INPUTS to BIASES.
    """
    numbers, plan, at, size = [y_mean, y_std], [], 0, 2 * len(y_mean)
    weights = aligned(sum(_panel_numbers(w) for w, _ in tables), storage)
    for table, biases in tables:
        points, outputs, inputs = table.shape
        stored, scales = _pack(table, storage)
        panels = in_panels(stored).ravel()
        weights[at : at + panels.size] = panels
        plan.append([inputs, outputs, at, size, size + points * outputs])
        numbers += [scales.ravel(), np.asarray(biases, np.float32).ravel()]
        at, size = at + panels.size, size + 2 * points * outputs
    return weights, np.concatenate(numbers), np.array(plan, np.int64)


def _panel_numbers(table: Array) -> int:
    points, outputs, inputs = table.shape
    return int(points * panels_of(outputs) * WIDTH * inputs)


def _pack(weights: Array, storage: str) -> tuple[Array, Array]:
    """Weights (K, out, in) in their storage type, and the factor of each row (K, out)."""
    if storage == "float32":
        return np.asarray(weights, np.float32), np.ones(weights.shape[:2], np.float32)
    scale = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30)
    return np.round(weights / scale[..., None]).astype(np.int16), scale.astype(np.float32)


@njit(fastmath=True)
def _standardise(x: Any, mean: Any, inverse: Any, z: Any) -> None:
    for c in range(x.shape[0]):
        for i in range(x.shape[1]):
            z[c, i] = (x[c, i] - mean[i]) * inverse[i]


# Only functions called from Python are cached on disk; their callees are inlined. Otherwise the compiler may
# optimise across calls the first time but not after loading from the cache, which changes the rounding.
@njit(forceinline=True, cache=False)
def _phase(phase: float, kind: int, points: int, index: Any, share: Any) -> None:
    """Write the points that `phase` blends (`kind` of them: 1, 2 or 4) and their coefficients."""
    # A phase of exactly 1 is the end of the cycle, not its start; in constant mode their weights differ.
    wrapped = phase if phase == 1.0 else phase - np.floor(phase)
    # In single precision, as in the original: .04 * 50 is 2, not just below it.
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


@njit(forceinline=True, cache=False)
def _exp(x: Any) -> Any:
    """e^x for x <= 0 in float32, relative error 2e-7; written out so that the compiler can vectorise it."""
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


@njit(error_model="numpy")
def _evaluate(
    weights: Any, numbers: Any, plan: Any, kind: int, points: int, z: Any, phase: Any, out: Any
) -> None:
    count, layers = z.shape[0], plan.shape[0]
    index, share = np.empty((count, kind), np.int64), np.empty((count, kind), np.float32)
    for c in range(count):
        _phase(phase[c], kind, points, index[c], share[c])
    widest = 0
    for layer in range(layers):
        widest = max(widest, plan[layer, INPUTS], -(-plan[layer, OUTPUTS] // WIDTH) * WIDTH)
    room = np.empty((4, count * widest), np.float32)
    h, y, some, sums = room[0], room[1], room[2], room[3]
    members, slots = np.empty(count, np.int64), np.empty(count, np.int64)
    shares = np.empty(count, np.float32)
    for c in range(count):
        _copy(z[c], z.shape[1], h[c * z.shape[1] :])
    for layer in range(layers):
        inputs, outputs = plan[layer, INPUTS], plan[layer, OUTPUTS]
        padded = -(-outputs // WIDTH) * WIDTH
        y[: count * outputs] = np.float32(0)
        for point in range(points):
            rows = _characters_at(point, index, share, members, shares)
            if rows == 0:
                continue
            for m in range(rows):
                slots[m] = m * padded
                if rows < count:
                    _copy(h[members[m] * inputs :], inputs, some[m * inputs :])
            sums[: rows * padded] = np.float32(0)
            start = plan[layer, WEIGHTS] + point * padded * inputs
            multiply(weights, start, padded // WIDTH, inputs, h if rows == count else some, rows, sums, slots)
            scales = numbers[plan[layer, SCALES] + point * outputs :]
            biases = numbers[plan[layer, BIASES] + point * outputs :]
            for m in range(rows):
                _add(sums[m * padded :], scales, biases, shares[m], outputs, y[members[m] * outputs :])
        if layer < layers - 1:
            _elu(y, count * outputs)
        h, y = y, h
    outputs = out.shape[1]
    for c in range(count):
        _restore(h[c * outputs :], numbers, outputs, out[c])


@njit(forceinline=True, cache=False)
def _characters_at(point: int, index: Any, share: Any, members: Any, shares: Any) -> int:
    """Write the characters that blend `point`, and their shares; returns how many there are."""
    rows = 0
    for c in range(index.shape[0]):
        for k in range(index.shape[1]):
            if index[c, k] == point:
                members[rows], shares[rows] = c, share[c, k]
                rows += 1
    return rows


# The loops below start at index 0 of their arguments. With an offset in the index, the compiler checks for
# negative indices at every step and does not vectorise.


@njit(forceinline=True, cache=False)
def _copy(x: Any, count: int, to: Any) -> None:
    for i in range(count):
        to[i] = x[i]


@njit(forceinline=True, cache=False)
def _add(sums: Any, scales: Any, biases: Any, share: Any, count: int, y: Any) -> None:
    for r in range(count):
        y[r] += share * (sums[r] * scales[r] + biases[r])


@njit(forceinline=True, cache=False)
def _elu(y: Any, count: int) -> None:
    for r in range(count):
        below = _exp(min(y[r], np.float32(0))) - np.float32(1)
        y[r] = y[r] if y[r] > 0 else below


@njit(forceinline=True, cache=False)
def _restore(h: Any, statistics: Any, count: int, out: Any) -> None:
    """out = h std + mean; statistics: the means, then the standard deviations."""
    std = statistics[count:]
    for r in range(count):
        out[r] = h[r] * std[r] + statistics[r]
