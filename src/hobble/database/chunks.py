"""One chunk of a database: a safetensors file, so that other tools open it too, with its checksum kept apart.

A safetensors file is the length of its header (8 bytes, little-endian), the header (JSON: each array's
type, shape and place) and the arrays one after another.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError

TYPES = {"<f2": "F16", "<f4": "F32", "<i4": "I32"}
HINT = "Delete the database's folder; the next run makes it again."


@dataclass(frozen=True)
class Chunk:
    """What the manifest says of a chunk: its file within the database, rows, fits, bytes and checksum."""

    file: str
    rows: int
    fits: int
    bytes: int
    crc32: int

    def to_dict(self) -> dict[str, Any]:
        """Plain data for the manifest."""
        return asdict(self)


def write_chunk(folder: Path, file: str, arrays: Mapping[str, np.ndarray]) -> Chunk:
    """Write arrays of float16, float32 or int32 to folder/file; `frames` and `fits` are among them."""
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
    text += b" " * (-len(text) % 8)
    parts = [len(text).to_bytes(8, "little"), text, *(np.ascontiguousarray(a).data for a in arrays.values())]
    crc = 0
    path = folder / file
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "wb") as out:
        for part in parts:
            out.write(part)
            crc = zlib.crc32(part, crc)
        out.flush()
        os.fsync(out.fileno())
    return Chunk(file, len(arrays["frames"]), len(arrays["fits"]), 8 + len(text) + place, crc)


def read_chunk(folder: Path, chunk: Chunk, verify: bool = True) -> dict[str, np.ndarray]:
    """The arrays of a chunk, as views of one buffer.

    Raises InputError, naming the file, where it is missing, of another length or, with `verify`, of another
    checksum.
    """
    path = folder / chunk.file
    buffer = np.empty(chunk.bytes, np.uint8)
    try:
        with open(path, "rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            if size != chunk.bytes:
                problem = f"{size} bytes where the manifest says {chunk.bytes}"
                raise InputError(path, f"truncated or overwritten: {problem}", fix=HINT)
            _fill(file.fileno(), buffer)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", fix=HINT) from error
    if verify and zlib.crc32(buffer.data) != chunk.crc32:
        raise InputError(path, "damaged: its checksum is not the manifest's", fix=HINT)
    length = int.from_bytes(buffer[:8].tobytes(), "little")
    header = json.loads(buffer[8 : 8 + length].tobytes())
    return {name: _view(buffer[8 + length :], entry) for name, entry in header.items()}


def _fill(descriptor: int, buffer: np.ndarray) -> None:
    done = 0
    while done < len(buffer):
        count = os.preadv(descriptor, [buffer[done:].data], done)
        if count == 0:
            raise OSError(0, "the file ended early")
        done += count


def _view(data: np.ndarray, entry: Mapping[str, Any]) -> np.ndarray:
    start, end = entry["data_offsets"]
    dtype = next(t for t, name in TYPES.items() if name == entry["dtype"])
    return data[start:end].view(dtype).reshape(entry["shape"])
