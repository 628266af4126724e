"""The mode-adaptive network as ONNX."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.models.mann.network import Mann
from hobble.models.onnx_file import Graph, write


def write_checked(path: str | Path, network: Mann) -> float:
    """As `hobble.models.onnx_file.write`."""

    def body(g: Graph, z: str) -> str:
        h = g("Gather", z, g.constant(network.columns, np.int64), axis=1)
        for i, (w, b) in enumerate(zip(network.gate_weights, network.gate_biases, strict=True)):
            h = g("Elu", h) if i else h
            h = g("Add", g("MatMul", h, g.constant(w.T)), g.constant(b))
        share = g("Unsqueeze", g("Softmax", h, axis=1), g.constant([2], np.int64))
        h = z
        for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
            h = g("Elu", h) if i else h
            experts, rows, columns = w.shape
            each = g("MatMul", h, g.constant(w.reshape(experts * rows, columns).T))
            each = g("Add", g("Reshape", each, g.constant([-1, experts, rows], np.int64)), g.constant(b))
            h = g("ReduceSum", g("Mul", each, share), g.constant([1], np.int64), keepdims=0)
        return h

    return write(path, network, "exact", body)
