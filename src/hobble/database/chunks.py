"""The files of a database: chunks with its rows, the types of their numbers, and the manifest."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from hobble.core.declared import read_declared
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import read_json, write_json
from hobble.core.quat import Array
from hobble.core.section import Positive, PositiveFloat
from hobble.core.skeleton import skeleton_from_data
from hobble.rows.layout import RowLayout, layout_from_data

Precision = Literal["float32", "float16"]
# Name of a precision -> NumPy's type of the stored numbers.
STORED: dict[str, np.dtype[Any]] = {"float32": np.dtype("<f4"), "float16": np.dtype("<f2")}


def to_stored_type(values: Array, precision: str) -> np.ndarray:
    """Convert float values to the type that is stored for `precision`, a key of STORED.

    Raises HobbleError if a value is too large for the type.
    """
    with np.errstate(over="ignore"):
        out = np.asarray(values, STORED[precision])
    if not np.isfinite(out).all():
        raise HobbleError(
            f"a standardised value of {float(np.abs(values).max()):.3g} does not fit {precision}. "
            "Set database.dtype to float32."
        )
    return out


# Chunks: a database stores its rows in files of a few MB, each with a checksum in the database's manifest.
#
# A chunk is a safetensors file, which other tools can open. It begins with the length of its header (8 bytes,
# little-endian). Then come the header (JSON: type, shape and place of each array) and the arrays.


INDEX_BYTES = 16  # in a chunk, for each row: its number of terrain fits, clip, frame and phase
LENGTH = 8  # bytes of the number, at the start of the file, that says how long the header is
TYPES = {"<f2": "F16", "<f4": "F32", "<i4": "I32"}  # NumPy's name of a type -> its name in safetensors
HINT = "Delete the folder of the database; the next run makes it again."


@dataclass(frozen=True)
class Chunk:
    """A chunk's entry in the manifest.

    file: path of the chunk in the database's folder of chunks. rows, fits, bytes: number of its rows, of its
    terrain fits (ground heights that suit a row) and of its bytes. crc32: its checksum.
    """

    file: Annotated[str, Field(pattern=r"^(train|held_out)/[0-9]+\.safetensors$")]
    rows: Positive
    fits: Positive
    bytes: Annotated[int, Field(gt=0, le=1 << 40)]
    crc32: Annotated[int, Field(ge=0, lt=1 << 32)]


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
            for part in parts:
                if file.readinto(part) != len(part):
                    raise OSError(0, "the file ended early")
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", fix=HINT) from error
    if verify and _checksum(parts) != chunk.crc32:
        raise InputError(path, "damaged: its checksum differs from the manifest", fix=HINT)
    if LENGTH + int.from_bytes(start[:LENGTH].tobytes(), "little") != start_bytes:
        raise InputError(path, "its arrays differ from the manifest", fix=HINT)


def _bytes(array: np.ndarray) -> memoryview:
    """The bytes of a contiguous array, without a copy."""
    return array.reshape(-1).view(np.uint8).data


def _checksum(parts: Sequence[memoryview]) -> int:
    crc = 0
    for part in parts:
        crc = zlib.crc32(part, crc)
    return crc


# The file manifest.json of a database: what the database contains.
#
# The manifest is written last, so a folder without it is not a complete database.


FILE = "manifest.json"
STATISTICS = "statistics.npz"  # means and deviations of all training rows
VERSION = 3  # of the database's format
SPLITS = ("train", "held_out")


@dataclass(frozen=True)
class ClipEntry:
    """What each entry of `Manifest.clips` has; a hurt version also has a `source`."""

    clip: str
    split: Literal["train", "held_out"]
    rows: Annotated[int, Field(ge=0)]
    pairs: Annotated[int, Field(ge=0)]
    source: str = ""


@dataclass(frozen=True)
class Manifest:
    """What a database contains.

    folder: subfolder with the chunks and statistics. Its name contains a hash of their content.
    layout: the columns of the rows that a network gets. skeleton: see `Skeleton.to_dict`.
    visits: how often a pass over the data uses each row. dtype: type of the numbers on disk.
    joint_weight: factor by which the standardised joints in the network's input are multiplied.
    clips: one entry for each clip: `clip` (its name), `split`, number of `rows` and of
    `pairs` (of a row and one of its terrain fits), and for a hurt version `source`, the name of the healthy
    clip from which it was computed.
    chunks: split -> its chunks.
    original_bytes: size of the same data in the layout of Holden et al. (2017), which has each row `visits`
    times. bytes: size of all chunks. limits: channel -> speed limits (`hobble.channels.speed_limits`).
    """

    folder: Annotated[str, Field(pattern=r"^rows-[0-9a-f]+$")]
    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: Positive
    dtype: Precision
    joint_weight: PositiveFloat
    clips: list[dict[str, Any]]
    chunks: Mapping[str, list[Chunk]]
    original_bytes: int
    bytes: int
    limits: Mapping[str, Any] = field(default_factory=dict)

    def row_count(self, split: str) -> int:
        """Number of rows of a split."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)

    def save(self, path: Path) -> None:
        """Write manifest.json into the database folder `path`, completely or not at all."""
        values = {**vars(self), "format": "hobble database", "version": VERSION}
        values["layout"] = self.layout.to_dict()
        # The skeleton is stored as text, because write_json sorts keys, but joints have to keep their order.
        values["skeleton"] = json.dumps(self.skeleton)
        values["chunks"] = {split: [asdict(c) for c in chunks] for split, chunks in self.chunks.items()}
        write_json(path / FILE, values)

    @classmethod
    def load(cls, path: Path) -> Manifest:
        """Read the manifest of the database folder `path`. Raises InputError if it is missing or wrong."""
        file = path / FILE
        if not file.exists():
            raise InputError(
                path, f"not a complete database: it has no {FILE}, so its build did not finish", fix=HINT
            )
        values = read_declared(file, "the manifest", dict, read_json(file, HINT), HINT)
        if (values.pop("format", ""), values.pop("version", 0)) != ("hobble database", VERSION):
            raise InputError(file, f"not a database of format version {VERSION}", fix=HINT)
        values["layout"] = layout_from_data(file, values.get("layout"), HINT)
        skeleton_from_data(file, values.get("skeleton"), fix=HINT)
        values["skeleton"] = json.loads(values["skeleton"])
        manifest = read_declared(file, "the manifest", cls, values, HINT)
        read_declared(file, "clips", list[ClipEntry], manifest.clips, HINT)
        stored = {split: sum(chunk.rows for chunk in chunks) for split, chunks in manifest.chunks.items()}
        if stored != {split: manifest.row_count(split) for split in SPLITS}:
            raise InputError(file, "its clips have other rows than its chunks", fix=HINT)
        return manifest


def database_sizes(manifest: Manifest) -> dict[str, Any]:
    """The sizes of a database. A terrain fit of a frame is a set of ground heights that suit its motion.

    Keys. joints: number of joints. dtype: type of the numbers on disk. frames: number of frames in both
    splits together. pairs: number of pairs of a frame and a terrain fit that one pass over the data uses. It
    counts the single fit of a frame on flat ground as often as the pass uses it. bytes: size of all chunks.
    original_bytes: size of all pairs as rows of X, Y and P in float32, as in Holden et al. (2017). share:
    bytes / original_bytes.
    """
    frames = sum(manifest.row_count(split) for split in manifest.chunks)
    return {
        "joints": manifest.layout.joints,
        "dtype": manifest.dtype,
        "frames": frames,
        "pairs": frames * manifest.visits,
        "bytes": manifest.bytes,
        "original_bytes": manifest.original_bytes,
        "share": manifest.bytes / manifest.original_bytes,
    }
