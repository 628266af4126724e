"""Artefacts of the database and of the training that were changed without breaking a checksum are refused."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import load_npz, read_json, save_npz, write_json
from hobble.database.reader import Database
from hobble.training.train import train

# What is written in place of a value, whatever it was.
JUNK = [None, True, -1, 0.5, 1e300, "", "../x", [], {}, [None]]
ARRAYS: dict[str, Callable[[np.ndarray], Any]] = {
    "gone": lambda a: None,
    "NaN": lambda a: np.full(a.shape, np.nan),
    "text": lambda a: np.full(a.shape, "a"),
    "one axis more": lambda a: a[None],
    "below 0": lambda a: np.full(a.shape, -7, a.dtype) if a.dtype.kind in "iuf" else None,
    "as if empty": lambda a: a.reshape(-1)[:0],
}


def changed(data: Any) -> list[tuple[str, Any]]:
    """Copies of JSON data, each with one value replaced by junk; of a list, only the first item's."""
    if isinstance(data, dict):
        inner = [(f"{k}.{w}", {**data, k: v}) for k in data for w, v in changed(data[k])]
        inner += [(f"without {k}", {n: v for n, v in data.items() if n != k}) for k in data]
    elif isinstance(data, list) and data:
        inner = [(f"0.{w}", [v, *data[1:]]) for w, v in changed(data[0])]
    else:
        inner = []
    return inner + [(repr(junk), junk) for junk in JUNK if junk != data or type(junk) is not type(data)]


def sound(where: str, read: Callable[[], Any]) -> None:
    """`read` either refuses with a message of one line, or gives finite numbers."""
    try:
        found = read()
    except HobbleError as error:
        if "\n" not in str(error):
            return
        raise
    except Exception as error:
        raise AssertionError(f"{where}: {type(error).__name__}: {error}") from error
    for array in found:
        assert np.isfinite(array).all(), where


def test_a_changed_manifest_or_statistics(small_database: Path, tmp_path: Path) -> None:
    path = tmp_path / "db"
    shutil.copytree(small_database, path)
    manifest = read_json(path / "manifest.json")

    def block() -> Any:
        return next(Database.open(path, 64).blocks("train", 0, 0, 3, 1))[:3]

    for where, other in changed(manifest):
        if not where.startswith(("limits", "skeleton")):
            write_json(path / "manifest.json", other)
            sound(where, block)
    write_json(path / "manifest.json", manifest)
    file = path / manifest["folder"] / "statistics.npz"
    arrays = load_npz(file)
    for name in arrays:
        for how, change in ARRAYS.items():
            array = change(arrays[name])
            save_npz(file, **{k: v for k, v in {**arrays, name: array}.items() if v is not None})
            sound(f"{name}: {how}", block)


def test_a_changed_checkpoint(data: Database, network: Any, training: Any, tmp_path: Path) -> None:
    def go() -> Any:
        state = train(data, network=network, training=training | {"passes": 1}, checkpoints=tmp_path)
        return [state.network.flat, state.adam.second_moment]

    go()
    file = next(tmp_path.glob("*/checkpoint.npz"))
    arrays = load_npz(file)
    for name in set(arrays) - {"recipe", "half"}:
        for how, change in ARRAYS.items():
            array = change(arrays[name])
            save_npz(file, **{k: v for k, v in {**arrays, name: array}.items() if v is not None})
            valid = ("weights", "first", "best", "history") if how == "below 0" else ("history", "best_mse")
            if name in valid and how in ("below 0", "NaN"):
                continue  # NaN as without held-out clips
            with pytest.raises(InputError, match=r"checkpoint\.npz: "):
                go()
