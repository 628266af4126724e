"""Checks of the arrays and the metadata of a network's file. Every error names the file.

A file may come from anywhere, and compiled code uses its numbers as indices into memory. So type, shape,
count and range of everything are checked here before use.
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

MOST_LAYERS = 16
# At most this many numbers in an array: 256 MB as float32. The largest array of known networks has 3 million.
MOST_NUMBERS = 1 << 26
LARGEST_WEIGHT = 1e6  # trained weights are below 10
LARGEST_MEAN = 1e9
LARGEST_STD = 1e20  # to leave a joint out of the input, its std is multiplied by 1e11
MOST_NAMES = 4096  # in one list
LONGEST_NAME = 200  # characters
FARTHEST = 1e5  # cm; largest coordinate of a joint relative to its parent
NEEDED_ROLES = ("hips", *(f"{s}_{p}" for s in ("left", "right") for p in ("hip", "knee", "heel", "toe")))
STATISTICS = {"Xmean": "x_mean", "Xstd": "x_std", "Ymean": "y_mean", "Ystd": "y_std"}
DIVERGED = "The training diverged, or the file is damaged."


def numbers(
    path: str | Path, arrays: Mapping[str, Any], name: str, axes: int, largest: float = LARGEST_WEIGHT
) -> Array:
    """The array `name` as float32: `axes` axes, not empty, finite, no absolute value above `largest`."""
    if name not in arrays:
        raise InputError(path, f"not a network: no {name}")
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "fiu" or array.ndim != axes or not array.size:
        raise InputError(
            path, f"{name} has shape {array.shape} and type {array.dtype}, expected numbers with {axes} axes"
        )
    if array.size > MOST_NUMBERS:
        raise InputError(path, f"{name} holds {array.size} numbers; at most {MOST_NUMBERS} are allowed")
    # No copy: for an array of bytes a float64 copy would be eight times as large.
    extreme = max(float(array.max()), -float(array.min()))
    if not np.isfinite(extreme):
        raise InputError(path, f"{name} holds numbers that are not finite", fix=DIVERGED)
    if extreme > largest:
        raise InputError(
            path, f"{name} holds {extreme:.3g}, which is above the limit of {largest:g}", fix=DIVERGED
        )
    return np.ascontiguousarray(array, np.float32)


def layers(path: str | Path, arrays: Mapping[str, Any], *prefixes: str) -> int:
    """The number of layers: how many arrays have the first prefix (W0, W1, ...).

    Raises InputError unless each layer has an array for every prefix.
    """
    found = {name for name in arrays if re.fullmatch(rf"{prefixes[0]}\d{{1,4}}", name)}
    if not found:
        raise InputError(path, f"not a network: no {prefixes[0]}0")
    if len(found) > MOST_LAYERS:
        raise InputError(path, f"{len(found)} layers; at most {MOST_LAYERS} are allowed")
    missing = [f"{k}{i}" for i in range(len(found)) for k in prefixes if f"{k}{i}" not in arrays]
    if missing:
        raise InputError(path, f"not a network: no {', '.join(missing)}")
    return len(found)


def stacked(
    path: str | Path, arrays: Mapping[str, Any], names: tuple[str, str], axes: int, inputs: int, outputs: int
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Weights (..., out, in) and biases (..., out) of consecutive layers, checked to fit one another.

    names: prefixes of weights and biases, ("W", "b") for W0, b0, W1, ... axes: number of axes of the weights;
    the lengths of all but the last two axes have to be equal in all layers. inputs: number of inputs of the
    first layer. outputs: number of outputs of the last layer.
    """
    count = layers(path, arrays, *names)
    weights = tuple(numbers(path, arrays, f"{names[0]}{i}", axes) for i in range(count))
    biases = tuple(numbers(path, arrays, f"{names[1]}{i}", axes - 1) for i in range(count))
    size, sets = inputs, weights[0].shape[:-2]
    for i, (w, b) in enumerate(zip(weights, biases, strict=True)):
        if w.shape[:-2] != sets or w.shape[-1] != size or b.shape != w.shape[:-1]:
            found = f"{names[0]}{i} {w.shape} and {names[1]}{i} {b.shape}"
            raise InputError(path, f"{found} do not fit the {size} units before them")
        size = w.shape[-2]
    if size != outputs:
        raise InputError(path, f"its last layer {names[0]}{i} has {size} units, but Y has {outputs} columns")
    return weights, biases


