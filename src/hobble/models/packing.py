"""Packs arrays as text for the report's page: little-endian bytes in base64, weights as 16-bit integers."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array


def to_base64(array: NDArray[Any]) -> str:
    """The little-endian bytes of an array as base64."""
    array = np.ascontiguousarray(array)
    return base64.b64encode(array.astype(array.dtype.newbyteorder("<")).tobytes()).decode("ascii")


def pack_layer(weights: Array, biases: Array) -> dict[str, Any]:
    """Weights (K, out, in) as integers of -32767..32767, with a factor for each row, and biases (K, out).

    In the result, points: K. rows: out. columns: in. scale: (K, out) factors of the integers. weights, scale
    and biases are text from `to_base64`.
    """
    # The factor of a row of zeros must not be 0, because the weights are divided by it.
    scale = np.maximum(np.abs(weights).max(axis=-1) / 32767, 1e-30).astype(np.float32)
    return {
        "points": weights.shape[0],
        "rows": weights.shape[1],
        "columns": weights.shape[2],
        "weights": to_base64(np.round(weights / scale[..., None]).astype(np.int16)),
        "scale": to_base64(scale),
        "biases": to_base64(biases.astype(np.float32)),
    }


def pack_table(table: Array) -> dict[str, Any]:
    """A table (R, columns) as integers of -32767..32767 with a factor for each column.

    In the result, rows: R. values: the integers, and scale: the factors (columns,), as text from `to_base64`.
    """
    scale = np.maximum(np.abs(table).max(axis=0) / 32767, 1e-30).astype(np.float32)
    return {
        "rows": table.shape[0],
        "columns": table.shape[1],
        "values": to_base64(np.round(table / scale).astype(np.int16)),
        "scale": to_base64(scale),
    }
