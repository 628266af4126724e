"""The lock of a folder, and jobs that end with their run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow import lifetime

JOB = """
import os, time
from types import SimpleNamespace
from hobble.workflow.job import job
with job(SimpleNamespace(log=[{log!r}], rule="stage")):
    print("begun", flush=True)
    {work}
"""


def test_only_one_run_works_in_a_folder_and_its_lock_ends_with_it(tmp_path: Path) -> None:
    path = tmp_path / ".snakemake/run.lock"
    holds = f"""
import sys, time
from pathlib import Path
from hobble.workflow.lifetime import lock
lock(Path({str(path)!r}))
print("begun", flush=True)
time.sleep(60)"""
    run = subprocess.Popen([sys.executable, "-c", holds], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    assert run.stdout.readline() == "begun\n"
    with pytest.raises(HobbleError, match="cannot be locked, because another run of Snakemake is at work"):
        lifetime.lock(path)
    run.kill()
    run.wait()
    lifetime.lock(path)


def test_a_user_without_a_name_gets_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def nameless() -> str:
        raise KeyError("getpwuid(): uid not found")

    monkeypatch.setattr(lifetime.getpass, "getuser", nameless)
    monkeypatch.setenv("USER", "somebody")
    lifetime.ensure_user_name()
    assert os.environ["USER"] == str(os.getuid())


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


def test_a_stopped_job_cleans_up_silently_even_if_it_is_told_twice(tmp_path: Path) -> None:
    """Ctrl-C reaches a job twice: from the terminal, and from Snakemake, which ends its jobs."""
    path = str(tmp_path / "out.txt")
    work = f"""
    from hobble.core.files import atomic_path
    with atomic_path({path!r}) as part:
        part.write_text("half")
        try:
            print("begun", flush=True)
            time.sleep(60)
        finally:
            print("cleaning", flush=True)
            time.sleep(1)"""
    process = started(tmp_path, work, os.getpid())
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "cleaning\n"
    for again in (signal.SIGTERM, signal.SIGINT):
        process.send_signal(again)
    assert process.wait(timeout=10) == 128 + signal.SIGINT
    assert process.stdout.read() == ""
    assert [file.name for file in tmp_path.iterdir()] == ["job.log"]
