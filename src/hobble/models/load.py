"""Reads a network of any kind from disk and checks it.

A network's file (weights.npz) holds arrays and `meta`, a text in JSON with the network's kind, columns,
skeleton and so on. A file may come from anywhere, and compiled code uses its numbers as indices into memory
without checks. So the type, shape, count and range of everything in it are checked here before use. Every
error names the file. The kinds read their arrays with the functions here that have no underscore.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import CHANNEL_NAMES, all_channels, channel
from hobble.channels.speed_limits import Limits
from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.untrusted import read_yaml
from hobble.models import DEFAULT_KIND, NETWORK_KINDS, options_of_kind
from hobble.models.network import FACTS, TERRAIN_SIDE, Network, TrainingFacts
from hobble.rows.layout import GAITS, RowLayout

MOST_LAYERS = 16  # in a network
# At most this many numbers in an array: 256 MB as float32. The largest array of known networks has 3 million.
MOST_NUMBERS = 1 << 26
LARGEST_WEIGHT = 1e6  # trained weights are below 10
LARGEST_MEAN = 1e9
LARGEST_STD = 1e20  # so large because the std of a joint that the network shall not see is multiplied by 1e11
MOST_NAMES = 4096  # in one list
LONGEST_NAME = 200  # characters
FARTHEST = 1e5  # cm; largest coordinate of a joint relative to its parent
# A skeleton's roles say which joint is the left knee and so on. These roles must have a joint.
NEEDED_ROLES = (
    "hips",
    *(f"{side}_{part}" for side in ("left", "right") for part in ("hip", "knee", "heel", "toe")),
)
# Name of an array in a file -> field of `hobble.models.network.Network`.
STATISTICS = {"Xmean": "x_mean", "Xstd": "x_std", "Ymean": "y_mean", "Ystd": "y_std"}
DIVERGED = "The training diverged, or the file is damaged."
LONGEST_META = 1 << 22  # characters
LARGEST_SIDE = 1e4  # cm; of `terrain_side`, the distance from the path to the ground points at its sides
LARGEST_Y = 1e9  # of the prediction for the mean input; a working network predicts values below 1000


def read_skeleton(path: str | Path) -> Skeleton:
    """The skeleton in a file of config/skeletons. Raises InputError if the skeleton is not valid."""
    data = require_mapping(path, "a skeleton", read_yaml(path))
    keys = {key: value for key, value in data.items() if key != "maps"}
    return skeleton_from_data(path, {"name": Path(path).stem, **keys})


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
            if (arrays := options_of_kind(kind).network_class().read_folder(path)) is not None:
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
    statistics = read_statistics(path, arrays)
    layout = _read_layout(path, meta, len(statistics["x_mean"]), len(statistics["y_mean"]), skeleton)
    if meta.get("skeleton"):
        skeleton = skeleton_from_data(path, meta["skeleton"])
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
        "terrain_side": require_number_in_range(
            path, "terrain_side", meta.get("terrain_side", TERRAIN_SIDE), LARGEST_SIDE
        ),
        "meta": meta,
        "training_facts": read_facts(path, arrays, layout.x_size, layout.y_size),
    }
    shared_fields["limits"] = _read_limits(path, meta, shared_fields["channels"], len(shared_fields["gaits"]))
    network = options_of_kind(kind).network_class().read(path, arrays, shared_fields)
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
        return require_mapping(path, "meta", json.loads(text))
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
        values = require_mapping(path, "layout", meta["layout"])
        ranges = {"joints": (1, y_size), "window": (1, x_size), "step": (1, x_size)}
        if not set(ranges) <= set(values):
            keys = ", ".join(map(ascii, values))[:80]
            raise InputError(path, f"layout has the keys {keys}; it needs {', '.join(ranges)}")
        for key, (least, most) in ranges.items():
            require_whole_number(path, f"layout.{key}", values[key], least, most)
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
            require_whole_number(path, f"layout.channels.{name}", columns, 0, x_size)
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
    gaits = require_names(path, "gaits", meta.get("gaits", GAITS))
    if sorted(gaits) != sorted(GAITS):
        raise InputError(path, f"gaits must be {', '.join(GAITS)}, in any order")
    return gaits


def _read_labels(
    path: str | Path, name: str, meta: Mapping[str, Any], layout: RowLayout, skeleton: Skeleton | None
) -> tuple[str, ...]:
    """The labels of the columns of channel `name`, from the file or else from the skeleton.

    Raises InputError unless there is one label for each column.
    """
    found = require_mapping(path, "channels", meta.get("channels", {})).get(name)
    # Older files have the labels under other keys.
    found = found or next((meta[key] for key in channel(name).old_keys if meta.get(key)), None)
    if found is None and skeleton is not None:
        found = channel(name).columns(skeleton)
    labels, columns = require_names(path, f"channel {name}", found or ()), dict(layout.channels)[name]
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
    for name, value in require_mapping(path, "limits", meta.get("limits", {})).items():
        if name not in channels:
            raise InputError(path, f"has limits of {name!a:.40}, which is not one of its channels")
        table = require_mapping(path, f"limits of {name}", value)
        try:
            limits[name] = Limits.from_dict(table, gaits, len(channels[name]), channel(name).highest)
        except ValueError as error:
            raise InputError(path, f"limits of {name}: {error}") from None
    return limits


def _check_prediction(path: str | Path, network: Network) -> None:
    """Raise InputError if the network predicts infinite or very large numbers for its mean input.

    Eight phases are tried. A sum over weights may overflow although each weight passes the
    """
    phase = np.arange(8) / 8
    with np.errstate(all="ignore"):
        y = network.predict(np.repeat(network.x_mean[None], len(phase), axis=0), phase)
    if not np.all(np.abs(y) < LARGEST_Y):
        raise InputError(path, "does not predict a finite pose for its mean input", fix=DIVERGED)


def read_facts(path: str | Path, arrays: Mapping[str, Any], x_size: int, y_size: int) -> TrainingFacts | None:
    """The facts about the training data. None if the file has none, like that of Holden et al. (2017).

    x_size, y_size: numbers of columns of X and Y. Raises InputError for facts that cannot be used.
    """
    numbers = ("start_phase", "fastest")
    if not any(name in arrays for name in (*FACTS, *numbers)):
        return None
    found: dict[str, Any] = {}
    for name, key in FACTS.items():
        found[key] = read_numbers(path, arrays, name, 1, LARGEST_MEAN)
        block, size = ("X", x_size) if key in ("x_low", "x_high", "start_x") else ("Y", y_size)
        if len(found[key]) != size:
            raise InputError(path, f"{name} has {len(found[key])} numbers, but {block} has {size} columns")
    for name in numbers:
        array = np.asarray(arrays.get(name))
        if array.shape != () or array.dtype.kind != "f":
            raise InputError(path, f"{name} is missing or is not one floating-point number")
        found[name] = require_number_in_range(path, name, float(array), 1e6, -1e-9)
    for block in "xy":
        if (found[f"{block}_low"] > found[f"{block}_high"]).any():
            name = block.upper()
            raise InputError(path, f"{name}low is above {name}high in at least one column")
    return TrainingFacts(**found)


def read_numbers(
    path: str | Path, arrays: Mapping[str, Any], name: str, axes: int, largest: float = LARGEST_WEIGHT
) -> Array:
    """The array `name` as float32. It must have `axes` axes and must not be empty.

    Its numbers must be finite, with no absolute value above `largest`.
    """
    if name not in arrays:
        raise InputError(path, f"not a network: no {name}")
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "fiu" or array.ndim != axes or not array.size:
        raise InputError(
            path, f"{name} has shape {array.shape} and type {array.dtype}, expected numbers with {axes} axes"
        )
    if array.size > MOST_NUMBERS:
        raise InputError(path, f"{name} holds {array.size} numbers; at most {MOST_NUMBERS} are allowed")
    # No float64 copy is made of the array: a copy of an array of bytes would be eight times as large.
    extreme = max(float(array.max()), -float(array.min()))
    if not np.isfinite(extreme):
        raise InputError(path, f"{name} holds numbers that are not finite", fix=DIVERGED)
    if extreme > largest:
        raise InputError(
            path,
            f"{name} holds a number of magnitude {extreme:.3g}, above the limit of {largest:g}",
            fix=DIVERGED,
        )
    return np.ascontiguousarray(array, np.float32)


def count_layers(path: str | Path, arrays: Mapping[str, Any], *prefixes: str) -> int:
    """The number of layers. Each layer must have one array for every prefix.

    For the prefixes "W" and "b" these are W0 and b0, then W1 and b1, and so on.
    """
    found = {name for name in arrays if re.fullmatch(rf"{prefixes[0]}\d{{1,4}}", name)}
    if not found:
        raise InputError(path, f"not a network: no {prefixes[0]}0")
    if len(found) > MOST_LAYERS:
        raise InputError(path, f"has {len(found)} layers; at most {MOST_LAYERS} are allowed")
    missing = [f"{p}{i}" for i in range(len(found)) for p in prefixes if f"{p}{i}" not in arrays]
    if missing:
        raise InputError(path, f"not a network: no {', '.join(missing)}")
    return len(found)


def read_layers(
    path: str | Path,
    arrays: Mapping[str, Any],
    prefixes: str,
    inputs: int,
    outputs: int,
    set_word: str = "",
    set_range: tuple[int, int] = (1, 1),
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The weights (K, out, in) of all layers and their biases (K, out). Each layer must fit the next.

    prefixes: of weights and biases, such as "Wb" for W0, b0, W1, ... inputs: number of inputs of the first
    layer. outputs: number of outputs of the last layer. set_word: what the file's sets of weights are called,
    such as "experts"; if it is empty, there is only one set, and the arrays in the file lack their first
    axis. set_range: fewest and most sets, K, of which all layers must have the same number.
    """
    count, axes = count_layers(path, arrays, *prefixes), 3 if set_word else 2
    weights = [read_numbers(path, arrays, f"{prefixes[0]}{i}", axes) for i in range(count)]
    biases = [read_numbers(path, arrays, f"{prefixes[1]}{i}", axes - 1) for i in range(count)]
    size, sets = inputs, weights[0].shape[:-2]
    for i, (w, b) in enumerate(zip(weights, biases, strict=True)):
        if w.shape[:-2] != sets or w.shape[-1] != size or b.shape != w.shape[:-1]:
            shapes = f"{prefixes[0]}{i} {w.shape} and {prefixes[1]}{i} {b.shape}"
            first = "".join(f"{length}, " for length in sets)
            raise InputError(path, f"{shapes} do not fit: expected ({first}units, {size}) and ({first}units)")
        size = w.shape[-2]
    if size != outputs:
        raise InputError(path, f"its last layer {prefixes[0]}{i} has {size} outputs, expected {outputs}")
    if not set_word:
        return tuple(w[None] for w in weights), tuple(b[None] for b in biases)
    if not set_range[0] <= sets[0] <= set_range[1]:
        least, most = set_range
        raise InputError(path, f"has {sets[0]} {set_word}; {least} to {most} are allowed")
    return tuple(weights), tuple(biases)


