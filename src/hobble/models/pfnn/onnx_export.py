"""The network as one ONNX file: standardised, looked up by phase, evaluated and restored inside the graph.

Inputs `x` (batch, X) and `phase` (batch,) in cycles, output `y` (batch, Y), float32, any batch. What it takes
to write and to check it is wanted here alone: pip install "hobble[onnx]".
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path
from hobble.core.quat import Array
from hobble.models.network import inverse
from hobble.models.pfnn.forward import CATMULL_ROM
from hobble.models.pfnn.network import Pfnn
from hobble.models.pfnn.predictor import phase_tables

OPSET = 15
TOLERANCE = 1e-4  # of the runtime, in the units of Y, or of the value where it is above 1
CHECKED_ROWS = 64


class _Graph:
    """Collects nodes and constants under names of their own."""

    def __init__(self, helper: Any, numpy_helper: Any) -> None:
        self.helper, self.numpy_helper = helper, numpy_helper
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, value: Any, dtype: Any = np.float32) -> str:
        name = f"c{len(self.constants)}"
        array = np.ascontiguousarray(value, dtype).reshape(np.shape(value))
        self.constants.append(self.numpy_helper.from_array(array, name))
        return name

    def __call__(self, op: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        output = output or f"n{len(self.nodes)}"
        self.nodes.append(self.helper.make_node(op, inputs, [output], **attributes))
        return output


def export_onnx(path: str | Path, network: Pfnn, mode: str = "cubic") -> None:
    """Write the network in one phase mode; its columns, skeleton and links go along as metadata `hobble`.

    cubic blends the outputs of all control points, which is exact; linear and constant look weights up.
    Raises HobbleError where the onnx package is not installed, ValueError for an unknown mode.
    """
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise HobbleError('ONNX needs its package: pip install "hobble[onnx]"') from error
    tables = phase_tables(network, mode)
    g = _Graph(helper, numpy_helper)
    index, share = _lookup(g, mode, len(tables[0][0]))
    h = g("Sub", "x", g.constant(network.x_mean))
    h = g("Mul", h, g.constant(inverse(network.x_std)))
    for i, (w, b) in enumerate(tables):
        h = _all_points(g, w, b, share, h) if mode == "cubic" else _gathered(g, w, b, index, share, h)
        if i < len(tables) - 1:
            h = g("Elu", h)
    g("Add", g("Mul", h, g.constant(network.y_std)), g.constant(network.y_mean), output="y")
    sizes = network.sizes
    ends = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", *columns])
        for name, columns in (("x", [sizes[0]]), ("phase", []), ("y", [sizes[-1]]))
    ]
    graph = helper.make_graph(g.nodes, "hobble", ends[:2], ends[2:], g.constants)
    opset = helper.make_opsetid("", OPSET)
    model = helper.make_model(
        graph,
        opset_imports=[opset],
        producer_name="hobble",
        ir_version=helper.find_min_ir_version_for([opset]),
    )
    helper.set_model_props(model, {"hobble": json.dumps(_about(network, mode))})
    onnx.checker.check_model(model, full_check=True)
    with atomic_path(path) as temporary:
        temporary.write_bytes(model.SerializeToString(deterministic=True))


def write_checked(path: str | Path, network: Pfnn, mode: str = "cubic") -> float:
    """Export, and check before the file has its name; returns and raises what the two functions do."""
    with atomic_path(path) as temporary:
        export_onnx(temporary, network, mode)
        return check_onnx(temporary, network, mode)


def check_onnx(path: str | Path, network: Pfnn, mode: str = "cubic") -> float:
    """The largest difference between the file, run by onnxruntime, and the runtime, over random rows.

    It is in the units of Y, or in shares of the value where that is above 1.

    Raises InputError where it is above TOLERANCE, HobbleError where onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError as error:
        raise HobbleError('onnxruntime is not installed: pip install "hobble[onnx]"') from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(1)
    x = network.x_mean + network.x_std * rng.normal(size=(CHECKED_ROWS, network.sizes[0]))
    phase = rng.random(CHECKED_ROWS).astype(np.float32)
    phase[:3] = 0.0, 0.5, 1.0
    x = x.astype(np.float32)
    (y,) = session.run(["y"], {"x": x, "phase": phase})
    expected = network.predictor(mode).predict(x, phase.astype(float))
    difference = float((np.abs(y - expected) / np.maximum(1.0, np.abs(expected))).max())
    if not difference <= TOLERANCE:
        raise InputError(path, f"onnxruntime gives other numbers than the runtime: off by {difference:.2g}")
    return difference


