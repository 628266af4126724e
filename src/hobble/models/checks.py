"""Checks of the arrays and the metadata of a network's file. Every error names the file.

A file may come from anywhere, and compiled code uses its numbers as indices into memory without checks. So
the type, shape, count and range of everything in it are checked here before use.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

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


def read_weights_and_biases(
    path: str | Path,
    arrays: Mapping[str, Any],
    prefixes: tuple[str, str],
    axes: int,
    inputs: int,
    outputs: int,
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The weights (..., out, in) of all layers and their biases (..., out). Each layer must fit the next.

    prefixes: of weights and biases, such as ("W", "b") for W0, b0, W1, ... axes: number of axes of the
    weights. If there are three, the first counts the sets of weights (the experts, or the control points over
    the phase) and must have the same length in all layers. inputs: number of inputs of the first layer.
    outputs: number of outputs of the last layer.
    """
    count = count_layers(path, arrays, *prefixes)
    weights = tuple(read_numbers(path, arrays, f"{prefixes[0]}{i}", axes) for i in range(count))
    biases = tuple(read_numbers(path, arrays, f"{prefixes[1]}{i}", axes - 1) for i in range(count))
    size, sets = inputs, weights[0].shape[:-2]
    for i, (w, b) in enumerate(zip(weights, biases, strict=True)):
        if w.shape[:-2] != sets or w.shape[-1] != size or b.shape != w.shape[:-1]:
            shapes = f"{prefixes[0]}{i} {w.shape} and {prefixes[1]}{i} {b.shape}"
            first = "".join(f"{length}, " for length in sets)
            raise InputError(path, f"{shapes} do not fit: expected ({first}units, {size}) and ({first}units)")
        size = w.shape[-2]
    if size != outputs:
        raise InputError(path, f"its last layer {prefixes[0]}{i} has {size} outputs, expected {outputs}")
    return weights, biases


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
