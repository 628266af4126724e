"""Writes files completely or not at all, and reads text, YAML, JSON, CSV, npz and npy files with limits.

A file is written under a temporary name and then renamed. Files that are read may be damaged or hostile.
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
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
import yaml

from hobble.core.errors import HobbleError, InputError

Json = Mapping[str, Any]  # what a JSON file holds

MB = 1 << 20  # bytes
MAX_TEXT_BYTES = 64 * MB  # enough for a label file of ten minutes at 100 Hz with 1 kB for each frame
MAX_YAML_BYTES = 4 * MB  # enough for a data set of 20,000 clips with five keys each
MAX_YAML_DEPTH = 100  # levels of lists and mappings within each other
MAX_YAML_VALUES = 1_000_000  # in a file; so many take about 100 MB of memory
LONGEST_INTEGER = 40  # characters; Python refuses to print a number of more than 4,300 digits
MAX_JSON_BYTES = 1 << 30
# The compressed arrays of a file may together unpack to at most this. Hobble itself does not compress arrays.
MAX_INFLATED_BYTES = 1 << 30
_HOST = f"{zlib.crc32(platform.node().encode()):08x}"  # this machine, in the names of temporary files
DELETE_IT = "Delete it; the next run makes it again."
CHECKSUMS = "checksums"  # key of a JSON file
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
    except OSError as error:
        raise failed_write_error(error, path) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


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


def check_regular(path: str | Path) -> os.stat_result:
    """The stat result of a regular file, or of the file that a link points to.

    Raises InputError for a folder, a device or a pipe, because reading from a device or a pipe may never end.
    Raises OSError if there is no such file.
    """
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise InputError(
            path, "not a file" if stat.S_ISDIR(status.st_mode) else "a device or a pipe, not a file"
        )
    return status


def printable(text: object, most: int = 200) -> str:
    """Untrusted text, made safe for a terminal: one line, with "?" for each control character.

    After `most` characters it is cut off with "...".
    """
    plain = "".join(c if c.isprintable() else "?" for c in str(text)[: most + 1])
    return plain if len(plain) <= most else f"{plain[:most]}..."


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


def read_bytes(path: str | Path, most: int) -> bytes:
    """The content of a regular file of at most `most` bytes.

    Raises InputError if it is missing, unreadable, too large, or not a regular file, or if its size changes
    while it is read.
    """
    with reading(path, "cannot be read") as status, open(path, "rb") as file:
        if status.st_size > most:
            raise InputError(path, f"larger than {most / MB:g} MB, the limit for such a file")
        # read(n) allocates n bytes, so n is not `most` but the file's size, + 1 to see if it grew.
        data = file.read(status.st_size + 1)
        if len(data) != status.st_size:
            raise InputError(path, "its size changed while it was read", fix="Try again when it is complete.")
        return data
    raise AssertionError("not reached")


def read_text(path: str | Path, most: int = MAX_TEXT_BYTES) -> str:
    """The content of a UTF-8 text file, without a byte order mark.

    most: largest number of bytes. Raises InputError if the file is missing, too large or not UTF-8.
    """
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "not a text file in UTF-8") from None


def read_yaml(path: str | Path) -> Any:
    """The content of a YAML file as plain data.

    Raises InputError, with the line if it is known, for invalid YAML, tags that would create Python objects,
    aliases (`*name`, with which a small file can stand for a huge one), duplicate keys, integers of many
    digits, nesting deeper than MAX_YAML_DEPTH, and more than MAX_YAML_VALUES values.
    """
    text = read_text(path, MAX_YAML_BYTES)
    loader_class = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    loader = loader_class(text)
    try:
        _check_events(path, yaml.parse(text, loader_class))
        node = loader.get_single_node()
        if node is None:
            return None
        _check_node(path, node)
        return loader.construct_document(node)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise InputError(path, f"not valid YAML: {error.problem}", line=line) from None
    except (yaml.YAMLError, ValueError) as error:  # ValueError: a date such as 2001-99-99
        raise InputError(path, f"not valid YAML: {printable(error)}") from None


def _check_events(path: str | Path, events: Iterable[yaml.Event]) -> None:
    """Check what could use up the memory, or crash libyaml, which recurses into lists and mappings."""
    depth = 0
    for number, event in enumerate(events):
        line = event.start_mark.line + 1 if event.start_mark else None
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_YAML_DEPTH:
            raise InputError(path, f"nested deeper than {MAX_YAML_DEPTH} levels", line=line)
        if number > MAX_YAML_VALUES:
            raise InputError(path, f"has more than {MAX_YAML_VALUES} values")
        if isinstance(event, yaml.AliasEvent):
            problem, fix = f"*{event.anchor:.40} is an alias", "Write out what it stands for."
            raise InputError(path, problem, line=line, fix=fix)


def _check_node(path: str | Path, node: yaml.Node) -> None:
    """Raise InputError for a duplicate key, of which YAML's loader would take the last, or a huge integer."""
    line = node.start_mark.line + 1
    if node.tag == "tag:yaml.org,2002:int" and len(node.value) > LONGEST_INTEGER:
        raise InputError(path, f"an integer of {len(node.value)} characters", line=line)
    lines: dict[tuple[str, str], int] = {}  # (type, text) of a key -> its line, from 1
    for child in node.value if isinstance(node.value, list) else ():
        parts = child if isinstance(child, tuple) else (child,)  # a key and its value, or an item
        for part in parts:
            _check_node(path, part)
        if len(parts) == 2 and isinstance(parts[0].value, str):
            name, line = (parts[0].tag, parts[0].value), parts[0].start_mark.line + 1
            if name in lines:
                problem = f"the key {name[1]:.80} is given twice, first in line {lines[name]}"
                raise InputError(path, problem, line=line, fix="Keep one of them.")
            lines[name] = line


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
        value = json.loads(read_text(path, MAX_JSON_BYTES), parse_constant=_finite, parse_float=_finite)
    except json.JSONDecodeError as error:
        raise InputError(path, f"not valid JSON: {error.msg}", line=error.lineno, fix=fix) from error
    except (RecursionError, ValueError) as error:
        raise InputError(path, f"not valid JSON: {error}", fix=fix) from error
    checksum = value.pop(CHECKSUMS, None) if isinstance(value, dict) else None
    if checksum is not None and checksum != _json_checksum(value):
        raise InputError(path, "was changed after it was written", fix=fix)
    return value