def read_statistics(path: str | Path, arrays: Mapping[str, Any]) -> dict[str, Array]:
    """The means and standard deviations of the inputs X and of the outputs Y.

    The keys are x_mean and x_std, each (X,), and y_mean and y_std, each (Y,).
    """
    found = {}
    for name, key in STATISTICS.items():
        is_std = key.endswith("std")
        found[key] = read_numbers(path, arrays, name, 1, LARGEST_STD if is_std else LARGEST_MEAN)
        if is_std and found[key].min() < 0:
            raise InputError(
                path, f"{name} holds {found[key].min():g}, but a standard deviation cannot be negative"
            )
    for block in "xy":
        mean, std = found[f"{block}_mean"], found[f"{block}_std"]
        if mean.shape != std.shape:
            raise InputError(
                path, f"{block.upper()}mean has {len(mean)} columns, but {block.upper()}std has {len(std)}"
            )
    return found


def require_names(path: str | Path, what: str, value: Any) -> tuple[str, ...]:
    """`value` as a tuple, if it is a list of short printable names, all different.

    what: in this and the following functions, the words for the value in an error message.
    """
    if not isinstance(value, Sequence) or isinstance(value, str | bytes) or len(value) > MOST_NAMES:
        raise InputError(path, f"{what} is {_abridged(value)}, not a list of at most {MOST_NAMES} names")
    for name in value:
        if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
            raise InputError(
                path,
                f"{what} holds {_abridged(name)}; a name has 1 to {LONGEST_NAME} printable characters",
            )
    if len(set(value)) != len(value):
        raise InputError(path, f"{what} holds a name twice")
    return tuple(value)


