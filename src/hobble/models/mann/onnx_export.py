"""The mode-adaptive network as ONNX."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.models.mann.network import Mann
from hobble.models.onnx_file import Graph, write


def write_checked(path: str | Path, network: Mann) -> float:
    """Write and check the file. Returns the largest difference, see `hobble.models.onnx_file.check`."""

    def body(g: Graph, z: str) -> str:
        h = g("Gather", z, g.constant(network.columns, np.int64), axis=1)
        for i, (w, b) in enumerate(zip(network.gate_weights, network.gate_biases, strict=True)):
            h = g("Elu", h) if i else h
            h = g("Add", g("MatMul", h, g.constant(w.T)), g.constant(b))
        shares = g("Unsqueeze", g("Softmax", h, axis=1), g.constant([2], np.int64))
        h = z
        for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
            h = g("Elu", h) if i else h
            experts, outputs, inputs = w.shape
            each = g("MatMul", h, g.constant(w.reshape(experts * outputs, inputs).T))
            each = g("Add", g("Reshape", each, g.constant([-1, experts, outputs], np.int64)), g.constant(b))
            h = g("ReduceSum", g("Mul", each, shares), g.constant([1], np.int64), keepdims=0)
        return h

    return write(path, network, "exact", body)
