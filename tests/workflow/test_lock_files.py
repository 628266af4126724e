"""Locks while another run in the same folder ends and removes them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import snakemake.api  # noqa: F401 - the first import of Snakemake: its other modules import each other
from snakemake.persistence.file import FilePersistence

from hobble.workflow import lock_files


class Locks(FilePersistence):  # type: ignore[misc]
    """The locks of one run, without a workflow."""

    def __init__(self, folder: Path) -> None:
        self._lockdir, self._lockfile = str(folder), {}


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Locks, Locks]:
    """Two runs in one folder."""
    for name in ("_read_locks", "_write_locks"):
        monkeypatch.setattr(FilePersistence, name, getattr(FilePersistence, name))
    lock_files.tolerate_removed_folder()
    return Locks(tmp_path / "locks"), Locks(tmp_path / "locks")


def test_another_run_reads_what_one_locked(runs: tuple[Locks, Locks]) -> None:
    runs[0]._write_locks("input", ["a.bvh", "b c.bvh"])
    runs[0]._write_locks("output", ["a.npz"])
    assert list(runs[1]._read_locks()) == [("input", "a.bvh"), ("input", "b c.bvh"), ("output", "a.npz")]


def test_a_run_locks_after_another_removed_the_folder(runs: tuple[Locks, Locks]) -> None:
    runs[0]._write_locks("output", ["a.npz"])
    runs[0]._delete_locks()
    runs[1]._write_locks("output", ["b.npz"])
    assert list(runs[0]._read_locks()) == [("output", "b.npz")]


def test_a_lock_may_disappear_while_another_run_reads_it(
    runs: tuple[Locks, Locks], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a.npz", "b.npz"):
        runs[0]._write_locks("output", [name])
    read = Path.read_text

    def read_then_remove(path: Path, encoding: str) -> str:
        text = read(path, encoding)
        shutil.rmtree(path.parent, ignore_errors=True)
        return text

    monkeypatch.setattr(Path, "read_text", read_then_remove)
    assert len(list(runs[1]._read_locks())) == 1