def require_whole_number(path: str | Path, what: str, value: Any, least: int, most: int) -> int:
    """`value`, if it is a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise InputError(path, f"{what} is {_abridged(value)}, not a whole number from {least} to {most}")
    return value


def require_number_in_range(
    path: str | Path, what: str, value: Any, most: float, least: float = 0.0
) -> float:
    """`value` as a float, if it is a finite number above `least` and up to `most`."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not least < value <= most:
        raise InputError(
            path, f"{what} is {_abridged(value)}, not a number above {least:g} and up to {most:g}"
        )
    return float(value)


def require_mapping(path: str | Path, what: str, value: Any) -> dict[str, Any]:
    """`value`, if it is a mapping (a dict)."""
    if not isinstance(value, dict):
        raise InputError(path, f"{what} is {_abridged(value)}, not keys and values")
    return value


def skeleton_from_data(path: str | Path, value: Any) -> Skeleton:
    """The skeleton that `value` describes in the format of `Skeleton.to_dict`.

    Each joint must come after its parent, and each of NEEDED_ROLES must have a joint.
    """
    data = require_mapping(path, "its skeleton", value)
    joints = require_mapping(path, "its skeleton's joints", data.get("joints"))
    require_names(path, "its skeleton's joints", list(joints))
    if not joints:
        raise InputError(path, "its skeleton has no joints")
    seen: set[str] = set()
    for joint, entry in joints.items():
        parent = require_mapping(path, f"joint {joint}", entry).get("parent")
        if (parent is None) != (not seen) or (parent is not None and not _is_one_of(parent, seen)):
            raise InputError(
                path,
                f"joint {joint}: its parent {_abridged(parent)} is not listed before it",
                fix="Only the first joint has no parent (null). List every other joint after its parent.",
            )
        _three_numbers(path, f"joint {joint}: its offset", entry.get("offset"))
        seen.add(joint)
    _check_named_joints(path, data, seen)
    return Skeleton.from_dict(
        {**data, "name": require_names(path, "its skeleton's name", [data.get("name")])[0]}
    )


