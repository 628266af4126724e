"""Faults in single jobs: each function throws one kind at a job, and returns what happened."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

from .damage import DAMAGES, damaged
from .judging import (
    ANY,
    FAULT,
    REFUSED,
    REMADE,
    SKIPPED,
    UNHARMED,
    Throw,
    half_a_database,
    judged,
    kind,
    refusal,
    run_again,
    some_input_file,
)
from .lab import NOBODY, Bench, Job, Lab
from .values import change_file, not_finite

OLD = b"what an earlier run made"


def kill(lab: Lab, rng: Random) -> Throw:
    """Kill a job at a random moment, or while it writes. Half of the time there are older artefacts; they
    stay or are replaced completely.
    """
    job = rng.choice(lab.jobs)
    after = rng.uniform(0, 1.1 * lab.seconds[job.name])
    writing = rng.random() < 0.7
    with lab.bench(job) as bench:
        files = [path for path in job.outputs if (lab.run / path).is_file()]
        older = rng.random() < 0.5
        for path in files if older else ():
            (bench.folder / path).parent.mkdir(parents=True, exist_ok=True)
            (bench.folder / path).write_bytes(OLD)
        if writing:
            nth, seconds = rng.randint(2, 2 + len(job.outputs)), 10 ** rng.uniform(-4.3, -3)
            end = bench.run(before=_die_writing(nth, seconds))
        else:
            end = bench.run(kill_after=after)
        torn = [path for path in files if not _old_or_new(bench, path, older)]
        moment = "as it writes" if writing else "at a random moment"
        what = f"a job killed {moment}, {'older' if older else 'no'} artefacts there"
        if torn or half_a_database(bench):
            return Throw(what, ANY, FAULT, f"{job.name} after {after:.3f} s left half of {torn}")
        return run_again(bench, what, ANY, UNHARMED if end.status == 0 else REMADE)


def _die_writing(n: int, seconds: float) -> Callable[[], None]:
    """Kill this process shortly after it opens the n-th file for writing."""

    def prepare() -> None:
        left = n

        def heard(event: str, given: tuple[Any, ...]) -> None:
            nonlocal left
            if event == "open" and isinstance(given[2], int) and given[2] & (os.O_WRONLY | os.O_RDWR):
                left -= 1
                if left == 0:
                    signal.setitimer(signal.ITIMER_REAL, seconds)

        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        sys.addaudithook(heard)

    return prepare


def _old_or_new(bench: Bench, path: str, older: bool) -> bool:
    here = bench.folder / path
    if not here.exists():
        return not older
    return (older and here.read_bytes() == OLD) or path not in bench.unlike()


def orphan(lab: Lab, rng: Random) -> Throw:
    """A job lives on after its run, as on a cluster whose head node died; the next run starts it again."""
    job = rng.choice(lab.jobs)
    what = "a job that lives on beside its second run"
    with lab.bench(job) as bench:
        ends = []

        def start_again() -> None:
            time.sleep(rng.uniform(0, lab.seconds[job.name]))
            for path in job.outputs:  # as Snakemake does before a job
                made = bench.folder / path
                if made.is_dir():
                    shutil.rmtree(made, ignore_errors=True)
                else:
                    made.unlink(missing_ok=True)
            ends.append(bench.run())

        first = bench.run(meanwhile=start_again)
        if ends[0].status and first.status:
            return Throw(what, ANY, FAULT, f"{job.name}: {ends[0].said[-900:]}")
        if unlike := bench.unlike():  # as when one of them was refused; the same command again mends it
            if run_again(bench, what, ANY, REMADE).happened == FAULT:
                return Throw(what, ANY, FAULT, f"{job.name} made another {unlike}")
            return Throw(what, ANY, FAULT if not ends[0].status else REMADE, f"{job.name}: {unlike}")
        return Throw(what, ANY, UNHARMED)


def harm(lab: Lab, rng: Random, only: str | None = None) -> Throw:
    """Cut, flip or zero bytes of an input that another job made and that holds checksums."""
    there = [(job, path) for job in lab.jobs for path in _files_read(lab, job) if only in (None, job.rule)]
    wanted = rng.choice(sorted({kind(path) for _, path in there}))  # each kind of file as often
    job, path = rng.choice([(job, path) for job, path in there if kind(path) == wanted])
    name = rng.choice(sorted(DAMAGES))
    with lab.bench(job) as bench:
        target = bench.folder / path
        whole, times = target.read_bytes(), target.stat()
        if not whole:
            return Throw("bytes " + name, kind(str(target)), SKIPPED, "an empty file")
        target.write_bytes(damaged(rng, name, whole))
        os.utime(target, ns=(times.st_atime_ns, times.st_mtime_ns))
        return judged(bench, name, target, rng)


def wrong_value(lab: Lab, rng: Random, ending: str | None = None) -> Throw:
    """Change a value in an npz or JSON file, with right checksums. It is refused, or nothing becomes NaN.

    ending: of the file's path; None for any file that one job made and another reads.
    """
    there = [(job, path) for job in lab.jobs for path in _files_read(lab, job, (".npz", ".json"))]
    there = [(job, path) for job, path in there if ending is None or path.endswith(ending)]
    wanted = rng.choice(sorted({(job.rule, kind(path)) for job, path in there}))
    job, path = rng.choice([(job, path) for job, path in there if (job.rule, kind(path)) == wanted])
    with lab.bench(job) as bench:
        target, what = bench.folder / path, f"a wrong value in a file {Path(path).suffix}"
        change_file(rng, target)
        end = bench.run()
        if end.status:
            named = "database" if target.name == "manifest.json" else target.name
            wrong = refusal(end, job, named)
            return Throw(what, ANY, FAULT if wrong else REFUSED, f"{job.name}, {path}: {wrong}" * bool(wrong))
        made = [bench.folder / output for output in job.outputs]
        spoilt = [name for output in made for name in not_finite(output) if name not in lab.not_finite]
        return Throw(what, ANY, FAULT if spoilt else UNHARMED, f"{job.name}, {path}: {spoilt}" * bool(spoilt))


def _files_read(lab: Lab, job: Job, endings: tuple[str, ...] = (".npz", ".safetensors")) -> list[str]:
    """The files with these endings that a job reads and other jobs made, including those in folders."""
    roots = [lab.run / path for path in job.inputs if path.startswith("results/")]
    files = [file for root in roots for file in _files(root) if file.suffix in endings]
    return sorted(str(file.relative_to(lab.run)) for file in files)


def gone(lab: Lab, rng: Random) -> Throw:
    """Remove an input, or put a folder in its place."""
    job = rng.choice([job for job in lab.jobs if any(p.startswith("results/") for p in job.inputs)])
    with lab.bench(job) as bench:
        target = some_input_file(bench, rng)
        target.unlink()
        folder = rng.random() < 0.3
        if folder:
            target.mkdir()
        return judged(bench, "a folder where a file was" if folder else "a file that is gone", target, rng)


def full_disk(lab: Lab, rng: Random) -> Throw:
    """The disk of the results has room for only part of the job's output."""
    if os.getuid():
        return Throw("a full disk", "-", SKIPPED, "not root, so that no small disk can be mounted")
    job = rng.choice(lab.jobs)
    with lab.bench(job) as bench, _disk(bench, rng) as disk:
        if disk is None:
            return Throw("a full disk", ANY, SKIPPED, "nothing may be mounted here")
        end = bench.run()
        subprocess.run(["mount", "-o", "remount,size=2g", str(disk)], check=True)
        if end.status == 0:
            return run_again(bench, "a full disk", ANY, UNHARMED)
        if wrong := refusal(end, job, "the disk is full"):
            return Throw("a full disk", ANY, FAULT, f"{job.name}: {wrong}")
        torn = [p for p in job.outputs if (bench.folder / p).is_file() and p in bench.unlike()]
        if torn or half_a_database(bench) or list(disk.rglob("*.part")):
            return Throw("a full disk", ANY, FAULT, f"{job.name} left half of {torn}")
        return run_again(bench, "a full disk", ANY, REFUSED)


