"""Lets a run read and write its locks while another run in the same folder ends.

When a run of Snakemake ends, it removes the whole folder of lock files. A new run makes this folder once,
before it plans its jobs, and reads and writes the files in it later. If another run removes the folder in
between, the new run would end with a FileNotFoundError without this module.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from snakemake.persistence.file import FilePersistence

_snakemake_write_locks = FilePersistence._write_locks  # Snakemake's own method


def _read_locks(self: FilePersistence) -> Iterator[tuple[str, str]]:
    """Yield ("input" or "output", path) of each locked file. Lock files that are gone are left out."""
    for kind in ("input", "output"):
        for file in Path(self._lockdir).glob(f"*.{kind}.lock"):
            with suppress(FileNotFoundError):
                yield from [(kind, line) for line in file.read_text(encoding="utf-8").splitlines()]


def _write_locks(self: FilePersistence, kind: str, paths: Iterable[str]) -> None:
    """Write locks as Snakemake does, but make the folder first. If the folder is removed again, try again.

    kind: "input" or "output". paths: the files to lock. Raises FileNotFoundError if the folder was removed in
    all eleven tries.
    """
    paths = list(paths)
    for _ in range(10):
        Path(self._lockdir).mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            return _snakemake_write_locks(self, kind, paths)
    return _snakemake_write_locks(self, kind, paths)


def tolerate_removed_folder() -> None:
    """Make Snakemake read and write its locks with `_read_locks` and `_write_locks`."""
    persistence: Any = FilePersistence
    persistence._read_locks, persistence._write_locks = _read_locks, _write_locks
