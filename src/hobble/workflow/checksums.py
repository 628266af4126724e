"""Checksums of the files that jobs write, so that the next job notices a damaged or changed file.

An npz and the chunks of a database have checksums of their own. For all other files every job writes
checksums to results/<configuration>/checksums/ or results/datasets/<dataset>/checksums/, and every job that
reads such a file verifies them.
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
CLOCK_TICK = 0.02  # seconds; writes that are this far apart get different file times

Stamp = tuple[int, int, int]  # modification time, size and inode of a file


def record_of(path: Path) -> Path | None:
    """The path of a file's checksum file. None for files without one, such as an npz or a user's clip."""
    parts = path.parts
    if "results" not in parts:
        return None
    results = len(parts) - parts[::-1].index("results")
    root = results + (2 if parts[results : results + 1] == ("datasets",) else 1)
    if len(parts) <= root or path.suffix in OWN_CHECKSUM:
        return None
    return Path(*parts[:root], "checksums", *parts[root:-1], f"{path.name}.crc32")


def forget(paths: Iterable[str]) -> None:
    """Delete the checksums of files that are about to be made again."""
    for checksum_file in filter(None, map(record_of, map(Path, paths))):
        checksum_file.unlink(missing_ok=True)


def record(paths: Iterable[str]) -> None:
    """Write the checksums of finished files. For a folder, those of the files directly in it."""
    for path in map(Path, paths):
        if (where := record_of(path)) is not None and path.exists():
            lines = [f"{_checksum(file):08x} {file.name}" for file in _files(path)]
            write_text(where, "\n".join(lines) + "\n")


def verify(paths: Iterable[str]) -> None:
    """Raise InputError for a file that differs from what its job wrote. Files without checksums pass."""
    for path in map(Path, paths):
        where = record_of(path)
        if where is None or not where.is_file() or not path.exists():
            continue
        lines = where.read_text(encoding="utf-8", errors="replace").splitlines()
        recorded = {name: checksum for checksum, _, name in (line.partition(" ") for line in lines)}
        for file in _files(path):
            if recorded.get(file.name) != f"{_checksum(file):08x}":
                raise InputError(
                    file,
                    "damaged or changed: it differs from what its job wrote",
                    fix=f"Delete it; the next run makes it again. To keep your change, delete {where}.",
                )


def stamps(paths: Iterable[str]) -> Mapping[str, Stamp]:
    """The stamp of each file that exists."""
    out = {}
    for path in map(str, paths):
        if os.path.isfile(path):
            if 0 <= time.time() - os.stat(path).st_mtime < CLOCK_TICK:
                time.sleep(CLOCK_TICK)  # a write right after this could get the same time
            status = os.stat(path)
            out[path] = (status.st_mtime_ns, status.st_size, status.st_ino)
    return out


def check_unchanged(before: Mapping[str, Stamp]) -> None:
    """Raise InputError for a file that was written, replaced or deleted since `stamps` returned `before`."""
    now = stamps(before)
    for path, stamp in before.items():
        if now.get(path) != stamp:
            raise InputError(path, "changed while it was being read", fix="Run the same command again.")


def _files(path: Path) -> list[Path]:
    """The file itself, or the files in the folder. Hidden files are left out: they are Snakemake's."""
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
    try:
        return file_crc32(path)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
