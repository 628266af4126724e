"""Checksums of the files that jobs write, so that the next job notices a damaged or changed file.

An npz file and a chunk of a database contain a checksum. For all other files, the job that makes a file
writes its checksum to results/<configuration>/checksums/ or results/datasets/<dataset>/checksums/. Each job
that reads the file verifies this checksum.
"""

from __future__ import annotations

import hashlib
import os
import time
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import write_text

OWN_CHECKSUM = {".npz"}  # suffixes of files that contain a checksum
BLOCK_BYTES = 1 << 20  # bytes of a file that are read at once
CLOCK_TICK = 0.02  # seconds; two writes that are this far apart get different modification times

# Modification time (ns), size (bytes) and inode of a file. If the file is changed or replaced, its stamp
# changes, too.
Stamp = tuple[int, int, int]


def checksum_path(path: Path) -> Path | None:
    """The path of a file's checksum file. None for files without one, such as an npz or a user's clip."""
    parts = path.parts
    if "results" not in parts:
        return None
    # Numbers of leading parts of the path: up to the last folder called results, and up to the folder of the
    # configuration or data set.
    to_results = len(parts) - parts[::-1].index("results")
    to_folder = to_results + (2 if parts[to_results : to_results + 1] == ("datasets",) else 1)
    if len(parts) <= to_folder or path.suffix in OWN_CHECKSUM:
        return None
    return Path(*parts[:to_folder], "checksums", *parts[to_folder:-1], f"{path.name}.crc32")


def delete(paths: Iterable[str]) -> None:
    """Delete the checksums of files that are about to be made again."""
    for checksum_file in filter(None, map(checksum_path, map(Path, paths))):
        checksum_file.unlink(missing_ok=True)


def record(paths: Iterable[str]) -> None:
    """Write the checksums of finished files and folders.

    The checksum file of a folder holds the checksums of the files directly in it.
    """
    for path in map(Path, paths):
        if (checksum_file := checksum_path(path)) is not None and path.exists():
            lines = [f"{_checksum(file):08x} {file.name}" for file in _files(path)]
            write_text(checksum_file, "\n".join(lines) + "\n")


def verify(paths: Iterable[str]) -> None:
    """Raise InputError for a file that differs from what its job wrote.

    A file without a recorded checksum is not checked.
    """
    for path in map(Path, paths):
        checksum_file = checksum_path(path)
        if checksum_file is None or not checksum_file.is_file() or not path.exists():
            continue
        lines = checksum_file.read_text(encoding="utf-8", errors="replace").splitlines()
        recorded = {name: checksum for checksum, _, name in (line.partition(" ") for line in lines)}
        for file in _files(path):
            if recorded.get(file.name) != f"{_checksum(file):08x}":
                raise InputError(
                    file,
                    "damaged or changed: it differs from what its job wrote",
                    fix="Delete it; the next run makes it again. "
                    f"To keep your change, delete {checksum_file}.",
                )


def stamps(paths: Iterable[str]) -> Mapping[str, Stamp]:
    """Path -> stamp, for those of the files that exist."""
    out = {}
    for path in map(str, paths):
        if os.path.isfile(path):
            # Wait if the file was written just now, because another write could get the same time.
            if 0 <= time.time() - os.stat(path).st_mtime < CLOCK_TICK:
                time.sleep(CLOCK_TICK)
            status = os.stat(path)
            out[path] = (status.st_mtime_ns, status.st_size, status.st_ino)
    return out


def check_unchanged(before: Mapping[str, Stamp]) -> None:
    """Raise InputError for a file that was changed, replaced or deleted since `stamps` returned `before`."""
    now = stamps(before)
    for path, stamp in before.items():
        if now.get(path) != stamp:
            raise InputError(path, "changed while it was being read", fix="Run the same command again.")


def _files(path: Path) -> list[Path]:
    """The file itself in a list, or the files in a folder, except hidden ones, which are Snakemake's."""
    if not path.is_dir():
        return [path]
    return sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith("."))


def file_crc32(path: Path) -> int:
    """CRC-32 of a file. Raises OSError if it cannot be read."""
    crc = 0
    with open(path, "rb") as file:
        while block := file.read(BLOCK_BYTES):
            crc = zlib.crc32(block, crc)
    return crc


def file_sha256(path: str | Path) -> str:
    """SHA-256 of a file. Raises OSError if it cannot be read."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _checksum(path: Path) -> int:
    """CRC-32 of a file. Raises InputError if it cannot be read."""
    try:
        return file_crc32(path)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
