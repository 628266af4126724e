"""Reads a network of any kind from disk and checks it.

A network's file (weights.npz) holds arrays and `meta`, a text in JSON with the network's kind, columns,
skeleton and so on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import CHANNEL_NAMES, all_channels, channel
from hobble.channels.speed_limits import Limits
from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.skeleton import Skeleton
from hobble.core.untrusted import read_yaml
from hobble.models import DEFAULT_KIND, NETWORK_KINDS, checks, model_of_kind
from hobble.models.network import TERRAIN_SIDE, Network
from hobble.models.training_facts import TrainingFacts
from hobble.rows.layout import GAITS, RowLayout

LONGEST_META = 1 << 22  # characters
LARGEST_SIDE = 1e4  # cm; of `terrain_side`, the distance from the path to the ground points at its sides
LARGEST_Y = 1e9  # of the prediction for the mean input; a working network predicts values below 1000


def read_skeleton(path: str | Path) -> Skeleton:
    """The skeleton in a file of config/skeletons. Raises InputError if the skeleton is not valid."""
    data = checks.require_mapping(path, "a skeleton", read_yaml(path))
    keys = {key: value for key, value in data.items() if key != "maps"}
    return checks.skeleton_from_data(path, {"name": Path(path).stem, **keys})


def load_network(path: str | Path, skeleton: Skeleton | str | Path | None = None) -> Network:
    """Read a network.

    path: weights.npz, its folder, or a folder with the .bin files that Holden et al. (2017) released.
    skeleton: a Skeleton or a file of config/skeletons. It is used if the network has none; the network of
    Holden et al. has none. Raises InputError if something is missing, damaged, not finite, out of range or of
    the wrong shape.
    """
    path = Path(path)
    if isinstance(skeleton, str | Path):
        skeleton = read_skeleton(skeleton)
    if path.is_dir():
        if (path / "weights.npz").exists():
            return load_network(path / "weights.npz", skeleton)
        for kind in NETWORK_KINDS:
            if (arrays := model_of_kind(kind).read_folder(path)) is not None:
                return network_from_arrays(path, arrays, skeleton)
        raise InputError(
            path,
            "not a network: it holds neither weights.npz nor Xmean.bin, W0_000.bin, ...",
            fix="Train one (snakemake results/<configuration>/network/weights.npz), "
            "or pass the folder of a trained network.",
        )
    return network_from_arrays(path, load_npz(path), skeleton)


def network_from_arrays(
    path: str | Path, arrays: Mapping[str, Any], skeleton: Skeleton | None = None
) -> Network:
    """Check the arrays and the `meta` of the file `path`, and build the network.

    skeleton: for a network whose `meta` has none.
    """
    meta = _read_meta(path, arrays)
    kind = meta.get("kind", DEFAULT_KIND)
    if kind not in NETWORK_KINDS:
        raise InputError(path, f"is a network of kind {kind!a:.40}; known kinds: {', '.join(NETWORK_KINDS)}")
    statistics = checks.read_statistics(path, arrays)
    layout = _read_layout(path, meta, len(statistics["x_mean"]), len(statistics["y_mean"]), skeleton)
    if meta.get("skeleton"):
        skeleton = checks.skeleton_from_data(path, meta["skeleton"])
    if skeleton is not None and len(skeleton.joints) != layout.joints:
        raise InputError(
            path, f"has {layout.joints} joints, but skeleton {skeleton.name} has {len(skeleton.joints)}"
        )
    shared_fields: dict[str, Any] = {
        **statistics,
        "layout": layout,
        "skeleton": skeleton,
        "gaits": _read_gaits(path, meta),
        "channels": {name: _read_labels(path, name, meta, layout, skeleton) for name, _ in layout.channels},
        "terrain_side": checks.require_number_in_range(
            path, "terrain_side", meta.get("terrain_side", TERRAIN_SIDE), LARGEST_SIDE
        ),
        "meta": meta,
        "training_facts": TrainingFacts.read(path, arrays, layout.x_size, layout.y_size),
    }
    shared_fields["limits"] = _read_limits(path, meta, shared_fields["channels"], len(shared_fields["gaits"]))
    network = model_of_kind(kind).read(path, arrays, shared_fields)
    _check_prediction(path, network)
    return network


def _read_meta(path: str | Path, arrays: Mapping[str, Any]) -> dict[str, Any]:
    """The file's `meta`; {} if the file has none."""
    if "meta" not in arrays:
        return {}
    array = np.asarray(arrays["meta"])
    if array.shape != () or array.dtype.kind != "U":
        raise InputError(path, f"meta has shape {array.shape} and type {array.dtype}, but is not one text")
    text = str(array)
    if len(text) > LONGEST_META:
        raise InputError(path, f"meta has {len(text)} characters; at most {LONGEST_META} are allowed")
    try:
        return checks.require_mapping(path, "meta", json.loads(text))
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"meta is not valid JSON: {error}") from None