@contextlib.contextmanager
def _disk(bench: Bench, rng: Random) -> Iterator[Path | None]:
    disk = bench.folder / "results"
    filled = bench.folder / "filled"
    disk.rename(filled)
    disk.mkdir()
    sizes = [sum(f.stat().st_size for f in _files(root)) for root in (filled, *_made(bench))]
    # Pages of a tmpfs hold 4 kB, and a folder or a record takes one too.
    room = (
        sizes[0] + 4096 * (2 + 2 * len(list(filled.rglob("*")))) + int(rng.uniform(0, 0.95) * sum(sizes[1:]))
    )
    mount = ["mount", "-t", "tmpfs", "-o", f"size={room}", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True).returncode:
        yield None
        return
    try:
        shutil.copytree(filled, disk, dirs_exist_ok=True)
        yield disk
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def _made(bench: Bench) -> list[Path]:
    return [bench.lab.run / path for path in bench.job.outputs]


def _files(root: Path) -> list[Path]:
    return [root] if root.is_file() else [path for path in root.rglob("*") if path.is_file()]


def no_permission(lab: Lab, rng: Random) -> Throw:
    """For a user who is not root, forbid reading an input or writing in a folder."""
    what = rng.choice(("an input that may not be read", "a results folder that cannot be written"))
    if os.getuid():
        return Throw(what, "-", SKIPPED, "not root, so that no job can be run as somebody else")
    jobs = [job for job in lab.jobs if any(p.startswith("results/") for p in job.inputs)]
    job = rng.choice(jobs)
    with lab.bench(job) as bench:
        if what.startswith("an"):
            target = some_input_file(bench, rng)
        else:
            target = (bench.folder / job.outputs[0]).parent
            target.mkdir(parents=True, exist_ok=True)
        for path in (bench.folder.parent, *bench.folder.parent.rglob("*")):
            if not path.is_symlink():
                os.chown(path, NOBODY, NOBODY)
        target.chmod(0o000 if target.is_file() else 0o555)
        end = bench.run(before=become_nobody)
        target.chmod(0o644 if target.is_file() else 0o755)
        if end.status == 0:
            if unlike := bench.unlike():
                return Throw(what, ANY, FAULT, f"{job.name} made another {unlike}")
            return Throw(what, ANY, UNHARMED)
        named = target.name if target.is_file() else Path(job.outputs[0]).parent.name
        if wrong := refusal(end, job, named, "ermission"):
            return Throw(what, ANY, FAULT, f"{job.name}: {wrong}")
        return run_again(bench, what, ANY, REFUSED)


def become_nobody() -> None:
    """Give up root, because permissions do not bind root."""
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)
    os.environ["HOME"] = "/nonexistent"


def spoilt_checkpoint(lab: Lab, rng: Random) -> Throw:
    """A killed training finds its own checkpoint damaged."""
    job = next((job for job in lab.jobs if job.rule == "training"), None)
    there = sorted(lab.run.glob("results/*/checkpoints/*/*.npz"))
    if job is None or not there:
        return Throw("a checkpoint that is damaged", "-", SKIPPED, "no training in this run")
    with lab.bench(job) as bench:
        name = rng.choice(sorted(DAMAGES))
        target = bench.folder / there[-1].relative_to(lab.run)
        target.parent.mkdir(parents=True)
        target.write_bytes(damaged(rng, name, there[-1].read_bytes()))
        return judged(bench, name, target, rng)