def _check_named_joints(path: str | Path, data: Mapping[str, Any], joints: set[str]) -> None:
    """Check that the roles, links, end sites and unseen joints in `data` name joints of the skeleton.

    joints: the names of the skeleton's joints.
    """
    roles = require_mapping(path, "its skeleton's roles", data.get("roles"))
    if missing := [role for role in NEEDED_ROLES if role not in roles]:
        raise InputError(path, f"its skeleton has no joint for the roles {', '.join(missing)}")
    links = data.get("links", [])
    if not isinstance(links, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in links):
        raise InputError(path, f"its skeleton's links are {_abridged(links)}, not a list of pairs of joints")
    ends = require_mapping(path, "its skeleton's end sites", data.get("end_sites", {}))
    for joint, end in ends.items():
        _three_numbers(path, f"the end site of {_abridged(joint)}", end)
    unseen = require_names(path, "its skeleton's unseen joints", data.get("unseen", []))
    for name in (*roles.values(), *(joint for link in links for joint in link), *ends, *unseen):
        if not _is_one_of(name, joints):
            raise InputError(path, f"its skeleton names {_abridged(name)}, which is not one of its joints")


def _is_one_of(name: Any, joints: set[str]) -> bool:
    return isinstance(name, str) and name in joints


def _three_numbers(path: str | Path, what: str, value: Any) -> None:
    """Check that `value` is three finite numbers (cm), none farther from 0 than FARTHEST."""
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise InputError(path, f"{what} is {_abridged(value)}, not three numbers")
    for number in value:
        require_number_in_range(path, what, number, FARTHEST, -FARTHEST)


def _abridged(value: Any) -> str:
    """A value as one short printable line, for an error message."""
    if isinstance(value, list | tuple | dict) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    text = ascii(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
