"""Reads single rows of the arrays in an npz file, so that a large file need not fit into memory."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import DAMAGE_ERRORS, DELETE_IT, HEADER_READERS, check_archive, check_header
from hobble.core.untrusted import check_regular, printable

# Before each array, a zip file has a header: 30 bytes, then the array's file name, then an extra field. The
# last four of the 30 bytes hold the lengths of the name and of the extra field.
LOCAL_HEADER = 30


class ArrayParts:
    """The arrays of an uncompressed npz, such as `hobble.core.files.save_npz` writes.

    Unlike `hobble.core.files.load_npz`, this class does not verify checksums, because each checksum covers a
    whole array. Raises InputError if the file is missing or damaged.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            check_regular(path)
            with zipfile.ZipFile(path) as archive:
                check_archive(path, archive)
                self._places = {
                    entry.filename.removesuffix(".npy"): self._place(archive, entry)
                    for entry in archive.infolist()
                }
        except FileNotFoundError as error:
            raise InputError(path, "no such file") from error
        except OSError as error:
            raise InputError(path, f"cannot be read: {error.strerror or error}") from error
        except DAMAGE_ERRORS as error:
            raise InputError(
                path, f"damaged or not an npz file ({printable(error)})", fix=DELETE_IT
            ) from error

    def __contains__(self, name: str) -> bool:
        return name in self._places

    @property
    def names(self) -> list[str]:
        """The names of all arrays."""
        return list(self._places)

    def shape(self, name: str) -> tuple[int, ...]:
        """The shape of a whole array."""
        return self._of(name)[1]

    def whole(self, name: str) -> np.ndarray:
        """A whole array. Use it for a scalar, which has no rows."""
        at, shape, dtype = self._of(name)
        return self._read(name, at, shape, dtype)

    def rows(self, name: str, first: int, stop: int) -> np.ndarray:
        """The rows of an array from `first` up to `stop`, as in a slice."""
        at, shape, dtype = self._of(name)
        if not shape:
            raise InputError(self.path, f"{printable(name)} has no rows", fix=DELETE_IT)
        first, stop, _ = slice(first, stop).indices(shape[0])
        row_bytes = int(np.prod(shape[1:], dtype=np.int64)) * dtype.itemsize
        return self._read(name, at + first * row_bytes, (max(0, stop - first), *shape[1:]), dtype)

    def _of(self, name: str) -> tuple[int, tuple[int, ...], np.dtype]:
        if name not in self._places:
            raise InputError(self.path, f"holds no array {printable(name)!r}", fix=DELETE_IT)
        return self._places[name]

    def _read(self, name: str, at: int, shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
        count = int(np.prod(shape, dtype=np.int64))
        with open(self.path, "rb") as file:
            file.seek(at)
            data = file.read(count * dtype.itemsize)
        if len(data) != count * dtype.itemsize:
            raise InputError(self.path, f"{printable(name)} does not fit into the file", fix=DELETE_IT)
        return np.frombuffer(bytearray(data), dtype).reshape(shape)

    def _place(
        self, archive: zipfile.ZipFile, entry: zipfile.ZipInfo
    ) -> tuple[int, tuple[int, ...], np.dtype]:
        """Where the numbers of an array begin in the file, and the shape and type of the array."""
        if entry.compress_type != zipfile.ZIP_STORED:
            raise ValueError(f"{entry.filename} is compressed")
        if entry.header_offset + entry.file_size > archive.start_dir:
            raise EOFError(f"{entry.filename} does not fit into the file")
        with open(self.path, "rb") as file:
            file.seek(entry.header_offset)
            name_length, extra_length = struct.unpack("<26xHH", file.read(LOCAL_HEADER))
            start = entry.header_offset + LOCAL_HEADER + name_length + extra_length
        with archive.open(entry) as file:
            check_header(file, entry.file_size)
            header_length = file.tell()
            file.seek(0)
            shape, by_columns, dtype = HEADER_READERS[np.lib.format.read_magic(file)](file)
        if by_columns and len(shape) > 1:
            raise ValueError(f"{entry.filename} is stored column by column")
        return start + header_length, shape, dtype
