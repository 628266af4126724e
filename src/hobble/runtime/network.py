"""The trained network as control points: what it is made of, and reading it from disk."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import NAMES, channel, every
from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.untrusted import read_yaml
from hobble.rows.layout import GAITS, RowLayout

# Rows: the four control points about a place between the second and the third; columns: powers of that place.
CATMULL_ROM = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]], float)
STATISTICS = ("Xmean", "Xstd", "Ymean", "Ystd")


@dataclass(frozen=True)
class Network:
    """A phase-functioned network: per layer, K cyclic control points of its weights.

    weights: per layer (K, out, in) float32; biases: per layer (K, out) float32.
    x_mean, x_std, y_mean, y_std: what standardises X and restores Y.
    layout: the columns; gaits: the order of the gait blocks; skeleton: None where the file carries none.
    channels: name -> labels of its columns, for each channel that the network is told.
    """

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)
    x_mean: Array = field(repr=False)
    x_std: Array = field(repr=False)
    y_mean: Array = field(repr=False)
    y_std: Array = field(repr=False)
    layout: RowLayout
    skeleton: Skeleton | None = field(default=None, repr=False)
    gaits: tuple[str, ...] = GAITS
    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    meta: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def control_points(self) -> int:
        """K, control points of each weight."""
        return len(self.weights[0])

    def trained(self, channel: str) -> tuple[str, ...]:
        """Labels of a channel's columns that were told something in training, as the means of their inputs
        tell.

        All where none tells; () for a channel that the network is not told.
        """
        labels = self.channels.get(channel, ())
        means = self.x_mean[self.layout.x_channel(channel)] if labels else ()
        return tuple(label for label, mean in zip(labels, means, strict=True) if mean > 0) or labels

    @property
    def links(self) -> tuple[str, ...]:
        """Labels of the injury channel."""
        return self.channels.get("injury", ())

    @property
    def hurt_links(self) -> tuple[str, ...]:
        """Links that were hurt in training; see `trained`."""
        return self.trained("injury")

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the input first: (342, 512, 512, 311)."""
        return (self.weights[0].shape[2], *(w.shape[1] for w in self.weights))

    @property
    def parameters(self) -> int:
        """Weights and biases of one phase: sum of n_l n_(l+1) + n_(l+1)."""
        return sum(a * b + b for a, b in zip(self.sizes, self.sizes[1:], strict=False))


def read_skeleton(path: str | Path) -> Skeleton:
    """The skeleton of a file of config/skeletons. Raises InputError where it is none."""
    data = read_yaml(path)
    try:
        keys = {key: value for key, value in data.items() if key != "maps"}
        return Skeleton.from_dict({"name": Path(path).stem, **keys})
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"is no skeleton: {type(error).__name__} {error}") from None


def load_network(path: str | Path, skeleton: Skeleton | str | Path | None = None) -> Network:
    """Read weights.npz, a folder that holds one, or a folder of the original release's .bin files.

    skeleton: for files that carry none (the original release's); it, or a file of config/skeletons.
    Raises InputError where something is missing, damaged, not finite or of shapes that do not fit.
    """
    path = Path(path)
    if isinstance(skeleton, str | Path):
        skeleton = read_skeleton(skeleton)
    if path.is_dir():
        if (path / "weights.npz").exists():
            return load_network(path / "weights.npz", skeleton)
        from hobble.runtime.release import read_release

        if not any(path.glob("*.bin")):
            raise InputError(
                path,
                "holds no weights.npz, and no Xmean.bin, W0_000.bin, ...: not a network",
                fix="Train one (snakemake results/<configuration>/network/weights.npz), or name its folder.",
            )
        return network_from_arrays(path, read_release(path), skeleton)
    return network_from_arrays(path, load_npz(path), skeleton)