def statistics(path: str | Path, arrays: Mapping[str, Any]) -> dict[str, Array]:
    """x_mean, x_std (X,), y_mean, y_std (Y,): the numbers that standardise X and Y."""
    out = {}
    for name, key in STATISTICS.items():
        is_std = key.endswith("std")
        out[key] = numbers(path, arrays, name, 1, LARGEST_STD if is_std else LARGEST_MEAN)
        if is_std and out[key].min() < 0:
            raise InputError(
                path, f"{name} holds {out[key].min():g}, but a standard deviation cannot be negative"
            )
    for block in "xy":
        mean, std = out[f"{block}_mean"], out[f"{block}_std"]
        if mean.shape != std.shape:
            raise InputError(
                path, f"{block.upper()}mean has {len(mean)} columns and {block.upper()}std {len(std)}"
            )
    return out


def names(path: str | Path, what: str, value: Any) -> tuple[str, ...]:
    """`value` as a tuple of short names without duplicates."""
    if not isinstance(value, Sequence) or isinstance(value, str | bytes) or len(value) > MOST_NAMES:
        raise InputError(path, f"{what} is {_short(value)}, not a list of names")
    for name in value:
        if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
            raise InputError(path, f"{what} holds {_short(name)}, which is not a valid name")
    if len(set(value)) != len(value):
        raise InputError(path, f"{what} holds a name twice")
    return tuple(value)


def whole(path: str | Path, what: str, value: Any, least: int, most: int) -> int:
    """`value`, if it is a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise InputError(path, f"{what} is {_short(value)}, not a whole number from {least} to {most}")
    return value


def length(path: str | Path, what: str, value: Any, most: float, least: float = 0.0) -> float:
    """`value`, if it is a finite number above `least` and up to `most`."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not least < value <= most:
        raise InputError(path, f"{what} is {_short(value)}, not a number above {least:g} and up to {most:g}")
    return float(value)


def mapping(path: str | Path, what: str, value: Any) -> dict[str, Any]:
    """`value`, if it is a mapping."""
    if not isinstance(value, dict):
        raise InputError(path, f"{what} is {_short(value)}, not keys and values")
    return value


def skeleton(path: str | Path, value: Any) -> Skeleton:
    """The skeleton of a file (the format of `Skeleton.to_dict`), with the roles that a character needs."""
    data = mapping(path, "its skeleton", value)
    joints = mapping(path, "its skeleton's joints", data.get("joints"))
    names(path, "its skeleton's joints", list(joints))
    if not joints:
        raise InputError(path, "its skeleton has no joints")
    seen: set[str] = set()
    for joint, entry in joints.items():
        parent = mapping(path, f"joint {joint}", entry).get("parent")
        if (parent is None) != (not seen) or (parent is not None and not _one_of(parent, seen)):
            raise InputError(path, f"joint {joint}: its parent {_short(parent)} is not listed before it")
        _three_numbers(path, f"joint {joint}: its offset", entry.get("offset"))
        seen.add(joint)
    _named_joints(path, data, seen)
    return Skeleton.from_dict({**data, "name": names(path, "its skeleton's name", [data.get("name")])[0]})


def _named_joints(path: str | Path, data: Mapping[str, Any], joints: set[str]) -> None:
    """Check that roles, links, end sites and unseen joints name joints of the skeleton, `joints`."""
    roles = mapping(path, "its skeleton's roles", data.get("roles"))
    if missing := [role for role in NEEDED_ROLES if role not in roles]:
        raise InputError(path, f"its skeleton has no joint for {', '.join(missing)}")
    links = data.get("links", [])
    if not isinstance(links, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in links):
        raise InputError(path, f"its skeleton's links are {_short(links)}, not pairs of joints")
    ends = mapping(path, "its skeleton's end sites", data.get("end_sites", {}))
    for end in ends.values():
        _three_numbers(path, "an end site", end)
    unseen = names(path, "its skeleton's unseen joints", data.get("unseen", []))
    for name in (*roles.values(), *(joint for link in links for joint in link), *ends, *unseen):
        if not _one_of(name, joints):
            raise InputError(path, f"its skeleton names {_short(name)}, which is not one of its joints")


def _one_of(name: Any, joints: set[str]) -> bool:
    return isinstance(name, str) and name in joints


def _three_numbers(path: str | Path, what: str, value: Any) -> None:
    """Check that `value` is three finite numbers, in centimetres, none beyond FARTHEST."""
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise InputError(path, f"{what} is {_short(value)}, not three numbers")
    for number in value:
        length(path, what, number, FARTHEST, -FARTHEST)


def _short(value: Any) -> str:
    """A value for a message: one short printable line."""
    if isinstance(value, list | tuple | dict) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    text = ascii(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
