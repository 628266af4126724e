"""Locks the folder of a run, and ends all jobs together with their run. A run is one call of Snakemake.

Snakemake's own lock (version 9.27) stays after a kill until a person removes it, so the profiles turn it off
and `lock` takes one that the system releases. After SIGINT or SIGTERM, Snakemake waits for running jobs, so a
run ends its jobs on these signals. And each job checks regularly whether its run still exists.
"""

import contextlib
import fcntl
import getpass
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

import psutil

from hobble.core.errors import HobbleError, InputError

LOCK = Path(".snakemake/run.lock")
RUN_VARIABLE = "HOBBLE_RUN_PID"  # environment variable of a job: the process id of its run
CHECK_SECONDS = 0.5  # time between two checks of a job that its run exists
GRACE_SECONDS = 2.0  # time for a job to clean up after SIGTERM


def set_run_variable() -> None:
    """Put the id of this run's process into the environment, which jobs inherit."""
    os.environ[RUN_VARIABLE] = str(os.getpid())


def ensure_user_name() -> None:
    """If the user has no name, as in a container, set the variable USER to the user's id.

    Snakemake and PyTorch need a user name. Jobs inherit the variable.
    """
    try:
        getpass.getuser()
    except (KeyError, OSError):  # Python 3.13 raises OSError
        os.environ["USER"] = str(os.getuid())


def check_writable(path: Path = LOCK) -> int:
    """Open the file of the lock. It stays open, and jobs do not inherit it. Returns its number.

    Raises InputError if the folder of the run cannot be written, where Snakemake would print a traceback.
    """
    try:
        path.parent.mkdir(exist_ok=True)
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        fix = "Work in a folder of your own (--directory FOLDER), or ask the owner for permission."
        raise InputError(path.parent, f"cannot be written: {error.strerror}", fix=fix) from None


def lock(path: Path = LOCK) -> None:
    """Let only one run work in this folder at a time. The lock ends with this process, however it ends.

    Raises HobbleError if another run has the lock, and InputError if the folder cannot be written.
    """
    handle = check_writable(path)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise HobbleError(
            "This folder cannot be locked, because another run of Snakemake is at work in it. "
            "Wait until it has ended."
        ) from None
    except OSError:  # a file system without locks
        return


def end_jobs_on_signal() -> None:
    """On SIGINT or SIGTERM, end the running jobs and interrupt Snakemake, which then removes its lock."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop_run)


def _stop_run(number: int, frame: FrameType | None) -> None:
    """Signal handler of a run: end its jobs and raise KeyboardInterrupt."""
    for caught in (signal.SIGINT, signal.SIGTERM):
        signal.signal(caught, signal.SIG_IGN)  # ignore further signals; stopping takes only seconds
    threading.Thread(target=end_children, args=(os.getpid(),), daemon=True).start()
    raise KeyboardInterrupt


def end_children(pid: int, grace: float = GRACE_SECONDS) -> None:
    """End all descendants of process `pid` with SIGTERM.

    SIGKILL ends those that still run after `grace` seconds.
    """
    with contextlib.suppress(psutil.NoSuchProcess):
        descendants = psutil.Process(pid).children(recursive=True)
        for end in (psutil.Process.terminate, psutil.Process.kill):
            for process in descendants:
                with contextlib.suppress(psutil.Error):
                    end(process)
            descendants = psutil.wait_procs(descendants, timeout=grace)[1]


@contextlib.contextmanager
def ends_with_run() -> Iterator[None]:
    """Within this context the job ends cleanly on SIGINT and SIGTERM, and soon after its run ends."""
    earlier_handlers = {}
    # Only the main thread can set handlers. Tests may use another thread, which raises ValueError.
    with contextlib.suppress(ValueError):
        for number in (signal.SIGINT, signal.SIGTERM):
            earlier_handlers[number] = signal.signal(number, _exit)
    done = threading.Event()
    if run := os.environ.get(RUN_VARIABLE):
        threading.Thread(target=_exit_with_run, args=(int(run), done), daemon=True).start()
    try:
        yield
    finally:
        done.set()
        for number, handler in earlier_handlers.items():
            if signal.getsignal(number) is _exit:
                signal.signal(number, handler)


def _exit(number: int, frame: FrameType | None) -> None:
    """Signal handler of a job: end it cleanly, with the usual exit status of a process ended by a signal."""
    # After Ctrl-C a job gets two signals, from the terminal and from its run. The second one must not
    # interrupt the clean-up.
    for caught in (signal.SIGINT, signal.SIGTERM):
        # Not SIG_IGN, with which Python prints a traceback if two signals come at once.
        signal.signal(caught, lambda *_: None)
    raise SystemExit(128 + number)  # not caught by `except Exception`, and runs every `finally`


def _exit_with_run(run: int, done: threading.Event) -> None:
    """End this process with SIGTERM when its run has ended.

    Python cannot handle SIGTERM while compiled code runs. So SIGKILL ends the process if it still runs after
    GRACE_SECONDS. run: process id of the run. done: set when the job has ended.
    """
    with contextlib.suppress(psutil.NoSuchProcess):
        process = psutil.Process(run)
        # `is_running` is false if another process has got the id. It stays true if the clock is set.
        while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
            if done.wait(CHECK_SECONDS):
                return
    os.kill(os.getpid(), signal.SIGTERM)
    if not done.wait(GRACE_SECONDS):
        os.kill(os.getpid(), signal.SIGKILL)
