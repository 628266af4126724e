"""Owners of locks, and jobs that end with their run."""

from __future__ import annotations

import json
import os
import platform
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hobble.workflow import lifetime

JOB = """
import os, time
from types import SimpleNamespace
from hobble.workflow.job import job
with job(SimpleNamespace(log=[{log!r}], rule="stage")):
    print("begun", flush=True)
    {work}
"""


@pytest.fixture
def locks(tmp_path: Path) -> Path:
    """A lock that this process has taken."""
    folder = tmp_path / ".snakemake/locks"
    folder.mkdir(parents=True)
    (folder / "0.output.lock").write_text("results/a\n")
    lifetime.record_lock_owner(folder)
    return folder


def owned_by(locks: Path, **changed: object) -> None:
    owner = json.loads((locks / lifetime.OWNER).read_text())
    (locks / lifetime.OWNER).write_text(json.dumps(owner | changed))


def ended() -> int:
    """The id of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_the_lock_of_a_living_run_stays(locks: Path) -> None:
    assert not lifetime.clear_stale_lock(locks)
    assert (locks / "0.output.lock").is_file()


def test_the_lock_of_a_dead_run_is_removed(locks: Path) -> None:
    owned_by(locks, pid=ended())
    assert lifetime.clear_stale_lock(locks)
    assert list(locks.iterdir()) == []
    assert [path.name for path in locks.parent.iterdir()] == ["locks"]


def test_the_file_of_the_owner_is_never_seen_half_written(
    locks: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that is killed while it writes leaves no file. An empty one could never be cleared."""
    (locks / lifetime.OWNER).unlink()
    write = Path.write_text

    def interrupted(path: Path, text: str, **options: str) -> int:
        write(path, text[:9], **options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_text", interrupted)
        with pytest.raises(KeyboardInterrupt):
            lifetime.record_lock_owner(locks)
    assert not (locks / lifetime.OWNER).exists()
    lifetime.record_lock_owner(locks)
    owned_by(locks, pid=ended())
    assert lifetime.clear_stale_lock(locks)
    assert list(locks.iterdir()) == []


def test_a_new_process_with_the_same_id_does_not_own_the_lock(locks: Path) -> None:
    owned_by(locks, began="1")
    assert lifetime.clear_stale_lock(locks)


def test_a_lock_of_another_machine_stays(locks: Path) -> None:
    owned_by(locks, host=f"not-{platform.node()}", pid=ended())
    assert not lifetime.clear_stale_lock(locks)


@pytest.mark.parametrize("text", ["", "{}", "[]", "not json", '{"host": 1, "pid": "x", "began": 2}'])
def test_a_lock_without_an_owner_stays(locks: Path, text: str) -> None:
    (locks / lifetime.OWNER).write_text(text)
    assert not lifetime.clear_stale_lock(locks)
    (locks / lifetime.OWNER).unlink()
    assert not lifetime.clear_stale_lock(locks)
    assert (locks / "0.output.lock").is_file()


def started(tmp_path: Path, work: str, run: int) -> subprocess.Popen[str]:
    """A job of the run with that process id, after its work has begun."""
    script = JOB.format(log=str(tmp_path / "job.log"), work=work)
    environment = {**os.environ, lifetime.RUN_VARIABLE: f"{run} {lifetime._start_time(run)}"}
    command = [sys.executable, "-c", script]
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    process = subprocess.Popen(command, env=environment, **piped)
    assert process.stdout.readline() == "begun\n"
    return process


DEAF = "while True:\n        try: time.sleep(60)\n        except BaseException: pass"


@pytest.mark.parametrize(
    ("work", "status"),
    [("time.sleep(60)", 128 + signal.SIGTERM), (DEAF, -signal.SIGKILL)],
    ids=["willing", "deaf"],
)
def test_a_job_ends_soon_after_its_run(tmp_path: Path, work: str, status: int) -> None:
    run = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    process = started(tmp_path, work, run.pid)
    assert process.poll() is None
    run.kill()  # not waited for, because a zombie does not count as a run either
    before = time.monotonic()
    assert process.wait(timeout=10) == status
    assert time.monotonic() - before < 5
    assert process.stdout.read() == ""
    run.wait()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_job_cleans_up_silently(tmp_path: Path, number: signal.Signals) -> None:
    path = str(tmp_path / "out.txt")
    work = f"""
    from hobble.core.files import atomic_path
    with atomic_path({path!r}) as part:
        part.write_text("half")
        print("begun", flush=True)
        time.sleep(60)"""
    process = started(tmp_path, work, os.getpid())
    assert process.stdout.readline() == "begun\n"
    process.send_signal(number)
    assert process.wait(timeout=10) == 128 + number
    assert process.stdout.read() == ""
    assert [file.name for file in tmp_path.iterdir()] == ["job.log"]


def test_a_second_signal_does_not_end_the_clean_up(tmp_path: Path) -> None:
    """Ctrl-C reaches a job twice: from the terminal, and from Snakemake, which ends its jobs."""
    work = """
    try:
        print("begun", flush=True)
        time.sleep(60)
    finally:
        print("cleaning", flush=True)
        time.sleep(1)
        print("cleaned", flush=True)"""
    process = started(tmp_path, work, os.getpid())
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "cleaning\n"
    for number in (signal.SIGTERM, signal.SIGINT):
        process.send_signal(number)
    assert process.stdout.read() == "cleaned\n"
    assert process.wait(timeout=10) == 128 + signal.SIGINT
