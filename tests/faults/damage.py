"""Damage to files: bytes as on a disk or in a crash, words of a text, and wrong values in valid files."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from hobble.core.files import read_json, save_npz, write_json


def _flip(rng: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 40))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _block(change: Callable[[bytes, bytes, bytes], bytes]) -> Callable[[Random, bytes], bytes]:
    """Change a random run of bytes. change: gets what is before it, the run, and what is after it."""

    def damage(rng: Random, data: bytes) -> bytes:
        first = rng.randrange(len(data))
        last = first + rng.choice((1, 16, 512, 4096))
        return change(data[:first], data[first:last], data[last:])

    return damage


DAMAGES: dict[str, Callable[[Random, bytes], bytes]] = {
    "cut": lambda rng, data: data[: rng.randrange(len(data))],
    "flipped": _flip,
    "zeroed": _block(lambda before, run, after: before + bytes(len(run)) + after),
    "all zero": lambda rng, data: bytes(len(data)),
    "lost": _block(lambda before, run, after: before + after),
    "repeated": _block(lambda before, run, after: before + run + run + after),
    "added": lambda rng, data: data + rng.randbytes(rng.randint(1, 5000)),
    "noise": lambda rng, data: rng.randbytes(len(data)),
}


def damaged(rng: Random, data: bytes) -> bytes:
    """The bytes after some damage. They always differ from the bytes before."""
    for _ in range(50):
        if (out := DAMAGES[rng.choice(sorted(DAMAGES))](rng, data)) != data:
            return out
    return data[:-1]


# What stands in place of a word of a BVH or status file.
WORDS = (
    "five", "nan", "-inf", "1e999", "1,5", "0x10", "--1", "1_0", "9" * 5000, "\x01", "<script>", "%s{0}%n",
    "", "0", "-3", "2000000000", "0.5", "٣", "1e3", "../../etc/passwd", "x" * 100_000, "1 " * 100_000,
    "{", "}", "[",
)  # fmt: skip


def change_text(rng: Random, text: str) -> str:
    """A word or a line of a text is replaced, lost, given twice or damaged."""
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    words = lines[at].split(" ")
    how = rng.randrange(5)
    if how < 2:
        words[rng.randrange(len(words))] = rng.choice(WORDS)
        lines[at] = " ".join(words)
    elif how == 2:
        del lines[at]
    elif how == 3:
        lines.insert(at, rng.choice((lines[at], "# comment", rng.choice(lines))))
    else:
        return damaged(rng, text.encode()).decode(errors="surrogateescape")
    return "\n".join(lines)


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
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
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


ARRAYS: tuple[Callable[[Random, np.ndarray], np.ndarray], ...] = (
    *map(_set_one, (np.nan, np.inf, 1e30, -7)),
    lambda rng, a: a[1:] if a.ndim else np.zeros(2, a.dtype),
    lambda rng, a: a[:0] if a.ndim else np.array("x"),
    lambda rng, a: a[..., None],
    lambda rng, a: a.reshape(-1),
    lambda rng, a: np.concatenate([a, a]) if a.ndim else a[None],
    lambda rng, a: np.zeros_like(a),
    lambda rng, a: a.astype("U9"),
    lambda rng, a: np.zeros(a.shape, np.complex128),
    lambda rng, a: np.zeros(a.shape, bool),
    lambda rng, a: np.array("[]" if a.size % 2 else "{}"),
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


def change_file(rng: Random, path: Path) -> None:
    """Change one value of a file. Checksums are made to fit."""
    if path.suffix == ".npz":
        return change_npz(rng, path)
    if path.suffix == ".json":
        value = change_json(rng, read_json(path))
        path.unlink()
        return write_json(path, value)
    text = change_text(rng, path.read_text())
    path.unlink()
    path.write_text(text, errors="surrogateescape")
    return None


def not_finite(folder: Path) -> list[str]:
    """The npz files below a folder with a number that is not finite, and JSON files that hold such a word."""
    found = []
    for path in [folder] if folder.is_file() else folder.rglob("*"):
        if path.suffix == ".npz":
            with np.load(path) as file:
                values = {name: file[name] for name in file.files if file[name].dtype.kind == "f"}
            found += [f"{path.name}: {n}" for n, value in values.items() if not np.isfinite(value).all()]
        if path.suffix == ".json" and {"NaN", "Infinity"} & set(path.read_text().replace(",", " ").split()):
            found.append(path.name)
    return found
