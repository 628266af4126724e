"""Faults in single jobs: each function throws one kind at a job, and returns what happened."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from .damage import change_file, damaged, not_finite
from .lab import Bench, End, Job, Lab

NOBODY = 65534
TRACEBACK = "Traceback (most recent call last)"
BUG = "This is a bug in Hobble"
REFUSED, REMADE, UNHARMED, SKIPPED, FAULT = "refused", "made again", "unharmed", "skipped", "FAULT"
OLD = b"what an earlier run made"
CHECKED = (".npz", ".safetensors", ".json")  # files with checksums


@dataclass(frozen=True)
class Throw:
    """A fault and what happened. detail: more about it."""

    what: str
    happened: str
    detail: str = ""


def judged(
    bench: Bench, what: str, end: End, *said: str, killed: bool = False, mend: Callable[[], Any] | None = None
) -> Throw:
    """What happened to a job with a fault, and then to the same job after `mend`, or with new inputs.

    said: pieces of the message with which it may have been refused. killed: whether it may have been killed.
    """

    def fault(how: object) -> Throw:
        return Throw(what, FAULT, f"{bench.job.name}: {how}")

    if end.status == 0:
        return fault(f"made another {unlike}") if (unlike := bench.unlike()) else Throw(what, UNHARMED)
    if not (killed and end.status < 0) and (wrong := refusal(end, bench.job, *said)):
        return fault(wrong)
    if torn := [path for path in bench.unlike() if _counts_as_made(bench.folder / path)]:
        return fault(f"left half of {torn}")
    (mend or bench.fill)()
    bench.without_outputs()
    again = bench.run()
    if again.status:
        return fault(f"the run after it ended in {again.said[-1500:]}")
    if wrong_files := [*bench.unlike(), *(bench.folder / "results").rglob("*.part")]:
        return fault(f"the run after it made or left {wrong_files}")
    return Throw(what, REFUSED if end.status > 0 else REMADE)


def _counts_as_made(path: Path) -> bool:
    """Whether a later job takes this output for whole: a file, or a database with its manifest."""
    if path.is_dir():
        return (path / "manifest.json").exists()
    return path.is_file() and path.read_bytes() != OLD


def refusal(end: End, job: Job, *pieces: str) -> str:
    """What is wrong with a refusal, or "" if it is one message with these pieces and no traceback."""
    messages = [line for line in end.said.splitlines() if line.startswith(f"{job.rule}: ")]
    if end.status != 1 or TRACEBACK in end.said or BUG in end.said or not messages:
        return f"status {end.status}: {end.said[-1500:]}"
    missing = [piece for piece in pieces if piece not in messages[-1]]
    return f"{missing} not in {messages[-1]!r}" if missing else ""


def kill(lab: Lab, rng: Random) -> Throw:
    """Kill a job at a random moment, or as it writes. Half of the time there are older artefacts."""
    job = rng.choice(lab.jobs)
    with lab.bench(job) as bench:
        for path in job.outputs if rng.random() < 0.5 else ():
            if (lab.run / path).is_file():
                (bench.folder / path).parent.mkdir(parents=True, exist_ok=True)
                (bench.folder / path).write_bytes(OLD)
        opened = rng.randint(2, 2 + len(job.outputs)) if rng.random() < 0.7 else 0
        seconds = 10 ** (rng.uniform(-4.3, -3) if opened else rng.uniform(-2, 0.5))
        end = bench.run(before=lambda: _die(opened, seconds))
        moment = "as it writes" if opened else "at a random moment"
        return judged(bench, f"a job killed {moment}", end, killed=True)


def _die(opened: int, seconds: float) -> None:
    """Kill this process some seconds after it opens a file for writing for the n-th time; 0: after now."""
    left = opened

    def heard(event: str, given: tuple[Any, ...]) -> None:
        nonlocal left
        if event == "open" and isinstance(given[2], int) and given[2] & (os.O_WRONLY | os.O_RDWR):
            left -= 1
            if left == 0:
                signal.setitimer(signal.ITIMER_REAL, seconds)

    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    if opened:
        sys.addaudithook(heard)
    else:
        signal.setitimer(signal.ITIMER_REAL, seconds)


def orphan(lab: Lab, rng: Random) -> Throw:
    """A job lives on after its run, as on a cluster whose head node died; the next run starts it again."""
    job, what = rng.choice(lab.jobs), "a job that lives on beside its second run"
    with lab.bench(job) as bench:
        ends = []

        def start_again() -> None:
            time.sleep(10 ** rng.uniform(-2, 0.5))
            bench.without_outputs()
            ends.append(bench.run())

        ends.append(bench.run(meanwhile=start_again))
        if ends[0].status and ends[1].status:
            return Throw(what, FAULT, f"{job.name}: {ends[0].said[-900:]}")
        return judged(bench, what, max(ends, key=lambda end: end.status))


def harm(lab: Lab, rng: Random) -> Throw:
    """Cut, flip or zero bytes of an input that holds checksums, or of the checkpoint of a killed training."""
    job, path = _some_input(lab, rng, CHECKED)
    with lab.bench(job) as bench:
        target = bench.folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.unlink(missing_ok=True)
        target.write_bytes(damaged(rng, (lab.run / path).read_bytes()))
        os.utime(target, ns=((lab.run / path).stat().st_mtime_ns,) * 2)
        if "checkpoints" in path:  # no input: the advice is to delete it
            return judged(bench, "a damaged checkpoint", bench.run(), _named(target), mend=target.unlink)
        return judged(bench, "damaged bytes of a file", bench.run(), _named(target))


def wrong_value(lab: Lab, rng: Random) -> Throw:
    """Change a value in a file, with right checksums. It is refused, or nothing becomes NaN."""
    job, path = _some_input(lab, rng, (".npz", ".json", ".bvh"))
    what = f"a wrong value in a file {Path(path).suffix}"
    with lab.bench(job) as bench:
        target = bench.folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(lab.run / path, target)
        change_file(rng, target)
        end = bench.run()
        if end.status:
            wrong = refusal(end, job, _named(target))
            return Throw(what, FAULT if wrong else REFUSED, f"{job.name}, {path}: {wrong}" * bool(wrong))
        made = [name for output in job.outputs for name in not_finite(bench.folder / output)]
        spoilt = [name for name in made if name not in lab.not_finite]
        return Throw(what, FAULT if spoilt else UNHARMED, f"{job.name}, {path}: {spoilt}" * bool(spoilt))


def _some_input(lab: Lab, rng: Random, endings: tuple[str, ...]) -> tuple[Job, str]:
    """A random job, and a file with one of these endings that it reads; each kind of file as often."""
    kinds: dict[str, list[tuple[Job, str]]] = {}
    for job in lab.jobs:
        roots = [lab.run / path for path in job.artefacts]
        if job.rule == "training":
            roots += sorted(lab.run.glob("results/*/checkpoints/*/*.npz"))[-1:]
        for file in (file for root in roots for file in _files(root) if file.suffix in endings):
            special = [name for name in ("checkpoint", "manifest", "statistics") if name in file.name]
            kind = f"{job.rule} {(special or [file.suffix])[0]}"
            kinds.setdefault(kind, []).append((job, str(file.relative_to(lab.run))))
    return rng.choice(kinds[rng.choice(sorted(kinds))])


def _files(root: Path) -> list[Path]:
    files = [root] if root.is_file() else sorted(root.rglob("*"))
    return [path for path in files if path.is_file() and not path.name.startswith(".")]


def _named(target: Path) -> str:
    """What a message about a file says: its name, or that of the database to which it belongs."""
    return "database" if target.name == "manifest.json" else target.name


def _job_with_artefacts(lab: Lab, rng: Random) -> Job:
    return rng.choice([job for job in lab.jobs if job.artefacts])


def gone(lab: Lab, rng: Random) -> Throw:
    """Remove an input, or put a folder in its place."""
    with lab.bench(_job_with_artefacts(lab, rng)) as bench:
        target = rng.choice(_files(bench.folder / rng.choice(bench.job.artefacts)))
        target.unlink()
        folder = rng.random() < 0.3
        if folder:
            target.mkdir()
        what = "a folder where a file was" if folder else "a file that is gone"
        return judged(bench, what, bench.run(), _named(target))


def full_disk(lab: Lab, rng: Random) -> Throw:
    """The disk of the results has room for only part of the job's output."""
    with lab.bench(rng.choice(lab.jobs)) as bench, _disk(bench, rng) as disk:
        if disk is None:
            return Throw("a full disk", SKIPPED, "nothing may be mounted here")
        end = bench.run()
        grow = ["mount", "-o", "remount,size=2g", str(disk)]
        return judged(
            bench, "a full disk", end, "the disk is full", mend=lambda: subprocess.run(grow, check=True)
        )


