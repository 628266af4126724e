"""Runs stopped by Ctrl-C, by a signal to Snakemake alone, or by SIGKILL. The same command continues."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import psutil
import pytest

from tests.faults.same import same

pytestmark = pytest.mark.workflow

WEIGHTS = "results/test/network/weights.npz"
LIMIT = 120  # seconds within which a job must have begun


def started(workflow, *arguments: str, until: Callable[[], object]) -> subprocess.Popen[bytes]:
    """Start the command, wait until `until` is true, and return it, to be stopped there."""
    process = workflow.start(*arguments, said=workflow.folder / "said.txt")
    deadline = time.monotonic() + LIMIT
    while not until() and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.005)
    assert process.poll() is None, (workflow.folder / "said.txt").read_text()
    return process


def without_network(workflow) -> Callable[[], object]:
    """Delete the network so that it is trained again. Returns a check that its training has begun."""
    for part in ("network", "checkpoints"):
        shutil.rmtree(workflow.folder / "results/test" / part)
    return lambda: list(workflow.folder.glob("results/test/checkpoints/*/*.npz"))


def jobs_of(process: subprocess.Popen[bytes]) -> list[psutil.Process]:
    return psutil.Process(process.pid).children(recursive=True)


def running(jobs: list[psutil.Process]) -> list[psutil.Process]:
    return [job for job in jobs if job.is_running() and job.status() != psutil.STATUS_ZOMBIE]


def ended(jobs: list[psutil.Process], within: float) -> bool:
    deadline = time.monotonic() + within
    while running(jobs) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not running(jobs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "to_all"), [(signal.SIGINT, True), (signal.SIGTERM, False), (signal.SIGKILL, False)]
)
def test_jobs_end_with_their_run_and_the_same_command_gives_the_same_bits(
    finished, copied, number: signal.Signals, to_all: bool
) -> None:
    process = started(copied, "-c2", WEIGHTS, until=without_network(copied))
    jobs = jobs_of(process)
    assert running(jobs)
    (os.killpg if to_all else os.kill)(process.pid, number)
    assert ended(jobs, within=5)
    assert process.wait(timeout=20) == (-signal.SIGKILL if number == signal.SIGKILL else 1)
    assert "Traceback" not in (copied.folder / "said.txt").read_text()
    copied.run("-c2", WEIGHTS)
    assert same(finished.folder / WEIGHTS, copied.folder / WEIGHTS)
    if number != signal.SIGKILL:
        assert not list(copied.folder.rglob("*.part"))


def test_ctrl_c_ends_all_jobs_at_once_and_leaves_no_lock(workflow) -> None:
    target = "results/datasets/tiny/terrain/patches.npz"
    process = started(workflow, "-c2", target, until=lambda: list(workflow.folder.glob("results/**/*.log")))
    jobs = jobs_of(process)
    for job in jobs:
        job.suspend()
    assert "cannot be locked" in workflow.run("-c2", target, ok=False)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(timeout=20) == 1  # jobs that ignore signals are killed
    assert not running(jobs)
    assert not (workflow.folder / target).exists()
    lock = str(workflow.folder / ".snakemake/run.lock")
    subprocess.run(["flock", "--nonblock", lock, "true"], check=True)


KILLED_AT = """
import os, signal, sys
left = int(sys.argv.pop(1))

def count(event, arguments):
    global left
    in_folder = event in ("open", "os.mkdir", "os.rename", "os.remove") and ".snakemake" in str(arguments[0])
    if in_folder or event == "fcntl.flock":
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

sys.addaudithook(count)
from snakemake.cli import main
main(sys.argv[1:])
"""


@pytest.mark.slow
def test_a_kill_at_any_step_before_the_first_job_leaves_no_lock(workflow) -> None:
    """It is killed at its first steps in its folder, then at each sixth, until one run gets past all."""
    target, step, status = "results/datasets/tiny/terrain/patches.npz", 0, -signal.SIGKILL
    while status == -signal.SIGKILL:
        step += 1 if step < 6 else 6
        command = [sys.executable, "-c", KILLED_AT, str(step), "-c1", target]
        done = subprocess.run(command, **workflow.how(), capture_output=True)
        status = done.returncode
        lock = workflow.folder / ".snakemake/run.lock"
        if lock.exists():
            subprocess.run(["flock", "--nonblock", str(lock), "true"], check=True)
        if (workflow.folder / target).exists():
            break
    assert step > 5
    assert "Nothing to be done" in workflow.run("-c1", target)
