"""Tasks of a benchmark in processes of their own: cold page cache, limited memory, memory that was used."""

import argparse
import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path


def cold(folder: Path) -> None:
    """Drop a folder's files from the page cache."""
    for file in folder.rglob("*"):
        if file.is_file():
            with open(file, "rb") as opened:
                os.fsync(opened.fileno())
                os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def child(task: str, folder: Path, argument: str = "", limit_mb: int | None = None) -> list[float]:
    """Run a task of the benchmark that runs now in a new process; the numbers that it prints.

    limit_mb: most memory with the page cache. Above it the kernel reclaims pages or kills the process.
    """
    command = [sys.executable, sys.argv[0], "--task", task, "--folder", str(folder), "--argument", argument]
    one_arena = {**os.environ, "MALLOC_ARENA_MAX": "1"}  # else each thread reserves 64 MB of address space
    with cgroup(limit_mb) as join:
        done = subprocess.run(
            command, check=True, stdout=subprocess.PIPE, text=True, preexec_fn=join, env=one_arena
        )
    out = done.stdout
    return [float(word) for word in out.split()]


@contextlib.contextmanager
def cgroup(limit_mb: int | None) -> Iterator[Callable[[], None] | None]:
    """Make a memory cgroup, if this user may. Yields a function with which a child joins it."""
    if limit_mb is None:
        yield None
        return
    v1 = Path("/sys/fs/cgroup/memory")
    base, file = (v1, "memory.limit_in_bytes") if v1.is_dir() else (Path("/sys/fs/cgroup"), "memory.max")
    group = base / f"hobble-benchmark-{os.getpid()}"
    try:
        group.mkdir()
        (group / file).write_text(str(limit_mb << 20))
    except OSError as error:
        print(f"no memory cgroup ({error}): the page cache is not limited", file=sys.stderr)
        yield None
        return
    try:
        yield lambda: (group / "cgroup.procs").write_text(str(os.getpid())) and None
    finally:
        group.rmdir()


def status(field: str) -> int:
    """A line of /proc/self/status, in bytes."""
    lines = dict(
        line.split(":") for line in Path("/proc/self/status").read_text().splitlines() if ":" in line
    )
    return int(lines[field].split()[0]) << 10


def arguments(description: str, rounds: int) -> argparse.ArgumentParser:
    """The arguments of a benchmark that runs its tasks in processes of their own (`child`)."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--size-mb", type=int, default=1280)
    parser.add_argument("--memory-mb", type=int, default=128)
    parser.add_argument("--rounds", type=int, default=rounds, help="rounds in which each way is measured")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--task", help=argparse.SUPPRESS)
    parser.add_argument("--argument", help=argparse.SUPPRESS)
    return parser