def _finite(word: str) -> float:
    """The number; not NaN, Infinity, or one that is too large for a float."""
    if not math.isfinite(value := float(word)):
        raise ValueError(f"{word} is not a number")
    return value


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


def check_archive(path: str | Path, archive: zipfile.ZipFile) -> None:
    """Raise ValueError or BadZipFile if an archive's list of files is damaged or claims too much data.

    All entries together may not be larger than the file. They are larger if several entries share the same
    bytes. Compressed entries may not unpack to more than MAX_INFLATED_BYTES.
    """
    entries = archive.infolist()
    with open(path, "rb") as file:
        # The end record has 22 bytes, with the number of files at byte 10, and then the archive's comment.
        # zipfile does not check this number.
        file.seek(-22 - len(archive.comment), os.SEEK_END)
        (count,) = struct.unpack("<10xH10x", file.read(22))
    if count != len(entries):
        raise zipfile.BadZipFile("its list of files has lost an entry")
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
        major, minor = np.lib.format.read_magic(file)  # version of the npy format
        shape, by_columns, dtype = getattr(np.lib.format, f"read_array_header_{major}_{minor}")(file)
    except OSError:
        raise
    except (Exception, MemoryError):  # Python raises MemoryError for a header that is nested too deeply
        raise ValueError("the header of an array cannot be understood") from None
    size -= file.tell()
    if dtype.hasobject or min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != size:
        raise ValueError("an array has another size than its header says, or holds Python objects")
    return shape, by_columns, dtype


def write_tables(folder: str | Path, tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Write each table to <folder>/<name>.csv, with a header and a line for each row. Creates the folder.

    tables: name -> rows. Columns are in the order in which they first occur. A field is empty if its value is
    missing, None or NaN. Without rows, the file is empty.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        out = io.StringIO()
        writer = csv.DictWriter(out, dict.fromkeys(key for row in rows for key in row), lineterminator="\n")
        if rows:
            writer.writeheader()
        writer.writerows({key: value for key, value in row.items() if value == value} for row in rows)
        write_text(Path(folder) / f"{name}.csv", out.getvalue())


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
