"""Reads some rows of an array in an npz file, so that a large file need not fit into memory."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, HEADER_READERS, check_archive, check_header, reading
from hobble.core.untrusted import printable

# An npz file is a zip file with an npy file for each array. Before each npy file there is a zip header: 30
# bytes, then the name of the npy file, then an extra field. The last four of the 30 bytes hold the lengths of
# the name and of the extra field.
ZIP_HEADER_BYTES = 30


class ArrayParts:
    """The arrays of an uncompressed npz, such as `hobble.core.files.save_npz` writes.

    Unlike `hobble.core.files.load_npz`, this class does not verify checksums, because it would have to read
    whole arrays for that. Raises InputError if the file is missing or damaged.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with reading(path, "damaged or not an npz file", DELETE_IT), zipfile.ZipFile(path) as archive:
            check_archive(path, archive)
            # Name of an array -> where its numbers begin, its shape and its type.
            self._places = {
                entry.filename.removesuffix(".npy"): self._find_array(archive, entry)
                for entry in archive.infolist()
            }

    def __contains__(self, name: str) -> bool:
        return name in self._places

    @property
    def names(self) -> list[str]:
        """The names of all arrays."""
        return list(self._places)

    def shape(self, name: str) -> tuple[int, ...]:
        """The shape of a whole array."""
        return self._place_of(name)[1]

    def read_whole(self, name: str) -> np.ndarray:
        """A whole array. A scalar has no rows, so it can only be read with this method."""
        start, shape, dtype = self._place_of(name)
        return self._read(name, start, shape, dtype)

    def read_rows(self, name: str, first: int, stop: int) -> np.ndarray:
        """The rows `first:stop` of an array. As with a slice, rows that do not exist are left out."""
        start, shape, dtype = self._place_of(name)
        if not shape:
            raise InputError(self.path, f"{printable(name)} has no rows", fix=DELETE_IT)
        first, stop, _ = slice(first, stop).indices(shape[0])
        row_bytes = int(np.prod(shape[1:], dtype=np.int64)) * dtype.itemsize
        return self._read(name, start + first * row_bytes, (max(0, stop - first), *shape[1:]), dtype)

    def _place_of(self, name: str) -> tuple[int, tuple[int, ...], np.dtype]:
        """As in `_find_array`. Raises InputError if there is no such array."""
        if name not in self._places:
            raise InputError(self.path, f"holds no array {printable(name)!r}", fix=DELETE_IT)
        return self._places[name]

    def _read(self, name: str, start: int, shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
        """An array of this shape and type. start: its first byte in the file. name: for messages."""
        count = int(np.prod(shape, dtype=np.int64))
        with open(self.path, "rb") as file:
            file.seek(start)
            data = file.read(count * dtype.itemsize)
        if len(data) != count * dtype.itemsize:
            raise InputError(self.path, f"{printable(name)} does not fit into the file", fix=DELETE_IT)
        # bytearray, because an array over `bytes` would be read-only.
        return np.frombuffer(bytearray(data), dtype).reshape(shape)

    def _find_array(
        self, archive: zipfile.ZipFile, entry: zipfile.ZipInfo
    ) -> tuple[int, tuple[int, ...], np.dtype]:
        """Where the numbers of an array begin (bytes from the start of the file), its shape and its type.

        entry: the array's npy file in the archive. Raises ValueError or EOFError if its rows cannot be read.
        """
        if entry.compress_type != zipfile.ZIP_STORED:
            raise ValueError(f"{entry.filename} is compressed")
        if entry.header_offset + entry.file_size > archive.start_dir:
            raise EOFError(f"{entry.filename} does not fit into the file")
        with open(self.path, "rb") as file:
            file.seek(entry.header_offset)
            name_length, extra_length = struct.unpack("<26xHH", file.read(ZIP_HEADER_BYTES))
            npy_start = entry.header_offset + ZIP_HEADER_BYTES + name_length + extra_length
        with archive.open(entry) as file:
            check_header(file, entry.file_size)
            npy_header_length = file.tell()
            file.seek(0)
            shape, by_columns, dtype = HEADER_READERS[np.lib.format.read_magic(file)](file)
        if by_columns and len(shape) > 1:
            raise ValueError(f"{entry.filename} is stored column by column")
        return npy_start + npy_header_length, shape, dtype
