"""Writes files completely or not at all, and reads JSON, CSV, npz and npy files that may be damaged.

A file is written under a temporary name and then renamed.
"""

import base64
import contextlib
import csv
import errno
import glob
import io
import json
import math
import os
import platform
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.untrusted import check_regular, printable, read_text

Json = Mapping[str, Any]  # what a JSON file holds

# The compressed arrays of a file may together unpack to at most this. Hobble itself does not compress arrays.
MAX_INFLATED_BYTES = 1 << 30
MAX_JSON_BYTES = 1 << 30
_HOST = f"{zlib.crc32(platform.node().encode()):08x}"  # this machine, in the names of temporary files
DELETE_IT = "Delete it; the next run makes it again."
CHECKSUMS = "checksums"  # key of a JSON file
# Version of the npy format -> NumPy's function that reads the header of an array in this version.
HEADER_READERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
# What zipfile and NumPy raise for a damaged file.
DAMAGE_ERRORS = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    KeyError,
    NotImplementedError,  # a flipped bit in the number of the compression method
    OverflowError,
    RuntimeError,  # a flipped bit, so that the array counts as encrypted
    ValueError,
)


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path, in the folder of `path`, for the caller to write a file.

    If the `with` block succeeds, the file is flushed to disk and renamed to `path`. If it fails, `path` keeps
    its old content and the temporary file is removed. Raises HobbleError if the disk is full or the folder
    cannot be written.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{_HOST}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(path)
        yield temporary
        with open(temporary, "rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
        sync_folder(path.parent)
    except OSError as error:
        raise failed_write_error(error, path) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Flush a folder to disk, if the system can, so that a rename in it survives a power cut."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _remove_leftovers(path: Path) -> None:
    """Remove the unfinished temporary files of `path` that killed processes left."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        try:
            # The name contains the machine and the process id. Another machine may still be writing.
            host, pid = left.name.split(".")[-3:-1]
            if host == _HOST:
                os.kill(int(pid), 0)  # signal 0 only asks whether the process exists
        except ProcessLookupError:
            left.unlink(missing_ok=True)
        except (ValueError, OSError):
            continue  # not one of our files, or another user's process


def failed_write_error(error: OSError, path: Path) -> HobbleError:
    """The error to raise for a failed write; its message says what the user can do."""
    reasons = {
        errno.ENOSPC: ("the disk is full", "Free some space and run the same command again."),
        errno.EDQUOT: ("the disk quota is used up", "Free some space and run the same command again."),
        errno.EACCES: ("no permission to write here", "Check who owns the folder."),
        errno.EROFS: ("the file system is read-only", "Choose another folder for the results."),
    }
    problem, fix = reasons.get(error.errno or 0, (f"cannot be written: {error.strerror or error}", None))
    return InputError(path, problem, fix=fix)


def write_text(path: str | Path, text: str) -> None:
    """Write `text` as UTF-8 to `path`, completely or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write bytes to `path`, completely or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def write_json(path: str | Path, value: Any) -> None:
    """Write `value` as JSON with sorted keys, so that equal values give equal bytes.

    An object gets a key CHECKSUMS, of its other keys. `read_json` compares and removes it.
    """
    if isinstance(value, Mapping):
        value = {**value, CHECKSUMS: _json_checksum(json.loads(json.dumps(value, allow_nan=False)))}
    write_text(path, json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n")


def _json_checksum(value: Any) -> str:
    return f"crc32 {zlib.crc32(json.dumps(value, sort_keys=True).encode()):08x}"


def read_json(path: str | Path, fix: str = DELETE_IT) -> Any:
    """Read a JSON file.

    Raises InputError with the advice `fix` if it is not valid JSON, then also with the line, or if it was
    changed since `write_json` wrote it.
    """
    try:
        value = json.loads(
            read_text(path, MAX_JSON_BYTES), parse_constant=_refuse_constant, parse_float=_finite
        )
    except json.JSONDecodeError as error:
        raise InputError(path, f"not valid JSON: {error.msg}", line=error.lineno, fix=fix) from error
    except (RecursionError, ValueError) as error:
        raise InputError(path, f"not valid JSON: {error}", fix=fix) from error
    checksum = value.pop(CHECKSUMS, None) if isinstance(value, dict) else None
    if checksum is not None and checksum != _json_checksum(value):
        raise InputError(path, "was changed after it was written", fix=fix)
    return value


def _finite(word: str) -> float:
    """The number, if it is not too large for a float."""
    value = float(word)
    return value if abs(value) < float("inf") else _refuse_constant(word)


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number")


def save_npz(path: str | Path, **arrays: Any) -> None:
    """Write arrays as an uncompressed npz, without pickles. Equal arrays give equal bytes.

    `np.savez` asks zipfile for fields of 8 bytes, which patch versions of Python write differently. Here only
    an array of more than a gigabyte has them.
    """
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, value in arrays.items():
            array, entry = np.asanyarray(value), zipfile.ZipInfo(f"{name}.npy")  # of the year 1980
            entry.create_system = 3  # as on Unix, whatever the system
            with archive.open(entry, "w", force_zip64=array.nbytes > 1 << 30) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


class Arrays(dict[str, np.ndarray]):
    """The arrays of the file `path`, as name -> array. A missing name raises InputError."""

    def __init__(self, path: str | Path, arrays: Iterable[tuple[str, np.ndarray]]) -> None:
        super().__init__(arrays)
        self.path = path

    def __missing__(self, name: str) -> np.ndarray:
        raise InputError(self.path, f"holds no array {printable(name)!r}", fix=DELETE_IT)


def load_npz(path: str | Path, names: Iterable[str] | None = None) -> Arrays:
    """Read all arrays of an npz, or those in `names`. Checks the checksum of each array and refuses pickles.

    Raises InputError if the file or an array is missing or damaged, or if a header claims more data than the
    file holds.
    """
    with reading(path, "damaged or not an npz file", DELETE_IT), zipfile.ZipFile(path) as archive:
        check_archive(path, archive)
        stored = [name.removesuffix(".npy") for name in archive.namelist()]
        wanted = stored if names is None else list(names)
        if missing := [name for name in wanted if name not in stored]:
            raise InputError(path, f"holds no array {printable(missing[0])!r}", fix=DELETE_IT)
        return Arrays(path, [(name, _read_array(archive, f"{name}.npy")) for name in wanted])
    raise AssertionError("not reached")


@contextlib.contextmanager
def reading(path: str | Path, problem: str, fix: str | None = None) -> Iterator[os.stat_result]:
    """Turn the errors of reading a file into InputError. Yields the stat result of the file.

    problem, fix: for the message about a damaged file. Raises InputError if it is missing or not regular.
    """
    try:
        yield check_regular(path)
    except FileNotFoundError as error:
        raise InputError(path, "no such file") from error
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror or error}") from error
    except DAMAGE_ERRORS as error:
        raise InputError(path, f"{problem} ({printable(error)})", fix=fix) from error


def check_archive(path: str | Path, archive: zipfile.ZipFile) -> None:
    """Raise ValueError or BadZipFile if an archive's list of files is damaged or claims too much data."""
    if _entry_count(path, archive) != len(archive.infolist()):
        raise zipfile.BadZipFile("its list of files has lost an entry")
    _check_sizes(path, archive)


def _entry_count(path: str | Path, archive: zipfile.ZipFile) -> int:
    """The number of files that the archive's end record states. zipfile does not check this number.

    The end record has 22 bytes, with the number at byte 10, and then the archive's comment.
    """
    with open(path, "rb") as file:
        file.seek(-22 - len(archive.comment), os.SEEK_END)
        (count,) = struct.unpack("<10xH10x", file.read(22))
    return count


def _check_sizes(path: str | Path, archive: zipfile.ZipFile) -> None:
    """Raise ValueError if the entries would need too much memory.

    All entries together may not be larger than the file. They are larger if several entries share the same
    bytes. Compressed entries may not unpack to more than MAX_INFLATED_BYTES.
    """
    entries = archive.infolist()
    if any(entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for entry in entries):
        raise ValueError("compressed in a way that NumPy does not use")
    if any(entry.file_size != entry.compress_size for entry in entries if not entry.compress_type):
        raise ValueError("an uncompressed entry has two different sizes")
    if sum(entry.compress_size for entry in entries) > os.path.getsize(path):
        raise ValueError("its entries overlap")
    if sum(entry.file_size for entry in entries if entry.compress_type) > MAX_INFLATED_BYTES:
        raise ValueError(f"would unpack to more than {MAX_INFLATED_BYTES >> 20} MB")


def _read_array(archive: zipfile.ZipFile, member: str) -> np.ndarray:
    """Read the array in the archive's file `member`. First check that the array's header fits its size."""
    info = archive.getinfo(member)
    _check_place(archive, info)
    with archive.open(info) as file:
        check_header(file, info.file_size)
    with archive.open(info) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def _check_place(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
    """Raise EOFError if an array reaches into the archive's list of files, which is behind all arrays."""
    if not info.compress_type and info.header_offset + info.file_size > archive.start_dir:
        raise EOFError(f"{info.filename} does not fit into the file")


def map_npz(path: str | Path) -> Arrays:
    """The arrays of an npz that `save_npz` wrote, of which only those parts are read that are used.

    Unlike `load_npz` it does not compare checksums, because it would have to read whole arrays for that.
    Raises InputError if the file is missing or damaged.
    """
    with reading(path, "damaged or not an npz file", DELETE_IT), zipfile.ZipFile(path) as archive:
        check_archive(path, archive)
        with open(path, "rb") as file:
            arrays = [(each.filename, _map_array(file, archive, each)) for each in archive.infolist()]
        return Arrays(path, [(name.removesuffix(".npy"), array) for name, array in arrays])
    raise AssertionError("not reached")


def _map_array(file: IO[bytes], archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """The array of an archive's entry as a part of the open file."""
    _check_place(archive, info)
    # Before each entry there are 30 bytes, of which the last four hold the lengths of the entry's name and of
    # an extra field, and then these two.
    file.seek(info.header_offset)
    start = info.header_offset + 30 + sum(struct.unpack("<26xHH", file.read(30)))
    file.seek(start)
    shape, by_columns, dtype = check_header(file, start + info.file_size)
    if info.compress_type or (by_columns and len(shape) > 1):
        raise ValueError(f"{info.filename} is compressed, or stored column by column")
    if not all(shape):
        return np.zeros(shape, dtype)  # an empty array cannot be mapped
    return np.memmap(file, dtype, "r", file.tell(), shape)


def load_npy(path: str | Path) -> np.ndarray:
    """Read the array of an npy file. Refuses pickles and archives.

    Raises InputError if the file is missing or damaged, or if its size does not match its header.
    """
    with reading(path, "not an array file") as status, open(path, "rb") as file:
        check_header(file, status.st_size)
        file.seek(0)
        return np.lib.format.read_array(file, allow_pickle=False)
    raise AssertionError("not reached")


def check_header(file: IO[bytes], size: int) -> tuple[tuple[int, ...], bool, np.dtype]:
    """An array's shape, whether it is stored by columns, and its type.

    file: open at the start of the array's header. size: where the array ends in it. Raises ValueError if the
    header is damaged or the array has another size. NumPy parses the header as a Python expression, so a
    damaged header can raise almost any error.
    """
    try:
        shape, by_columns, dtype = HEADER_READERS[np.lib.format.read_magic(file)](file)
    except OSError:
        raise
    except (Exception, MemoryError):  # Python raises MemoryError for a header that is nested too deeply
        raise ValueError("the header of an array cannot be understood") from None
    count = 1
    for length in shape:
        count *= length
    if dtype.hasobject or min(shape, default=0) < 0 or count * dtype.itemsize != size - file.tell():
        raise ValueError("an array has another size than its header says, or holds Python objects")
    return shape, by_columns, dtype


def write_csv(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a CSV file with a header and a line for each row. Without rows, the file is empty.

    Columns are in the order in which they first occur. A field is empty if its value is missing, None or NaN.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    columns = list(dict.fromkeys(key for row in rows for key in row))
    writer.writerows([columns] if columns else [])
    for values in ([row.get(key) for key in columns] for row in rows):
        writer.writerow(["" if value is None or value != value else value for value in values])
    write_text(path, out.getvalue())


def write_tables(folder: str | Path, tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Write each table to <folder>/<name>.csv. Creates the folder. tables: name -> rows."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        write_csv(Path(folder) / f"{name}.csv", rows)


def read_table(path: str | Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """The number of each line of a CSV file, and its values: column -> text.

    columns: those that it must have. Raises InputError, which names the line, if it is not such a table.
    """
    # newline=None: lines may end in \n, \r\n, or \r as in old Macintosh files.
    reader = csv.reader(io.StringIO(read_text(path), newline=None), skipinitialspace=True)
    try:
        names = [name.strip() for name in next(reader, [])]
        if missing := [name for name in columns if name not in names]:
            fix = f"The first line must name them: {','.join(columns)}."
            raise InputError(path, f"has no column {' and no '.join(missing)}", line=1, fix=fix)
        for values in reader:
            if values and len(values) != len(names):
                problem = f"the line must have {len(names)} values: {printable(', '.join(names))}"
                raise InputError(path, problem, line=reader.line_num)
            if values:
                yield reader.line_num, dict(zip(names, map(str.strip, values), strict=True))
    except csv.Error as error:
        fix = "Look for a quotation mark left open."
        raise InputError(path, f"not CSV: {error}", line=reader.line_num, fix=fix) from None


def read_numbers(path: str | Path) -> dict[str, list[float | None]]:
    """Read a CSV file of numbers, such as history.csv, as column -> values.

    The value of an empty, NaN or infinite cell is None. Raises InputError if there are no rows, or, with the
    line, if a line is not as long as the first or a cell is not a number.
    """
    found: dict[str, list[float | None]] = {}
    fix = "Delete the file and run again."
    for line, values in read_table(path, ()):
        for name, text in values.items():
            try:
                value = float(text or "nan")
            except ValueError as error:
                raise InputError(path, f"not a number: {printable(error)}", line=line, fix=fix) from None
            found.setdefault(name, []).append(value if math.isfinite(value) else None)
    if not found:
        raise InputError(path, "holds no numbers", fix=fix)
    return found


def to_base64(array: np.ndarray) -> str:
    """The little-endian bytes of an array as base64."""
    array = np.ascontiguousarray(array)
    return base64.b64encode(array.astype(array.dtype.newbyteorder("<")).tobytes()).decode("ascii")
