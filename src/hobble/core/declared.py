"""Checks what a file holds against a declaration, once, where the file is opened.

Arrays are declared by shape, type and range. JSON is declared by a class: a dataclass or a pydantic model.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from pydantic import TypeAdapter, ValidationError

from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, Arrays, load_npz, printable, read_json

Declared = TypeVar("Declared")


class ArrayOf(NamedTuple):
    """An array.

    shape: the length of each axis, or a letter for a length that all arrays of the file with this letter
    share. kinds: the codes of NumPy's allowed types: f floats, i and u integers, b truth values, U text. low,
    high: smallest and largest number that is allowed. finite: whether all numbers must be finite. optional:
    whether the file may lack the array.
    """

    shape: tuple[int | str, ...]
    kinds: str = "f"
    low: float = -math.inf
    high: float = math.inf
    finite: bool = True
    optional: bool = False


def check_arrays(
    path: str | Path,
    arrays: Mapping[str, np.ndarray],
    declared: Mapping[str, ArrayOf],
    lengths: Mapping[str, int] | None = None,
    fix: str | None = None,
) -> dict[str, int]:
    """Raise InputError unless each declared array is there and is as declared. Further arrays are ignored.

    path, fix: for the message. lengths: those of letters that are known before. Returns those of all letters.
    """
    known: dict[Any, int] = dict(lengths or {})
    for name, wanted in declared.items():
        if name not in arrays:
            if wanted.optional:
                continue
            raise InputError(path, f"has no {name}", fix=fix)
        array = np.asarray(arrays[name])
        if array.ndim == len(wanted.shape):
            for axis, length in zip(wanted.shape, array.shape, strict=True):
                known.setdefault(axis, length)
        expected = tuple(axis if isinstance(axis, int) else known.get(axis, axis) for axis in wanted.shape)
        if array.shape != expected or array.dtype.kind not in wanted.kinds:
            problem = f"{name} has shape {array.shape} and type {array.dtype}, expected "
            problem += f"({', '.join(map(str, expected))}) of kind {wanted.kinds}"
            raise InputError(path, problem, fix=fix)
        _check_range(path, name, array, wanted, fix)
    return known


def _check_range(path: str | Path, name: str, array: np.ndarray, wanted: ArrayOf, fix: str | None) -> None:
    if not array.size or array.dtype.kind == "U":
        return
    known = array if wanted.finite or array.dtype.kind != "f" else array[~np.isnan(array)]
    if not known.size:
        return
    low, high = float(known.min()), float(known.max())  # NaN if there is one
    if wanted.finite and not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(path, f"{name} holds numbers that are not finite", fix=fix)
    if low < wanted.low or high > wanted.high:
        wrong, limit = (low, wanted.low) if low < wanted.low else (high, wanted.high)
        side = "below" if low < wanted.low else "above"
        raise InputError(path, f"{name} holds {wrong:.3g}, {side} the limit of {limit:g}", fix=fix)


@lru_cache(maxsize=64)
def _adapter(declared: Any) -> TypeAdapter[Any]:
    return TypeAdapter(declared)


def read_declared(
    path: str | Path, what: str, declared: type[Declared], data: Any, fix: str | None = None
) -> Declared:
    """The content `data` of a JSON or YAML file as an object of the class `declared`.

    path, what, fix: for the message, such as "its skeleton". Raises InputError that names the first value
    which is missing or not as declared.
    """
    try:
        return _adapter(declared).validate_python(data)  # type: ignore[arg-type, no-any-return]
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        problem = first["msg"].removeprefix("Value error, ")
        place = f"{what}: {key}" if key else what
        raise InputError(path, printable(f"{place}: {problem}", 300), fix=fix) from None


def load_declared(path: str | Path, declared: Mapping[str, ArrayOf], fix: str = DELETE_IT) -> Arrays:
    """The arrays of an npz file, checked as `check_arrays` does."""
    arrays = load_npz(path)
    check_arrays(path, arrays, declared, fix=fix)
    return arrays


def load_report(path: str | Path, what: str, declared: type[Declared]) -> Declared:
    """The content of a JSON file that a job wrote, as `declared`. what: see `read_declared`."""
    return read_declared(path, what, declared, read_json(path), DELETE_IT)
