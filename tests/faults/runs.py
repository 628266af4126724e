"""Faults in whole runs of the workflow: kills, and two runs at once in the same folder."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random

from .judging import FAULT, REFUSED, REMADE, TRACEBACK, UNHARMED, Throw
from .lab import End, Job, Lab, tracked
from .same import same

FAILED = re.compile(r"^\d+ of \d+ jobs done in .*, \d+ failed:$", re.M)
LOCKED = "cannot be locked"  # words of hobble.workflow.lifetime


@contextmanager
def _started(lab: Lab, rng: Random) -> Iterator[tuple[Path, list[Job]]]:
    """A copy of the undisturbed run without the outputs of some jobs and of all jobs after them."""
    folder = Path(tempfile.mkdtemp(prefix="run-", dir=lab.folder))
    try:
        shutil.copytree(lab.run, folder, symlinks=True, dirs_exist_ok=True)
        lacking = rng.sample(lab.jobs, rng.randint(1, 3))
        for path in (folder / path for path in _following(lab, lacking)):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        for path in folder.glob("results/*/checkpoints"):
            shutil.rmtree(path)
        yield folder, lacking
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _following(lab: Lab, jobs: list[Job]) -> set[str]:
    """The outputs of some jobs and of all jobs after them. Snakemake makes a missing file only if a job that
    has to run needs it.
    """
    gone = {path for job in jobs for path in job.outputs}
    before = 0
    while len(gone) > before:
        before = len(gone)
        gone |= {path for job in lab.jobs if gone & set(job.inputs) for path in job.outputs}
    return gone


def _start(lab: Lab, folder: Path, said: Path) -> subprocess.Popen[bytes]:
    with open(said, "wb") as out:
        return subprocess.Popen(
            lab.command("-c2", *lab.targets),
            cwd=folder,
            env=lab.environment(),
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def _tree(root: int) -> list[int]:
    """The descendants of a process, from /proc."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError, IndexError):
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            children.setdefault(parent, []).append(int(entry.name))
    found, waiting = [], [root]
    while waiting:
        below = children.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


def kill_run(lab: Lab, rng: Random) -> Throw:
    """Kill a process of a whole run with SIGKILL at a random moment, then give the same command again."""
    victim = rng.choice(("a job", "snakemake", "snakemake and its jobs"))
    what = f"SIGKILL of {victim}, then the same command"
    with _started(lab, rng) as (folder, lacking):
        at = "a whole run"
        said = folder / "said"
        process = _start(lab, folder, said)
        time.sleep(rng.uniform(0.5, 4 + 3 * sum(lab.seconds[job.name] for job in lacking)))
        jobs = _tree(process.pid)
        while victim == "a job" and not jobs and process.poll() is None:
            time.sleep(0.02)
            jobs = _tree(process.pid)
        ended = process.poll() is not None
        victims = {"a job": [rng.choice(jobs)] if jobs else [], "snakemake": [process.pid]}
        for pid in victims.get(victim, [process.pid, *jobs]):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.wait()
        if ended:
            return _rerun(lab, folder, what, at, UNHARMED)
        if victim == "a job" and (wrong := _unsaid(process.returncode, said.read_text(errors="replace"))):
            return Throw(what, at, FAULT, wrong)
        return _rerun(lab, folder, what, at, REMADE)


def _unsaid(status: int, said: str) -> str:
    """What is wrong with how Snakemake ends when one of its jobs is killed."""
    failed = FAILED.search(said)
    if status == 0:
        return "status 0 in spite of an error" if failed else ""
    if not failed or TRACEBACK in said:
        return f"no message but {said[-1500:]}"
    return ""


def _rerun(lab: Lab, folder: Path, what: str, at: str, happened: str) -> Throw:
    end = lab.snakemake(folder, "-c2", *lab.targets)
    if end.status:
        return Throw(what, at, FAULT, f"the run after it ended in {end.said[-2500:]}")
    return _compared(lab, folder, what, at, happened, end)


def _compared(lab: Lab, folder: Path, what: str, at: str, happened: str, end: End) -> Throw:
    unlike = []
    for path in (path for job in lab.jobs for path in job.outputs):
        if path.endswith(".html"):  # it shows times; whole is what counts
            whole = (folder / path).read_text().rstrip().endswith("</html>")
            unlike += [] if whole else [path]
        elif not same(folder / path, lab.run / path):
            unlike.append(path)
    left = [str(path) for path in folder.rglob("*.part")]
    if unlike or left:
        return Throw(what, at, FAULT, f"other than undisturbed: {unlike}; left: {left}; {end.said[-800:]}")
    return Throw(what, at, happened)


def touched(lab: Lab, rng: Random) -> Throw:
    """Give every tracked file a new time, as in a fresh checkout. Nothing may run again."""
    what, at = "every tracked file touched", "a whole run"
    folder = Path(tempfile.mkdtemp(prefix="run-", dir=lab.folder))
    try:
        shutil.copytree(lab.run, folder, symlinks=True, dirs_exist_ok=True)
        for name in tracked():
            if name.parts[0] != "src" or not (folder / "src").is_symlink():
                (folder / name).touch()
        before = _times(lab, folder)
        end = lab.snakemake(folder, "-c2", *lab.targets)
        if end.status:
            return Throw(what, at, FAULT, f"status {end.status}: {end.said[-1500:]}")
        again = sorted(path for path, time in _times(lab, folder).items() if time != before[path])
        if again:
            return Throw(what, at, FAULT, f"made again: {again}")
        return Throw(what, at, UNHARMED)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _times(lab: Lab, folder: Path) -> dict[str, int]:
    return {path: (folder / path).stat().st_mtime_ns for job in lab.jobs for path in job.outputs}


def two_runs(lab: Lab, rng: Random) -> Throw:
    """Start Snakemake twice in the same folder: one does the work, the other says that the folder is
    locked.
    """
    with _started(lab, rng) as (folder, _):
        said = [folder / "said-1", folder / "said-2"]
        first = _start(lab, folder, said[0])
        time.sleep(rng.uniform(0, 3))
        second = _start(lab, folder, said[1])
        ends = [process.wait() for process in (first, second)]
        words = [path.read_text(errors="replace") for path in said]
        for status, text in zip(ends, words, strict=True):
            if status and LOCKED not in text:
                return Throw(
                    "two snakemakes in one folder", "a whole run", FAULT, f"status {status}: {text[-2500:]}"
                )
        if all(ends):
            return Throw(
                "two snakemakes in one folder",
                "a whole run",
                FAULT,
                f"neither did the work: {words[0][-1500:]}",
            )
        happened = REFUSED if any(ends) else UNHARMED
        return _rerun(lab, folder, "two snakemakes in one folder", "a whole run", happened)
