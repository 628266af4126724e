"""Lets a run read and write its locks while another run in the same folder ends.

A run of Snakemake that ends removes the whole folder of locks. Snakemake makes the folder only once, before
it plans, and reads the files in it later. If another run removes the folder in between, Snakemake without
this module ends with a FileNotFoundError.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from snakemake.persistence.file import FilePersistence

_write_once = FilePersistence._write_locks


def _read_locks(self: FilePersistence) -> Iterator[tuple[str, str]]:
    """Kind ("input" or "output") and path of each locked file. Lock files that are gone are left out."""
    for kind in ("input", "output"):
        for file in Path(self._lockdir).glob(f"*.{kind}.lock"):
            with suppress(FileNotFoundError):
                yield from [(kind, line) for line in file.read_text(encoding="utf-8").splitlines()]


def _write_locks(self: FilePersistence, kind: str, paths: Iterable[str]) -> None:
    """Write locks as Snakemake does, but make the folder first. If the folder is removed again, try again.

    Raises OSError if the locks cannot be written in eleven tries.
    """
    paths = list(paths)
    for _ in range(10):
        Path(self._lockdir).mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            return _write_once(self, kind, paths)
    return _write_once(self, kind, paths)


def use() -> None:
    """Make Snakemake read and write its locks with `_read_locks` and `_write_locks`."""
    persistence: Any = FilePersistence
    persistence._read_locks, persistence._write_locks = _read_locks, _write_locks
