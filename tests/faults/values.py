"""Valid files with wrong content: arrays and JSON values that are changed, lost or of another kind."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from hobble.core.files import read_json, save_npz, write_json

WRONG: tuple[Any, ...] = (
    None, True, "", "x", "<script>", -1, 0, 1e308, 10**400, 0.5, [], {}, [[]], [None], {"x": 1}, "9" * 500,
)  # fmt: skip


def change_json(rng: Random, value: Any) -> Any:
    """A copy with a value replaced or lost, anywhere in it. Lists of many items count as one item."""
    value = json.loads(json.dumps(value))
    places = list(_places(value, rng))
    if not places:
        return rng.choice(WRONG)
    holder, key = rng.choice(places)
    how = rng.randrange(4)
    if how == 0:
        del holder[key]
    elif how == 1 and isinstance(holder[key], int | float):
        holder[key] = rng.choice((-holder[key], holder[key] + 1, 1e300, str(holder[key])))
    else:
        holder[key] = rng.choice(WRONG)
    return value


def _places(value: Any, rng: Random) -> Iterator[tuple[Any, Any]]:
    keys = (
        list(value) if isinstance(value, dict) else list(range(len(value))) if isinstance(value, list) else []
    )
    for key in keys if len(keys) < 30 or isinstance(value, dict) else rng.sample(keys, 3):
        yield value, key
        yield from _places(value[key], rng)


def _set_one(number: float) -> Callable[[Random, np.ndarray], np.ndarray]:
    def change(rng: Random, array: np.ndarray) -> np.ndarray:
        out = array.astype(float) if array.dtype.kind in "biu" and not np.isfinite(number) else array.copy()
        if out.size and out.dtype.kind in "biuf":
            with np.errstate(all="ignore"):
                out.reshape(-1)[rng.randrange(out.size)] = np.array(number).astype(out.dtype)
        return out

    return change


def _all(change: Callable[[np.ndarray], Any]) -> Callable[[Random, np.ndarray], np.ndarray]:
    return lambda rng, array: np.asarray(change(array))


ARRAYS: tuple[Callable[[Random, np.ndarray], np.ndarray], ...] = (
    _set_one(np.nan),
    _set_one(np.inf),
    _set_one(1e30),
    _set_one(-7),
    _all(lambda a: a[1:] if a.ndim else np.zeros(2, a.dtype)),
    _all(lambda a: a[:0] if a.ndim else np.array("x")),
    _all(lambda a: a[..., None]),
    _all(lambda a: a.reshape(-1)),
    _all(lambda a: np.concatenate([a, a]) if a.ndim else a[None]),
    _all(lambda a: np.zeros_like(a)),
    _all(lambda a: a.astype("U9")),
    _all(lambda a: np.zeros(a.shape, np.complex128)),
    _all(lambda a: np.zeros(a.shape, bool)),
    _all(lambda a: np.array("[]" if a.size % 2 else "{}")),
)


def change_npz(rng: Random, path: Path) -> None:
    """Write the file again with one array changed, lost or renamed."""
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    name = rng.choice(sorted(arrays))
    text = arrays[name]
    if text.dtype.kind == "U" and not text.ndim and str(text)[:1] in "[{" and rng.random() < 0.8:
        arrays[name] = np.array(json.dumps(change_json(rng, json.loads(str(text)))))
    elif rng.random() < 0.1:
        arrays["other"] = arrays.pop(name)
    else:
        arrays[name] = rng.choice(ARRAYS)(rng, text)
    path.unlink()
    save_npz(path, **arrays)


def change_file(rng: Random, path: Path, refit: bool = False) -> None:
    """Change one value of an npz or a JSON file, which stays valid as such.

    refit: whether the checksum of a JSON object is made to fit, too.
    """
    if path.suffix == ".npz":
        return change_npz(rng, path)
    value = change_json(rng, read_json(path) if refit else json.loads(path.read_text()))
    path.unlink()
    write_json(path, value) if refit else path.write_text(json.dumps(value))
    return None


def not_finite(folder: Path) -> list[str]:
    """The npz files below a folder with a number that is not finite, and JSON files that hold such a word."""
    found = []
    files = [folder] if folder.is_file() else list(folder.rglob("*"))
    for path in (file for file in files if file.suffix == ".npz"):
        with np.load(path) as file:
            for name in file.files:
                values = file[name]
                if values.dtype.kind == "f" and not np.isfinite(values).all():
                    found.append(f"{path.name}: {name}")
    for path in (file for file in files if file.suffix == ".json"):
        if any(word in path.read_text().split() for word in ("NaN", "NaN,", "Infinity", "Infinity,")):
            found.append(path.name)
    return found
