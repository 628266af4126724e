"""Writes a blended stack as one ONNX file and checks it. The graph contains the standardisation.

The inputs are `x` (batch, X) and `phase` (batch,) in cycles, the output is `y` (batch, Y). All are float32, x
and y are in raw units, and a batch may have any size. Networks that ignore the phase have this second input,
too, so that all files are called in the same way. Only this module needs the onnx packages: pip install
"hobble[onnx]".
"""

from __future__ import annotations

import importlib
import json
from abc import abstractmethod
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path
from hobble.core.quat import Array
from hobble.models.network import Network, inverse_or_0

OPSET = 15  # version of the ONNX operators
# Largest allowed difference from Hobble's runtime, in units of Y; relative for values above 1.
TOLERANCE = 1e-4
CHECKED_ROWS = 64  # a file is checked with this many random rows of X


class Node(str):
    """The name of a node's output or of a constant in a `Graph`. Arithmetic with it adds nodes."""

    graph: Graph

    def __add__(self, other: Any) -> Node:  # type: ignore[override]
        return self.graph("Add", self, other)

    def __sub__(self, other: Any) -> Node:
        return self.graph("Sub", self, other)

    def __rsub__(self, other: Any) -> Node:
        return self.graph("Sub", other, self)

    def __mul__(self, other: Any) -> Node:  # type: ignore[override]
        return self.graph("Mul", self, other)

    def __rmul__(self, other: Any) -> Node:  # type: ignore[override]
        return self.graph("Mul", other, self)

    def __truediv__(self, other: Any) -> Node:
        return self.graph("Div", self, other)


class Graph:
    """Collects the nodes and constants of an ONNX graph and gives each a unique name. A call adds a node."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def named(self, name: str) -> Node:
        """The node with the name `name`, such as an input."""
        node = Node(name)
        node.graph = self
        return node

    def __call__(self, op: str, *inputs: Any, output: str = "", **attributes: Any) -> Node:
        """Add a node with the ONNX operator `op`; returns its output.

        inputs: other nodes, numbers, lists or arrays. Lists and arrays of whole numbers become int64
        constants, all else float32. output: its name, by default a new one.
        """
        from onnx import helper

        output = output or f"n{len(self.nodes)}"
        names = [given if isinstance(given, Node) else self._constant(given) for given in inputs]
        self.nodes.append(helper.make_node(op, names, [output], **attributes))
        return self.named(output)

    def _constant(self, value: Any) -> Node:
        from onnx import numpy_helper

        array = np.asarray(value)
        is_whole = array.dtype.kind == "i" and array.ndim > 0
        array = np.array(array, np.int64 if is_whole else np.float32, order="C")
        self.constants.append(numpy_helper.from_array(array, f"c{len(self.constants)}"))
        return self.named(self.constants[-1].name)


def add_layers(
    g: Graph,
    weights: tuple[Array, ...],
    biases: tuple[Array, ...],
    h: Node,
    share: Node | None = None,
    index: Node | None = None,
) -> Node:
    """Add the nodes of layers with an ELU between them; returns the outputs of the last one.

    weights: (K, out, in) of each layer. biases: (K, out) of each. h: the inputs. index: (batch, n) numbers of
    the sets to blend; None: all. share: (batch, n) their shares; None: there is one set.
    """
    for number, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        h = g("Elu", h) if number else h
        sets, outputs, inputs = weight.shape
        if share is None:
            h = g("MatMul", h, weight[0].T) + bias[0]
            continue
        if index is None:  # one product for all sets side by side
            each = g("MatMul", h, weight.reshape(sets * outputs, inputs).T)
            each = g("Reshape", each, [-1, sets, outputs]) + bias
        else:
            each = g("MatMul", g("Gather", weight, index), g("Unsqueeze", h, [1, 3]))
            each = g("Squeeze", each, [3]) + g("Gather", bias, index)
        h = g("ReduceSum", each * g("Unsqueeze", share, [2]), [1], keepdims=0)
    return h


class OnnxNetwork(Network):
    """A network that can be written as an ONNX file."""

    @abstractmethod
    def onnx_outputs(self, g: Graph, z: Node, mode: str) -> Node:
        """Add the nodes that find the standardised outputs to a graph. z: the standardised inputs."""

    def export_onnx(self, target: Path, mode: str) -> str:
        """As `Network.export`: a file that was checked."""
        with atomic_path(target) as temporary:
            write_graph(temporary, self, mode)
            difference = check(temporary, self, mode)
        return f"{target}: differs from Hobble's runtime by at most {difference:.1g}"


def write_graph(path: str | Path, network: OnnxNetwork, mode: str) -> None:
    """Write the network, with a metadata entry `hobble` that describes columns, skeleton and channels.

    Raises HobbleError if onnx is not installed, ValueError for an unknown mode.
    """
    onnx = _package("onnx")
    helper, g = onnx.helper, Graph()
    z = (g.named("x") - network.x_mean) * inverse_or_0(network.x_std)
    g("Add", network.onnx_outputs(g, z, mode) * network.y_std, network.y_mean, output="y")
    x, phase, y = (
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["batch", *sizes])
        for name, sizes in (("x", [len(network.x_mean)]), ("phase", []), ("y", [len(network.y_mean)]))
    )
    opset = helper.make_opsetid("", OPSET)
    model = helper.make_model(
        helper.make_graph(g.nodes, "hobble", [x, phase], [y], g.constants),
        opset_imports=[opset],
        producer_name="hobble",
        ir_version=helper.find_min_ir_version_for([opset]),
    )
    helper.set_model_props(model, {"hobble": json.dumps(_metadata(network, mode))})
    onnx.checker.check_model(model, full_check=True)
    Path(path).write_bytes(model.SerializeToString(deterministic=True))


def check(path: str | Path, network: OnnxNetwork, mode: str) -> float:
    """Run the file in onnxruntime and the network in Hobble's runtime; return the largest difference of Y.

    Both get CHECKED_ROWS random rows. The difference is relative for values of Y above 1. Raises InputError
    if it is above TOLERANCE, HobbleError if onnxruntime is not installed.
    """
    onnxruntime = _package("onnxruntime")
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


def _package(name: str) -> Any:
    """A package that only exports need. Raises HobbleError if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise HobbleError(f'{name} is not installed: pip install "hobble[onnx]"') from error


def _metadata(network: OnnxNetwork, mode: str) -> dict[str, Any]:
    """The metadata: what a program that reads the file needs to use the columns."""
    keys = ("configuration", "contacts", "exponents", "limits", "units")
    return {
        "mode": mode,
        "layout": network.layout.to_dict(),
        "gaits": list(network.gaits),
        "channels": {name: list(labels) for name, labels in network.channels.items()},
        "skeleton": network.skeleton.to_dict() if network.skeleton is not None else None,
        **{key: network.meta[key] for key in keys if key in network.meta},
    }
