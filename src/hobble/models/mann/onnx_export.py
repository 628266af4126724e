"""The mode-adaptive network as ONNX."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.models.mann.network import Mann
from hobble.models.onnx_file import Graph, write


def write_checked(path: str | Path, network: Mann) -> float:
    """Write the file, and check it against Hobble's runtime.

    Returns the largest difference between their outputs, see `hobble.models.onnx_file.check`.
    """

    # The same computation as in `hobble.models.mann.forward`. h and z are names of nodes.
    def add_nodes(add: Graph, z: str) -> str:
        h = add("Gather", z, add.constant(network.columns, np.int64), axis=1)
        for i, (w, b) in enumerate(zip(network.gate_weights, network.gate_biases, strict=True)):
            h = add("Elu", h) if i else h
            h = add("Add", add("MatMul", h, add.constant(w.T)), add.constant(b))
        shares = add("Unsqueeze", add("Softmax", h, axis=1), add.constant([2], np.int64))  # (batch, K, 1)
        h = z
        for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
            h = add("Elu", h) if i else h
            experts, outputs, inputs = w.shape
            each = add("MatMul", h, add.constant(w.reshape(experts * outputs, inputs).T))
            each = add("Reshape", each, add.constant([-1, experts, outputs], np.int64))
            each = add("Add", each, add.constant(b))
            h = add("ReduceSum", add("Mul", each, shares), add.constant([1], np.int64), keepdims=0)
        return h

    return write(path, network, "exact", add_nodes)
