"""Lets a run read and write its locks while another run in the same folder ends.

A run that ends removes the whole folder of locks. Snakemake lists that folder and then opens each file, and
it makes the folder only once, before it plans. A second run that was between the two ended with a
FileNotFoundError instead of doing its work.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from snakemake.persistence.file import FilePersistence

_write = FilePersistence._write_locks


def _read_locks(self: FilePersistence) -> Iterator[tuple[str, str]]:
    """Kind ("input" or "output") and path of each locked file. A lock file that is gone has none."""
    for kind in ("input", "output"):
        for file in Path(self._lockdir).glob(f"*.{kind}.lock"):
            with suppress(FileNotFoundError):
                yield from [(kind, line) for line in file.read_text(encoding="utf-8").splitlines()]


def _write_locks(self: FilePersistence, kind: str, paths: Iterable[str]) -> None:
    """Snakemake's own, in a folder that exists. Raises OSError if the folder goes each of ten times."""
    paths = list(paths)
    for _ in range(10):
        Path(self._lockdir).mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            return _write(self, kind, paths)
    return _write(self, kind, paths)


def use() -> None:
    """Let Snakemake lock with it."""
    persistence: Any = FilePersistence
    persistence._read_locks, persistence._write_locks = _read_locks, _write_locks