@contextlib.contextmanager
def _disk(bench: Bench, rng: Random) -> Iterator[Path | None]:
    disk, filled = bench.folder / "results", bench.folder / "filled"
    disk.rename(filled)
    disk.mkdir()
    made = [bench.lab.run / path for path in bench.job.outputs]
    here, there = (
        sum(f.stat().st_size for root in roots for f in _files(root)) for roots in ([filled], made)
    )
    # Pages of a tmpfs hold 4 kB, and a folder or a record takes one too.
    room = here + 4096 * (2 + 2 * len(list(filled.rglob("*")))) + int(rng.uniform(0, 0.95) * there)
    mount = ["mount", "-t", "tmpfs", "-o", f"size={room}", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True).returncode:
        yield None
        return
    try:
        shutil.copytree(filled, disk, dirs_exist_ok=True)
        yield disk
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def no_permission(lab: Lab, rng: Random) -> Throw:
    """For a user who is not root, forbid reading an input or writing in a folder."""
    what = rng.choice(("an input that may not be read", "a results folder that cannot be written"))
    if os.getuid():
        return Throw(what, SKIPPED, "not root, so that no job can be run as somebody else")
    with lab.bench(_job_with_artefacts(lab, rng)) as bench:
        if what.startswith("an"):
            target = rng.choice(_files(bench.folder / rng.choice(bench.job.artefacts)))
        else:
            target = (bench.folder / bench.job.outputs[0]).parent
            target.mkdir(parents=True, exist_ok=True)
        for path in (bench.folder.parent, *bench.folder.parent.rglob("*")):
            if not path.is_symlink():
                os.chown(path, NOBODY, NOBODY)
        mode = target.stat().st_mode
        target.chmod(0o000 if target.is_file() else 0o555)
        end = bench.run(before=become_nobody)
        return judged(bench, what, end, target.name, "ermission", mend=lambda: target.chmod(mode))


def become_nobody() -> None:
    """Give up root, because permissions do not bind root."""
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)
    os.environ["HOME"] = "/nonexistent"


# Each kind of fault -> how often it is thrown among a hundred.
KINDS: dict[Callable[[Lab, Random], Throw], int] = {
    kill: 20, harm: 34, gone: 4, orphan: 7, full_disk: 8, no_permission: 7, wrong_value: 20,
}  # fmt: skip
