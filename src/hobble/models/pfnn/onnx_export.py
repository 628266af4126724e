"""Writes the phase-functioned network as an ONNX file, with `hobble.models.onnx_file`.

The graph also finds the weights that belong to a phase.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.quat import Array
from hobble.models import onnx_file
from hobble.models.onnx_file import OPSET, TOLERANCE, Graph
from hobble.models.pfnn.forward import CATMULL_ROM
from hobble.models.pfnn.network import Pfnn
from hobble.models.pfnn.predictor import phase_tables

__all__ = ["OPSET", "TOLERANCE", "check_onnx", "export_onnx", "write_checked"]


def export_onnx(path: str | Path, network: Pfnn, mode: str = "cubic") -> None:
    """Write the network in a mode of `hobble.models.pfnn.predictor`; see `onnx_file.export`.

    The mode cubic blends the outputs of all control points, which is exact. The modes linear and constant use
    tables of the weights at some phases. Raises ValueError for an unknown mode.
    """
    onnx_file.export(path, network, mode, _body(network, mode))


def write_checked(path: str | Path, network: Pfnn, mode: str = "cubic") -> float:
    """Write the network and check the file. Returns the largest difference of Y, see `onnx_file.check`."""
    return onnx_file.write(path, network, mode, _body(network, mode))


def check_onnx(path: str | Path, network: Pfnn, mode: str = "cubic") -> float:
    """The largest difference of Y between the file and Hobble's runtime, see `onnx_file.check`."""
    return onnx_file.check(path, network, mode)


def _body(network: Pfnn, mode: str) -> onnx_file.Body:
    """The function that adds the nodes of the network to a graph; see `onnx_file.export`."""
    tables = phase_tables(network, mode)

    def body(g: Graph, z: str) -> str:
        index, share = _add_shares(g, mode, len(tables[0][0]))
        h = z
        for i, (w, b) in enumerate(tables):
            h = _blend_all(g, w, b, share, h) if mode == "cubic" else _blend_some(g, w, b, index, share, h)
            if i < len(tables) - 1:
                h = g("Elu", h)
        return h

    return body


def _add_shares(g: Graph, mode: str, points: int) -> tuple[str, str]:
    """Add the nodes that find the points around the phase. points: number of stored phases or control points.

    Returns the names of two outputs: the indices (batch, n) of the n points to blend, and their shares
    (batch, n, 1). In the mode cubic the shares are (batch, points, 1), and the indices are not needed.
    """
    one = g.constant(1.0)
    # A phase of exactly 1 is the end of the cycle, not its start, as in `PfnnPredictor`. Other phases are
    # brought to 0..1.
    wrapped = g("Where", g("Equal", "phase", one), "phase", g("Sub", "phase", g("Floor", "phase")))
    scaled = g("Mul", wrapped, g.constant(points))
    last = g.constant(points - 1)
    first = g("Min", g("Floor", scaled), last)
    second_axis = g.constant([1], np.int64)
    t = g("Unsqueeze", g("Sub", scaled, first), second_axis)
    index = g("Unsqueeze", g("Cast", first, to=7), second_axis)  # 7 is int64
    if mode == "constant":
        share = g("Add", g("Sub", t, t), one)  # 1 in the shape of t
    elif mode == "linear":
        both = g("Add", index, g.constant([[0, 1]], np.int64))
        index = g("Mod", both, g.constant(points, np.int64))
        share = g("Concat", g("Sub", one, t), t, axis=1)
    else:
        square = g("Mul", t, t)
        powers = g("Concat", g("Add", g("Sub", t, t), one), t, square, g("Mul", square, t), axis=1)
        # The product has a column for each point: the shares of the points index - 1 to index + 2, then
        # zeros. The share of point k is in column (k + 1 - index) mod points.
        table = np.pad(CATMULL_ROM.T, ((0, 0), (0, points - 4)))
        shares = g("MatMul", powers, g.constant(table))
        column = g("Sub", g.constant([[k + 1 + points for k in range(points)]], np.int64), index)
        share = g("GatherElements", shares, g("Mod", column, g.constant(points, np.int64)), axis=1)
    return index, g("Unsqueeze", share, g.constant([2], np.int64))


def _blend_all(g: Graph, w: Array, b: Array, share: str, h: str) -> str:
    """Add the nodes of sum_k c_k (W_k h + b_k) over all points k, as one matrix product.

    w: (points, out, in). b: (points, out). share, h: names of the shares c and of the inputs.
    """
    points, outputs, inputs = w.shape
    side_by_side = g("MatMul", h, g.constant(w.reshape(points * outputs, inputs).T))
    each = g("Add", g("Reshape", side_by_side, g.constant([-1, points, outputs], np.int64)), g.constant(b))
    return g("ReduceSum", g("Mul", each, share), g.constant([1], np.int64), keepdims=0)


def _blend_some(g: Graph, w: Array, b: Array, index: str, share: str, h: str) -> str:
    """Like `_blend_all`, but the sum is only over the points in `index` (batch, n)."""
    weights, biases = g("Gather", g.constant(w), index), g("Gather", g.constant(b), index)
    column = g("Unsqueeze", h, g.constant([1, 3], np.int64))
    each = g("Squeeze", g("MatMul", weights, column), g.constant([3], np.int64))
    return g("ReduceSum", g("Mul", g("Add", each, biases), share), g.constant([1], np.int64), keepdims=0)
