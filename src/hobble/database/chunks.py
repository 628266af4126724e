"""Chunks: a database stores its rows in files of a few MB, each with a checksum in the database's manifest.

A chunk is a safetensors file, which other tools can open. It begins with the length of its header (8 bytes,
little-endian). Then come the header (JSON: type, shape and place of each array) and the arrays.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError

LENGTH = 8  # bytes of the number, at the start of the file, that says how long the header is
MOST_PARTS = 16  # one call of `preadv` fills at most this many buffers; every POSIX system allows so many
# NumPy's name of a type -> its name in safetensors. NumPy has no bfloat16, so uint16 numbers hold its bits.
TYPES = {"<f2": "F16", "<u2": "BF16", "<f4": "F32", "<i4": "I32"}
HINT = "Delete the folders of the database and of its shards. The next run makes them again."


@dataclass(frozen=True)
class Chunk:
    """A chunk's entry in the manifest.

    file: path of the chunk in the database's folder of chunks. rows, fits, bytes: number of its rows, of its
    terrain fits (ground heights that suit a row) and of its bytes. crc32: its checksum.
    """

    file: str
    rows: int
    fits: int
    bytes: int
    crc32: int

    def to_dict(self) -> dict[str, Any]:
        """Plain data for the manifest."""
        return asdict(self)


def write_chunk(folder: Path, file: str, arrays: Mapping[str, np.ndarray]) -> Chunk:
    """Write arrays, by name, to folder/file and return the chunk's entry for the manifest.

    Among the arrays have to be `x`, with the chunk's rows, and `fits`. Each type has to be in TYPES.
    """
    header: dict[str, Any] = {}
    place = 0
    for name, array in arrays.items():
        end = place + array.nbytes
        header[name] = {
            "dtype": TYPES[array.dtype.newbyteorder("<").str],
            "shape": list(array.shape),
            "data_offsets": [place, end],
        }
        place = end
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)  # so that the arrays begin at a multiple of 8 bytes
    start = np.frombuffer(len(text).to_bytes(LENGTH, "little") + text, np.uint8)
    parts = [_bytes(part) for part in (start, *map(np.ascontiguousarray, arrays.values()))]
    path = folder / file
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "wb") as out:
        out.writelines(parts)
        out.flush()
        os.fsync(out.fileno())
    rows, fits = len(arrays["x"]), len(arrays["fits"])
    return Chunk(file, rows, fits, sum(len(part) for part in parts), _checksum(parts))


def read_chunk(folder: Path, chunk: Chunk, arrays: Mapping[str, np.ndarray], verify: bool = True) -> None:
    """Read a chunk directly into `arrays`.

    They need the names, order, shapes and types of the arrays that were written, and have to be contiguous.
    verify: whether to check the checksum. Raises InputError with the file's name if the file is missing, if
    its length or its arrays differ from the manifest, or if the checksum is wrong.
    """
    path = folder / chunk.file
    start_bytes = chunk.bytes - sum(array.nbytes for array in arrays.values())
    start = np.empty(max(start_bytes, LENGTH), np.uint8)  # the header and its length
    parts = [_bytes(array) for array in (start, *arrays.values())]
    try:
        with open(path, "rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            if size != chunk.bytes:
                problem = f"{size} bytes, but the manifest says {chunk.bytes}"
                raise InputError(path, f"truncated or overwritten: {problem}", fix=HINT)
            _fill(file.fileno(), parts)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", fix=HINT) from error
    if verify and _checksum(parts) != chunk.crc32:
        raise InputError(path, "damaged: its checksum differs from the manifest", fix=HINT)
    if LENGTH + int.from_bytes(start[:LENGTH].tobytes(), "little") != start_bytes:
        raise InputError(path, "its arrays differ from the manifest", fix=HINT)


def _bytes(array: np.ndarray) -> memoryview:
    """The bytes of a contiguous array, without a copy."""
    return array.reshape(-1).view(np.uint8).data


def _fill(descriptor: int, parts: Sequence[memoryview]) -> None:
    """Fill the buffers `parts`, one after another, from the start of an open file, with few system calls."""
    unfilled, place = [part for part in parts if len(part)], 0
    while unfilled:
        count = os.preadv(descriptor, unfilled[:MOST_PARTS], place)
        if count == 0:
            raise OSError(0, "the file ended early")
        place += count
        while unfilled and count >= len(unfilled[0]):
            count -= len(unfilled.pop(0))
        if count:
            unfilled[0] = unfilled[0][count:]


def _checksum(parts: Sequence[memoryview]) -> int:
    crc = 0
    for part in parts:
        crc = zlib.crc32(part, crc)
    return crc
