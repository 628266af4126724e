"""Reads a network of any kind from disk and checks it.

A network's file (weights.npz) holds arrays and `meta`, a text in JSON with the network's kind, columns,
skeleton and so on. A file may come from anywhere, and compiled code uses its numbers as indices into memory
without checks. So the type, shape, count and range of everything in it are declared and checked before use.
Every error names the file.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from hobble.channels import CHANNEL_NAMES, channel
from hobble.channels.speed_limits import Limits
from hobble.core.declared import ArrayOf, check_arrays, read_declared
from hobble.core.errors import InputError
from hobble.core.files import load_npz, read_yaml
from hobble.core.quat import Array
from hobble.core.section import ShortName
from hobble.core.skeleton import NEEDED_ROLES, Skeleton, skeleton_from_data
from hobble.models import DEFAULT_KIND, NETWORK_KINDS, options_of_kind
from hobble.models.network import FACTS, TERRAIN_SIDE, Network, TrainingFacts
from hobble.rows.layout import GAITS, RowLayout, layout_from_data

MOST_LAYERS = 16  # in a network
# At most this many numbers in an array: 256 MB as float32. The largest array of known networks has 3 million.
MOST_NUMBERS = 1 << 26
LARGEST_WEIGHT = 1e6  # trained weights are below 10
LARGEST_MEAN = 1e9
LARGEST_STD = 1e20  # so large because the std of a joint that the network shall not see is multiplied by 1e11
# Name of an array in a file -> field of `hobble.models.network.Network`.
STATISTICS = {"Xmean": "x_mean", "Xstd": "x_std", "Ymean": "y_mean", "Ystd": "y_std"}
DIVERGED = "The training diverged, or the file is damaged."
LONGEST_META = 1 << 22  # characters
LARGEST_SIDE = 1e4  # cm; of `terrain_side`, the distance from the path to the ground points at its sides
LARGEST_Y = 1e9  # of the prediction for the mean input; a working network predicts values below 1000


def _all_different(names: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(names)) != len(names):
        raise ValueError("a name comes twice")
    return names


def _are_the_gaits(names: tuple[str, ...]) -> tuple[str, ...]:
    if sorted(names) != sorted(GAITS):
        raise ValueError(f"must be {', '.join(GAITS)}, in any order")
    return names


Names = Annotated[tuple[ShortName, ...], Field(max_length=4096), AfterValidator(_all_different)]


class Meta(BaseModel):
    """The part of `meta` that all kinds read. Their own entries are kept beside it."""

    model_config = ConfigDict(extra="allow")

    kind: Literal[NETWORK_KINDS] = DEFAULT_KIND  # type: ignore[valid-type]
    layout: dict[str, Any] | None = None
    skeleton: dict[str, Any] | None = None
    gaits: Annotated[Names, AfterValidator(_are_the_gaits)] = GAITS
    channels: dict[str, Names] = {}
    exponents: dict[str, Annotated[float, Field(ge=0.1, le=10)]] = {}
    limits: dict[str, dict[str, Any]] = {}
    terrain_side: Annotated[float, Field(strict=True, gt=0, le=LARGEST_SIDE)] = TERRAIN_SIDE


def read_skeleton(path: str | Path) -> Skeleton:
    """The skeleton in a file of config/skeletons. Raises InputError if the skeleton is not valid."""
    data = read_declared(path, "a skeleton", dict, read_yaml(path))
    return skeleton_from_data(path, {"name": Path(path).stem, **data}, NEEDED_ROLES)


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
        problem = "not a network: it holds neither weights.npz nor Xmean.bin, W0_000.bin, ..."
        raise InputError(path, problem, fix="Train one, or pass the folder of a trained network.")
    return network_from_arrays(path, load_npz(path), skeleton)


def network_from_arrays(
    path: str | Path, arrays: Mapping[str, Any], skeleton: Skeleton | None = None
) -> Network:
    """Check the arrays and the `meta` of the file `path`, and build the network.

    skeleton: for a network whose `meta` has none.
    """
    raw = _read_meta(path, arrays)
    meta = read_declared(path, "meta", Meta, raw)
    statistics, facts = read_columns(path, arrays)
    layout = _read_layout(path, meta, len(statistics["x_mean"]), len(statistics["y_mean"]))
    if meta.skeleton:
        skeleton = skeleton_from_data(path, meta.skeleton, NEEDED_ROLES)
    if skeleton is not None and len(skeleton.joints) != layout.joints:
        other = f"skeleton {skeleton.name} has {len(skeleton.joints)}"
        raise InputError(path, f"has {layout.joints} joints, but {other}")
    labels = {name: meta.channels.get(name, ()) for name, _ in layout.channels}
    for name, columns in layout.channels:
        if len(labels[name]) != columns:
            raise InputError(path, f"channel {name} has {columns} columns, but {len(labels[name])} labels")
    shared_fields: dict[str, Any] = {
        **statistics,
        "layout": layout,
        "skeleton": skeleton,
        "gaits": meta.gaits,
        "channels": labels,
        "terrain_side": float(meta.terrain_side),
        "meta": raw,
        "training_facts": facts,
        "limits": _read_limits(path, meta, labels),
    }
    kind = options_of_kind(meta.kind)
    if kind.uses_local_phases != (layout.local_phases > 0):
        raise InputError(path, f"a network of kind {meta.kind} and {layout} do not fit: local phases")
    network = kind.network_class().read(path, arrays, shared_fields)
    _check_prediction(path, network)
    return network


def _read_meta(path: str | Path, arrays: Mapping[str, Any]) -> dict[str, Any]:
    """The file's `meta`; {} if the file has none."""
    if "meta" not in arrays:
        return {}
    check_arrays(path, arrays, {"meta": ArrayOf((), "U")})
    text = str(arrays["meta"])
    if len(text) > LONGEST_META:
        raise InputError(path, f"meta has {len(text)} characters; at most {LONGEST_META} are allowed")
    try:
        return dict(read_declared(path, "meta", dict, json.loads(text)))
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"meta is not valid JSON: {error}") from None


