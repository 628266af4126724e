"""Who a run's lock belongs to, and that no job outlives the Snakemake that started it.

Snakemake's lock says nothing of its owner, so that after a kill it stays until a person clears it; and on
SIGINT or SIGTERM Snakemake waits for the jobs that run. So a run notes beside its lock which process it is,
ends its jobs when it is told to end, and each job looks now and then whether its run is still there.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import shutil
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

LOCKS = Path(".snakemake/locks")  # Snakemake removes the folder when it unlocks
OWNER = "owner.json"
RUN_VARIABLE = "HOBBLE_RUN"  # in a job's environment: the process of its run, and when that began
CHECK_SECONDS = 0.5  # seconds between a job's looks at its run
GRACE_SECONDS = 2.0  # seconds that a job has for tidying up after SIGTERM


def set_run_variable() -> None:
    """Say in the environment, which jobs inherit, which process the run is."""
    os.environ[RUN_VARIABLE] = this_process()


def this_process() -> str:
    """This process as `RUN_VARIABLE` names one: its number, and when it began."""
    return f"{os.getpid()} {_start_time(os.getpid())}"


def record_lock_owner(locks: Path = LOCKS) -> None:
    """Note beside the lock that Snakemake has just taken whose it is."""
    if locks.is_dir():
        owner = {"host": platform.node(), "pid": os.getpid(), "began": _start_time(os.getpid())}
        with contextlib.suppress(OSError):
            (locks / OWNER).write_text(json.dumps(owner), encoding="utf-8")


def clear_stale_lock(locks: Path = LOCKS) -> bool:
    """Take away a lock whose owner was a process of this machine and is no more; True where there was one."""
    try:
        text = (locks / OWNER).read_text(encoding="utf-8")
        owner = json.loads(text)
        host, pid, began = owner["host"], int(owner["pid"]), str(owner["began"])
    except (OSError, ValueError, TypeError, KeyError):
        return False
    if host != platform.node() or _is_alive(pid, began):
        return False
    # Renamed first, so that of two runs that begin at once only one takes it away.
    stale = locks.with_name(f"{locks.name}.stale.{os.getpid()}")
    try:
        os.rename(locks, stale)
        mine = (stale / OWNER).read_text(encoding="utf-8") == text
        if mine:
            locks.mkdir(exist_ok=True)
            shutil.rmtree(stale, ignore_errors=True)
        else:
            os.rename(stale, locks)
        return mine
    except OSError:
        return False


def end_jobs_on_signal() -> None:
    """On SIGINT or SIGTERM end the jobs that run, and then Snakemake as by Ctrl-C: with no lock left."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)


def _stop(number: int, frame: FrameType | None) -> None:
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)  # once is enough: what follows takes seconds at most
    threading.Thread(target=end_children, args=(os.getpid(),), daemon=True).start()
    raise KeyboardInterrupt


def end_children(pid: int, grace: float = GRACE_SECONDS) -> None:
    """End every process below one: SIGTERM, and SIGKILL for those still there after `grace` seconds."""
    import psutil  # which Snakemake needs too; it takes longer to import than all of a job's frame

    with contextlib.suppress(psutil.NoSuchProcess):
        below = psutil.Process(pid).children(recursive=True)
        for process in below:
            with contextlib.suppress(psutil.Error):
                process.terminate()
        until = time.monotonic() + grace
        while time.monotonic() < until and any(map(_runs, below)):
            time.sleep(0.05)
        for process in filter(_runs, below):
            with contextlib.suppress(psutil.Error):
                process.kill()


def _runs(process: Any) -> bool:
    import psutil

    with contextlib.suppress(psutil.Error):
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    return False


@contextlib.contextmanager
def ends_with_run() -> Iterator[None]:
    """While it lasts, this job ends tidily on SIGINT and SIGTERM, and soon after its run."""
    before = {}
    with contextlib.suppress(ValueError):  # not in the main thread, as in a test
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, _exit)
    done = threading.Event()
    if run := os.environ.get(RUN_VARIABLE):
        threading.Thread(target=_exit_with_run, args=(run, done), daemon=True).start()
    try:
        yield
    finally:
        done.set()
        for number, handler in before.items():
            signal.signal(number, handler)


def _exit(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)  # past every `except Exception`, through every `finally`


def _exit_with_run(run: str, done: threading.Event) -> None:
    """End this process when its run is no more; by SIGKILL where compiled code lets no signal through."""
    pid, _, began = run.partition(" ")
    while not done.wait(CHECK_SECONDS):
        if not _is_alive(int(pid), began):
            os.kill(os.getpid(), signal.SIGTERM)
            if not done.wait(GRACE_SECONDS):
                os.kill(os.getpid(), signal.SIGKILL)


def _is_alive(pid: int, began: str) -> bool:
    """Whether process `pid` runs and is the one that began then, as another may bear its number by now."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True  # another user's
    return _start_time(pid) == began


def _start_time(pid: int) -> str:
    """When a process began, in ticks since the machine did; "" for a zombie, "?" where no /proc tells."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "?"
    return "" if fields[0] == "Z" else fields[19]
