"""Writes a network as one ONNX file and checks it. The graph contains the standardisation.

The inputs are `x` (batch, X) and `phase` (batch,) in cycles, the output is `y` (batch, Y). All are float32, x
and y are in raw units, and a batch may have any size. Networks that ignore the phase have this second input,
too, so that all files are called in the same way. Only this module needs the onnx packages: pip install
"hobble[onnx]".
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path
from hobble.models.network import Network, inverse_or_0

OPSET = 15  # version of the ONNX operators
# Largest allowed difference from Hobble's runtime, in units of Y; relative for values above 1.
TOLERANCE = 1e-4
CHECKED_ROWS = 64  # a file is checked with this many random rows of X


class Graph:
    """Collects the nodes and constants of an ONNX graph and gives each a unique name.

    A call adds a node. helper, numpy_helper: modules of onnx.
    """

    def __init__(self, helper: Any, numpy_helper: Any) -> None:
        self.helper, self.numpy_helper = helper, numpy_helper
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, value: Any, dtype: Any = np.float32) -> str:
        """Add a constant; returns its name."""
        name = f"c{len(self.constants)}"
        array = np.ascontiguousarray(value, dtype).reshape(np.shape(value))
        self.constants.append(self.numpy_helper.from_array(array, name))
        return name

    def __call__(self, op: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Add a node with the ONNX operator `op`; returns the name of its output.

        inputs: names of other outputs or constants. output: its name, by default a new one.
        """
        output = output or f"n{len(self.nodes)}"
        self.nodes.append(self.helper.make_node(op, inputs, [output], **attributes))
        return output


Body = Callable[[Graph, str], str]  # adds the nodes of a network; see `export`


def export(path: str | Path, network: Network, mode: str, body: Body) -> None:
    """Write the network, with a metadata entry `hobble` that describes columns, skeleton and channels.

    body: adds the nodes of the network to the graph. It gets the graph and the name of the standardised
    inputs, and returns the name of the standardised outputs. The phases have the name "phase". Raises
    HobbleError if onnx is not installed.
    """
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise HobbleError('onnx is not installed: pip install "hobble[onnx]"') from error
    g = Graph(helper, numpy_helper)
    z = g("Sub", "x", g.constant(network.x_mean))
    z = g("Mul", z, g.constant(inverse_or_0(network.x_std)))
    h = body(g, z)
    g("Add", g("Mul", h, g.constant(network.y_std)), g.constant(network.y_mean), output="y")
    columns_of: tuple[tuple[str, list[int]], ...] = (
        ("x", [len(network.x_mean)]),
        ("phase", []),
        ("y", [len(network.y_mean)]),
    )
    inputs_and_output = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", *sizes])
        for name, sizes in columns_of
    ]
    graph = helper.make_graph(g.nodes, "hobble", inputs_and_output[:2], inputs_and_output[2:], g.constants)
    opset = helper.make_opsetid("", OPSET)
    model = helper.make_model(
        graph,
        opset_imports=[opset],
        producer_name="hobble",
        ir_version=helper.find_min_ir_version_for([opset]),
    )
    helper.set_model_props(model, {"hobble": json.dumps(_metadata(network, mode))})
    onnx.checker.check_model(model, full_check=True)
    with atomic_path(path) as temporary:
        temporary.write_bytes(model.SerializeToString(deterministic=True))


def check(path: str | Path, network: Network, mode: str) -> float:
    """Run the file in onnxruntime and the network in Hobble's runtime; return the largest difference of Y.

    Both get CHECKED_ROWS random rows. The difference is relative for values of Y above 1. Raises InputError
    if it is above TOLERANCE, HobbleError if onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError as error:
        raise HobbleError('onnxruntime is not installed: pip install "hobble[onnx]"') from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(1)
    x = network.x_mean + network.x_std * rng.normal(size=(CHECKED_ROWS, len(network.x_mean)))
    phase = rng.random(CHECKED_ROWS).astype(np.float32)
    phase[:3] = 0.0, 0.5, 1.0
    x = x.astype(np.float32)
    (y,) = session.run(["y"], {"x": x, "phase": phase})
    expected = network.predictor(mode, "float32").predict(x, phase.astype(float))
    difference = float((np.abs(y - expected) / np.maximum(1.0, np.abs(expected))).max())
    if not difference <= TOLERANCE:
        problem = f"onnxruntime and Hobble's runtime differ by {difference:.2g}, more than {TOLERANCE:g}"
        raise InputError(path, problem)
    return difference


def write(path: str | Path, network: Network, mode: str, body: Body) -> float:
    """`export` to a temporary file, `check` it, then rename it to `path`. Returns what `check` returns."""
    with atomic_path(path) as temporary:
        export(temporary, network, mode, body)
        return check(temporary, network, mode)


def _metadata(network: Network, mode: str) -> dict[str, Any]:
    """The metadata: what a program that reads the file needs to use the columns."""
    keys = ("configuration", "contacts", "limits", "units")
    return {
        "mode": mode,
        "layout": network.layout.to_dict(),
        "gaits": list(network.gaits),
        "channels": {name: list(labels) for name, labels in network.channels.items()},
        "skeleton": network.skeleton.to_dict() if network.skeleton is not None else None,
        **{key: network.meta[key] for key in keys if key in network.meta},
    }