def _read_layout(path: str | Path, meta: Meta, x_size: int, y_size: int) -> RowLayout:
    """The layout of the columns of X and Y. A file that has none gets the default window and no channels.

    x_size, y_size: number of columns of X and Y in the file. Raises InputError if the layout has other sizes.
    """
    if meta.layout is None:  # in Y, a joint has three columns each for position, velocity and rotation
        layout = RowLayout(max(1, (y_size - RowLayout(0).y_size) // 9))
    else:
        layout = layout_from_data(path, meta.layout)
    if unknown := [name for name, _ in layout.channels if name not in CHANNEL_NAMES]:
        known = ", ".join(CHANNEL_NAMES)
        raise InputError(path, f"has the unknown channel {unknown[0]!a:.40}; known channels: {known}")
    if (layout.x_size, layout.y_size) != (x_size, y_size):
        has = f"which has {layout.x_size} inputs and {layout.y_size} outputs"
        raise InputError(path, f"{x_size} inputs and {y_size} outputs do not fit {layout}, {has}")
    return layout


def _read_limits(path: str | Path, meta: Meta, channels: Mapping[str, tuple[str, ...]]) -> dict[str, Limits]:
    """Channel -> its speed limits, for the channels that have limits. channels: channel -> labels."""
    limits = {}
    for name, table in meta.limits.items():
        if name not in channels:
            raise InputError(path, f"has limits of {name!a:.40}, which is not one of its channels")
        sizes = len(meta.gaits), len(channels[name])
        limits[name] = Limits.from_dict(path, name, table, *sizes, channel(name).highest)
    return limits


def _check_prediction(path: str | Path, network: Network) -> None:
    """Raise InputError if the network predicts infinite or very large numbers for its mean input.

    Eight phases are tried. A sum over weights may overflow although each weight is in its range.
    """
    phase = np.arange(8) / 8
    with np.errstate(all="ignore"):
        y = network.predict(np.repeat(network.x_mean[None], len(phase), axis=0), phase)
    if not np.all(np.abs(y) < LARGEST_Y):
        raise InputError(path, "does not predict a finite pose for its mean input", fix=DIVERGED)


def read_arrays(
    path: str | Path,
    arrays: Mapping[str, Any],
    declared: Mapping[str, ArrayOf],
    lengths: Mapping[str, int] | None = None,
) -> tuple[dict[str, Any], dict[str, int]]:
    """The declared arrays, none of them empty, and the lengths of their axes; see `check_arrays`.

    Numbers become float32, and whole numbers int64 where the declaration allows no others.
    """
    known = check_arrays(path, arrays, declared, lengths, DIVERGED)
    found = {}
    for name, wanted in declared.items():
        array = np.asarray(arrays[name])
        if not 0 < array.size <= MOST_NUMBERS:
            problem = f"{name} has shape {array.shape}: {array.size} numbers; 1 to {MOST_NUMBERS} are allowed"
            raise InputError(path, problem)
        found[name] = np.ascontiguousarray(array, np.float32 if "f" in wanted.kinds else np.int64)
    return found, known


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
    weight, bias = prefixes[0], prefixes[1]
    count = sum(1 for name in arrays if re.fullmatch(rf"{weight}\d{{1,4}}", name))
    if not 0 < count <= MOST_LAYERS:
        layers = f"{count} layers {weight}0, {weight}1, ..."
        raise InputError(path, f"has {layers}; 1 to {MOST_LAYERS} are allowed")
    units: list[int | str] = [inputs, *(f"units of {weight}{i}" for i in range(count - 1)), outputs]
    sets = (set_word,) if set_word else ()
    declared = {}
    for i in range(count):
        for prefix, shape in ((weight, (*sets, units[i + 1], units[i])), (bias, (*sets, units[i + 1]))):
            declared[f"{prefix}{i}"] = ArrayOf(shape, "fiu", -LARGEST_WEIGHT, LARGEST_WEIGHT)
    found, known = read_arrays(path, arrays, declared)
    least, most = set_range
    if set_word and not least <= known[set_word] <= most:
        raise InputError(path, f"has {known[set_word]} {set_word}; {least} to {most} are allowed")
    both = [[found[f"{prefix}{i}"] for i in range(count)] for prefix in prefixes]
    weights, biases = (tuple(array if set_word else array[None] for array in each) for each in both)
    return weights, biases


def read_columns(
    path: str | Path, arrays: Mapping[str, Any]
) -> tuple[dict[str, Array], TrainingFacts | None]:
    """What a file says about each column of X and Y.

    Returns the means and standard deviations, by field of `Network`: x_mean and x_std, each (X,), y_mean and
    y_std, each (Y,). Then the facts about the training rows; None if the file has none, like that of Holden
    et al. (2017). Raises InputError for numbers that cannot be used.
    """
    numbers = dict.fromkeys(("start_phase", "fastest"), ArrayOf((), low=0, high=1e6))
    has_facts = any(name in arrays for name in (*FACTS, *numbers))
    declared = {}
    for name, key in (STATISTICS | FACTS if has_facts else STATISTICS).items():
        low, high = (0.0, LARGEST_STD) if name.endswith("std") else (-LARGEST_MEAN, LARGEST_MEAN)
        declared[name] = ArrayOf(("X" if "x" in key else "Y",), "fiu", low, high)
    found, _ = read_arrays(path, arrays, declared)
    statistics = {key: found[name] for name, key in STATISTICS.items()}
    if not has_facts:
        return statistics, None
    check_arrays(path, arrays, numbers)
    for block in "XY":
        if (found[f"{block}low"] > found[f"{block}high"]).any():
            raise InputError(path, f"{block}low is above {block}high in at least one column")
    facts: dict[str, Any] = {key: found[name] for name, key in FACTS.items()}
    facts |= {name: float(arrays[name]) for name in numbers}
    return statistics, TrainingFacts(**facts)
