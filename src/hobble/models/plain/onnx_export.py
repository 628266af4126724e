"""Writes the plain network as an ONNX file, with `hobble.models.onnx_file`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.models.onnx_file import Graph, write
from hobble.models.plain.network import Plain


def write_checked(path: str | Path, network: Plain) -> float:
    """Write and check the file. Returns the largest difference of Y, see `hobble.models.onnx_file.check`."""

    def body(g: Graph, z: str) -> str:  # adds the nodes of the network to the graph
        angle = g("Unsqueeze", g("Mul", "phase", g.constant(2 * np.pi)), g.constant([1], np.int64))
        h = g("Concat", z, g("Sin", angle), g("Cos", angle), axis=1)
        for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
            h = g("Add", g("MatMul", h, g.constant(w.T)), g.constant(b))
            h = g("Elu", h) if i < len(network.weights) - 1 else h
        return h

    return write(path, network, "exact", body)