def _about(network: Pfnn, mode: str) -> dict[str, Any]:
    """What a reader has to know of the columns."""
    keys = ("configuration", "contacts", "limits", "units")
    return {
        "mode": mode,
        "layout": network.layout.to_dict(),
        "gaits": list(network.gaits),
        "channels": {name: list(labels) for name, labels in network.channels.items()},
        "skeleton": network.skeleton.to_dict() if network.skeleton is not None else None,
        **{key: network.meta[key] for key in keys if key in network.meta},
    }


def _lookup(g: _Graph, mode: str, points: int) -> tuple[str, str]:
    """Which points a phase blends (batch, n) and their shares (batch, n, 1); for cubic, of all points."""
    one = g.constant(1.0)
    # A phase of exactly 1 is the end of the cycle and not its start, as in `PfnnPredictor`.
    wrapped = g("Where", g("Equal", "phase", one), "phase", g("Sub", "phase", g("Floor", "phase")))
    scaled = g("Mul", wrapped, g.constant(points))
    last = g.constant(points - 1)
    first = g("Min", g("Floor", scaled), last)
    column = g.constant([1], np.int64)
    t = g("Unsqueeze", g("Sub", scaled, first), column)
    index = g("Unsqueeze", g("Cast", first, to=7), column)
    if mode == "constant":
        share = g("Add", g("Sub", t, t), one)
    elif mode == "linear":
        both = g("Add", index, g.constant([[0, 1]], np.int64))
        index = g("Mod", both, g.constant(points, np.int64))
        share = g("Concat", g("Sub", one, t), t, axis=1)
    else:
        square = g("Mul", t, t)
        powers = g("Concat", g("Add", g("Sub", t, t), one), t, square, g("Mul", square, t), axis=1)
        # A column for each point: the four that are blended, then zeros, turned round to where the phase is.
        table = np.pad(CATMULL_ROM.T, ((0, 0), (0, points - 4)))
        shares = g("MatMul", powers, g.constant(table))
        turned = g("Sub", g.constant([[k + 1 + points for k in range(points)]], np.int64), index)
        share = g("GatherElements", shares, g("Mod", turned, g.constant(points, np.int64)), axis=1)
    return index, g("Unsqueeze", share, g.constant([2], np.int64))


def _all_points(g: _Graph, w: Array, b: Array, share: str, h: str) -> str:
    """sum_k c_k (W_k h + b_k): one product with the control points side by side."""
    points, rows, columns = w.shape
    side_by_side = g("MatMul", h, g.constant(w.reshape(points * rows, columns).T))
    each = g("Add", g("Reshape", side_by_side, g.constant([-1, points, rows], np.int64)), g.constant(b))
    return g("ReduceSum", g("Mul", each, share), g.constant([1], np.int64), keepdims=0)


def _gathered(g: _Graph, w: Array, b: Array, index: str, share: str, h: str) -> str:
    """The same over the points in `index` (batch, n) alone."""
    weights, biases = g("Gather", g.constant(w), index), g("Gather", g.constant(b), index)
    column = g("Unsqueeze", h, g.constant([1, 3], np.int64))
    each = g("Squeeze", g("MatMul", weights, column), g.constant([3], np.int64))
    return g("ReduceSum", g("Mul", g("Add", each, biases), share), g.constant([1], np.int64), keepdims=0)
