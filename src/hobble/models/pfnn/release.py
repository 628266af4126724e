"""Reads and writes a folder of .bin files, the format in which Holden et al. (2017) released their weights.

Ports of their program to other languages can read this format.

W0_000.bin .. W2_049.bin and b0_000.bin .. b2_049.bin hold the weights and biases of three layers at phases
i / 50. Xmean.bin, Xstd.bin, Ymean.bin and Ystd.bin hold means and standard deviations of X and Y. All are raw
little-endian float32, row-major (out, in).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import atomic_path, read_bytes
from hobble.core.quat import Array
from hobble.models.forward import phase_shares, weights_at
from hobble.models.load import MOST_LAYERS, STATISTICS

if TYPE_CHECKING:
    from hobble.models.blend import BlendedNetwork

PHASES = 50  # number of phases at which weights are stored, equally spaced over a cycle
CONTROL_POINTS = 4  # of the splines on which the weights lie
MOST_COLUMNS = 1 << 16  # largest number of columns of X or Y, and of units of a layer
MOST_WEIGHTS = 1 << 21  # largest number of weights in a file; the released files have at most 262,144
# Largest difference of a weight from the spline. Rounding weights near 1 to single precision causes smaller
# differences. Weights that do not lie on a spline with CONTROL_POINTS differ by far more.
LARGEST_RESIDUAL = 1e-4


def write_release(folder: str | Path, network: BlendedNetwork) -> None:
    """Write the files of the network into `folder`, which is created if it is missing."""
    folder = Path(folder)
    phases = np.arange(PHASES) / PHASES
    for name, key in STATISTICS.items():
        _write(folder / f"{name}.bin", getattr(network, key))
    for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
        for letter, points in (("W", w), ("b", b)):
            for k, array in enumerate(weights_at(points, phases)):
                _write(folder / f"{letter}{i}_{k:03d}.bin", array)


def read_release(folder: str | Path) -> Mapping[str, Array]:
    """The arrays W0 (4, out, in), b0 (4, out), ..., Xmean, ... of a folder, for `Network.read`.

    W0, b0, ... are the control points of splines, fitted to the weights at the 50 phases by least squares.
    Raises InputError if a file is missing, has a wrong size or numbers that are not finite, or if the weights
    at the 50 phases do not lie on a cyclic cubic spline with 4 control points.
    """
    folder = Path(folder)
    arrays = {name: _read(folder / f"{name}.bin") for name in STATISTICS}
    layers = sum(1 for _ in folder.glob("b[0-9]*_000.bin"))
    if not 0 < layers <= MOST_LAYERS:
        problem = f"has {layers} layers (files b0_000.bin, b1_000.bin, ...); 1 to {MOST_LAYERS} are allowed"
        raise InputError(folder, problem)
    inputs = len(arrays["Xmean"])
    for i in range(layers):
        outputs = len(_read(folder / f"b{i}_000.bin"))
        if outputs * inputs > MOST_WEIGHTS:
            problem = f"{outputs} x {inputs} weights in a layer; at most {MOST_WEIGHTS} are allowed"
            raise InputError(folder / f"b{i}_000.bin", problem)
        biases = np.stack([_read(folder / f"b{i}_{k:03d}.bin", outputs) for k in range(PHASES)])
        weights = np.stack([_read(folder / f"W{i}_{k:03d}.bin", outputs * inputs) for k in range(PHASES)])
        arrays[f"b{i}"] = _control_points(folder, f"b{i}", biases)
        arrays[f"W{i}"] = _control_points(folder, f"W{i}", weights).reshape(CONTROL_POINTS, outputs, inputs)
        inputs = outputs
    return arrays


def _control_points(folder: Path, name: str, values: Array) -> Array:
    """(4, n) control points of n splines, fitted to their values (50, n) at the phases.

    name: W or b and the number of the layer, for error messages. Numbers that are not finite fit no spline.
    """
    shares = phase_shares(np.arange(PHASES) / PHASES, np.arange(CONTROL_POINTS))
    points = np.linalg.lstsq(shares, values.astype(float), rcond=None)[0]
    residual = float(np.abs(shares @ points - values).max())
    if not residual < LARGEST_RESIDUAL:
        problem = f"{name} at 50 phases is not a cyclic cubic spline with 4 control points"
        raise InputError(folder, f"{problem}: it is off by up to {residual:.2g}")
    return points.astype(np.float32)


def _read(path: Path, size: int | None = None) -> Array:
    """The float32 numbers of a file. size: how many it must hold; None: any number up to MOST_COLUMNS."""
    data = read_bytes(path, 4 * (MOST_COLUMNS if size is None else size))
    if len(data) % 4 or not data or (size is not None and len(data) != 4 * size):
        expected = "a multiple of 4 above 0" if size is None else 4 * size
        raise InputError(path, f"has {len(data)} bytes, expected {expected}")
    return np.frombuffer(data, "<f4").astype(np.float32)


def _write(path: Path, array: Array) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(np.ascontiguousarray(array, "<f4").tobytes())
