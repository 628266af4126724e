"""The context of a job's script: its log, what a user sees when it fails, and that it ends with its run."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hobble.workflow import lifetime

SCRIPT = """
import os, time
from types import SimpleNamespace
from hobble.core.errors import InputError
from hobble.core.files import atomic_path
from hobble.workflow.job import job
with job(SimpleNamespace(log=[{log!r}], rule="stage")) as log:
    log.info("words for the log")
    print("begun", flush=True)
    {work}
"""


def started(log: str | Path, work: str, run: int | None = None) -> subprocess.Popen[str]:
    """A job of the run with that process id, after its work has begun."""
    environment = os.environ | ({lifetime.RUN_VARIABLE: str(run)} if run else {})
    command = [sys.executable, "-c", SCRIPT.format(log=str(log), work=work)]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, env=environment, stdout=pipe, stderr=subprocess.STDOUT, text=True)
    assert process.stdout.readline() == "begun\n"
    return process


def ended(log: str | Path, work: str, run: int | None = None) -> tuple[int, str]:
    """Status and output of a job."""
    process = started(log, work, run)
    return process.wait(), process.stdout.read().strip()


@pytest.mark.parametrize("log", ["/dev/full", "/proc/nowhere/job.log"])
def test_a_job_continues_even_if_the_log_cannot_be_written(log: str) -> None:
    assert ended(log, "print('done')") == (0, "done")
    assert ended(log, "raise InputError('clip.bvh', 'is torn')") == (1, "stage: clip.bvh: is torn.")


def test_an_error_is_one_line_and_its_traceback_is_in_the_log(tmp_path: Path) -> None:
    path = tmp_path / "logs/job.log"
    for work, message in {
        "open('/proc/1/nowhere')": "stage: /proc/1/nowhere: No such file or directory. See ",
        "{}['left knee']": "stage: KeyError: 'left knee'. This is a bug in Hobble",
    }.items():
        status, said = ended(path, work)
        assert status == 1
        assert said.startswith(message)
        assert "\n" not in said
        assert "words for the log" in path.read_text()
        assert "Traceback" in path.read_text()


DEAF = "while True:\n        try: time.sleep(60)\n        except BaseException: pass"


def test_a_job_that_ignores_signals_ends_soon_after_its_run(tmp_path: Path) -> None:
    run = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    process = started(tmp_path / "job.log", DEAF, run.pid)
    assert process.poll() is None
    run.kill()  # not waited for, because a zombie does not count as a run either
    assert process.wait(timeout=5) == -signal.SIGKILL
    assert process.stdout.read() == ""
    run.wait()


def test_a_job_goes_on_while_the_clock_is_set(tmp_path: Path) -> None:
    clock = "import psutil; psutil._psplatform.boot_time = time.time; time.sleep(2); print('done')"
    assert ended(tmp_path / "job.log", clock, os.getpid()) == (0, "done")


def test_a_stopped_job_cleans_up_silently_even_if_it_is_told_twice(tmp_path: Path) -> None:
    """Ctrl-C reaches a job twice: from the terminal, and from Snakemake, which ends its jobs."""
    work = f"""
    with atomic_path({str(tmp_path / "out.txt")!r}) as part:
        part.write_text("half")
        try:
            print("writing", flush=True)
            time.sleep(60)
        finally:
            print("cleaning", flush=True)
            time.sleep(1)"""
    process = started(tmp_path / "job.log", work, os.getpid())
    assert process.stdout.readline() == "writing\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "cleaning\n"
    for again in (signal.SIGTERM, signal.SIGINT):
        process.send_signal(again)
    assert process.wait(timeout=10) == 128 + signal.SIGINT
    assert process.stdout.read() == ""
    assert [file.name for file in tmp_path.iterdir()] == ["job.log"]