def network_from_arrays(
    path: str | Path, arrays: Mapping[str, Any], skeleton: Skeleton | None = None
) -> Network:
    """Check the arrays W0, b0, ..., Xmean, ... and `meta` of a file named `path` and build the network."""
    layers = sum(1 for name in arrays if name.startswith("W") and name[1:].isdigit())
    needed = [f"{k}{i}" for i in range(layers) for k in "Wb"] + list(STATISTICS)
    missing = [name for name in needed if name not in arrays]
    if not layers or missing:
        raise InputError(path, f"not a network: no {', '.join(missing or ['W0'])}")
    weights = tuple(np.asarray(arrays[f"W{i}"], np.float32) for i in range(layers))
    biases = tuple(np.asarray(arrays[f"b{i}"], np.float32) for i in range(layers))
    statistics = [np.asarray(arrays[name], np.float32).reshape(-1) for name in STATISTICS]
    _check(path, weights, biases, statistics)
    meta = json.loads(str(arrays["meta"])) if "meta" in arrays else {}
    x_size, y_size = len(statistics[0]), len(statistics[2])
    layout = _layout(path, meta["layout"]) if meta.get("layout") else _guess_layout(x_size, y_size, skeleton)
    if (layout.x_size, layout.y_size) != (x_size, y_size):
        raise InputError(path, f"{x_size} inputs and {y_size} outputs do not fit {layout}")
    if meta.get("skeleton"):
        skeleton = Skeleton.from_dict(meta["skeleton"])
    if skeleton is not None and len(skeleton.joints) != layout.joints:
        raise InputError(
            path, f"{layout.joints} joints, but skeleton {skeleton.name} has {len(skeleton.joints)}"
        )
    channels = {name: _labels(path, name, columns, meta, skeleton) for name, columns in layout.channels}
    gaits = tuple(meta.get("gaits") or GAITS)
    x_mean, x_std, y_mean, y_std = statistics
    return Network(weights, biases, x_mean, x_std, y_mean, y_std, layout, skeleton, gaits, channels, meta)


def _check(path: str | Path, weights: Any, biases: Any, statistics: list[Array]) -> None:
    points = len(weights[0])
    size = len(statistics[0])
    for i, (w, b) in enumerate(zip(weights, biases, strict=True)):
        if w.ndim != 3 or w.shape[0] != points or w.shape[2] != size or b.shape != w.shape[:2]:
            raise InputError(path, f"W{i} {w.shape} and b{i} {b.shape} do not follow a layer of {size} units")
        size = w.shape[1]
    if points < 4:
        raise InputError(path, f"{points} control points; a cyclic cubic needs 4 or more")
    if size != len(statistics[2]) or statistics[0].shape != statistics[1].shape:
        raise InputError(path, "the statistics do not fit the layers")
    for a in (*weights, *biases, *statistics):
        if not np.all(np.isfinite(a)):
            raise InputError(path, "weights that are not finite numbers", fix="The training diverged.")


def _layout(path: str | Path, data: Mapping[str, Any]) -> RowLayout:
    try:
        return RowLayout.from_dict(data)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(path, f"its layout cannot be understood ({error})") from None


def _labels(
    path: str | Path, name: str, columns: int, meta: Mapping[str, Any], skeleton: Skeleton | None
) -> tuple[str, ...]:
    """The labels of a channel, by the file, else by the skeleton. Raises InputError where they do not fit."""
    if name not in NAMES:
        raise InputError(path, f"is told {name!r:.80}, a channel that is not here: {', '.join(NAMES)}")
    said = dict(meta.get("channels", {})).get(name) or next(
        (meta[key] for key in channel(name).former if meta.get(key)), None
    )
    if said is None and skeleton is not None:
        said = channel(name).columns(skeleton)
    labels = tuple(str(label) for label in said or ())
    if len(labels) != columns:
        raise InputError(path, f"{columns} inputs of channel {name}, but {len(labels)} are named")
    return labels


def _guess_layout(x_size: int, y_size: int, skeleton: Skeleton | None) -> RowLayout:
    """The layout of a file without one: the default window, joints from Y, and what X has left is of the
    first channel with so many columns."""
    joints = (y_size - RowLayout(0).y_size) // 9
    left = x_size - RowLayout(joints).x_size
    if left <= 0:
        return RowLayout(joints)
    fitting = (one.name for one in every() if skeleton is None or len(one.columns(skeleton)) == left)
    return RowLayout(joints, channels=((next(fitting, NAMES[0]), left),))


def catmull_rom(phase: Array, points: int) -> tuple[np.ndarray, Array]:
    """The four control points of a cyclic cubic spline at `phase` (...) in cycles, and their coefficients.

    Returns indices (..., 4) and coefficients (..., 4) in float64 (Holden et al. 2017, eq. 7).
    """
    scaled = np.mod(np.asarray(phase, float), 1.0) * points
    first = np.floor(scaled).astype(int)
    t = (scaled - first)[..., None]
    indices = (first[..., None] + np.arange(-1, 3)) % points
    return indices, t ** np.arange(4) @ CATMULL_ROM.T


def weights_at(points: Array, phase: Array) -> Array:
    """Control points (K, ...) blended at phases (P,): (P, ...) float64."""
    return np.tensordot(basis(phase, len(points)), points.astype(float), 1)


def basis(phase: Array, points: int) -> Array:
    """(P, points) the share of every control point at phases (P,)."""
    indices, coefficients = catmull_rom(np.atleast_1d(phase), points)
    table = np.zeros((len(indices), points))
    np.add.at(table, (np.arange(len(indices))[:, None], indices), coefficients)
    return table