def _read_layout(
    path: str | Path, meta: Mapping[str, Any], x_size: int, y_size: int, skeleton: Skeleton | None
) -> RowLayout:
    """The layout of the columns of X and Y, from `meta` or else guessed by `_guess_layout`.

    x_size, y_size: number of columns of X and Y in the file. Raises InputError if the layout has other sizes.
    """
    if "layout" not in meta:
        layout = _guess_layout(x_size, y_size, skeleton)
    else:
        values = checks.require_mapping(path, "layout", meta["layout"])
        ranges = {"joints": (1, y_size), "window": (1, x_size), "step": (1, x_size)}
        if not set(ranges) <= set(values):
            keys = ", ".join(map(ascii, values))[:80]
            raise InputError(path, f"layout has the keys {keys}; it needs {', '.join(ranges)}")
        for key, (least, most) in ranges.items():
            checks.require_whole_number(path, f"layout.{key}", values[key], least, most)
        if values["window"] % values["step"]:
            raise InputError(
                path, f"layout: the window {values['window']} is not a multiple of the step {values['step']}"
            )
        try:
            layout = RowLayout.from_dict(values)
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise InputError(path, f"its layout cannot be understood: {error}") from None
        for name, columns in layout.channels:
            if name not in CHANNEL_NAMES:
                raise InputError(
                    path, f"has the unknown channel {name!a:.40}; known channels: {', '.join(CHANNEL_NAMES)}"
                )
            checks.require_whole_number(path, f"layout.channels.{name}", columns, 0, x_size)
    if (layout.x_size, layout.y_size) != (x_size, y_size):
        raise InputError(
            path,
            f"{x_size} inputs and {y_size} outputs do not fit {layout}, "
            f"which has {layout.x_size} inputs and {layout.y_size} outputs",
        )
    return layout


def _guess_layout(x_size: int, y_size: int, skeleton: Skeleton | None) -> RowLayout:
    """The layout for a file that has none: the default window, and as many joints as fit the size of Y.

    Columns of X that are left over are taken for a channel. It is the first channel that has as many columns
    for `skeleton`, or else the first of all channels.
    """
    # In Y, a joint has three columns each for position, velocity and rotation.
    joints = max(1, (y_size - RowLayout(0).y_size) // 9)
    left_over = x_size - RowLayout(joints).x_size
    if left_over <= 0:
        return RowLayout(joints)
    fitting = (
        one.name for one in all_channels() if skeleton is not None and len(one.columns(skeleton)) == left_over
    )
    return RowLayout(joints, channels=((next(fitting, CHANNEL_NAMES[0]), left_over),))


def _read_gaits(path: str | Path, meta: Mapping[str, Any]) -> tuple[str, ...]:
    """The names of all gaits, in the order of their columns in X."""
    gaits = checks.require_names(path, "gaits", meta.get("gaits", GAITS))
    if sorted(gaits) != sorted(GAITS):
        raise InputError(path, f"gaits must be {', '.join(GAITS)}, in any order")
    return gaits


def _read_labels(
    path: str | Path, name: str, meta: Mapping[str, Any], layout: RowLayout, skeleton: Skeleton | None
) -> tuple[str, ...]:
    """The labels of the columns of channel `name`, from the file or else from the skeleton.

    Raises InputError unless there is one label for each column.
    """
    found = checks.require_mapping(path, "channels", meta.get("channels", {})).get(name)
    # Older files have the labels under other keys.
    found = found or next((meta[key] for key in channel(name).old_keys if meta.get(key)), None)
    if found is None and skeleton is not None:
        found = channel(name).columns(skeleton)
    labels, columns = checks.require_names(path, f"channel {name}", found or ()), dict(layout.channels)[name]
    if len(labels) != columns:
        raise InputError(path, f"channel {name} has {columns} columns, but {len(labels)} labels")
    return labels


def _read_limits(
    path: str | Path, meta: Mapping[str, Any], channels: Mapping[str, tuple[str, ...]], gaits: int
) -> dict[str, Limits]:
    """Channel -> its speed limits, for the channels that have limits in the file.

    channels: channel -> labels of its columns. gaits: number of gaits.
    """
    limits = {}
    for name, value in checks.require_mapping(path, "limits", meta.get("limits", {})).items():
        if name not in channels:
            raise InputError(path, f"has limits of {name!a:.40}, which is not one of its channels")
        table = checks.require_mapping(path, f"limits of {name}", value)
        try:
            limits[name] = Limits.from_dict(table, gaits, len(channels[name]), channel(name).highest)
        except ValueError as error:
            raise InputError(path, f"limits of {name}: {error}") from None
    return limits


def _check_prediction(path: str | Path, network: Network) -> None:
    """Raise InputError if the network predicts infinite or very large numbers for its mean input.

    Eight phases are tried. A sum over weights may overflow although each weight passes the checks.
    """
    phase = np.arange(8) / 8
    with np.errstate(all="ignore"):
        y = network.predict(np.repeat(network.x_mean[None], len(phase), axis=0), phase)
    if not np.all(np.abs(y) < LARGEST_Y):
        raise InputError(path, "does not predict a finite pose for its mean input", fix=checks.DIVERGED)
