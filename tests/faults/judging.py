"""What happened in a job with a fault, and whether that is what should happen."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from random import Random

from .damage import DAMAGES
from .lab import Bench, End, Job

TRACEBACK = "Traceback (most recent call last)"
BUG = "This is a bug in Hobble"
ANY = "any job"
REFUSED, UNHARMED, REMADE, SKIPPED, FAULT = "refused", "unharmed", "made again", "skipped", "FAULT"


@dataclass(frozen=True)
class Throw:
    """A fault and what happened. detail: more about it if Hobble failed."""

    what: str
    at: str
    happened: str
    detail: str = ""


def kind(path: str) -> str:
    """The kind of an artefact, as the table names it."""
    name = Path(path).name
    for special in ("checkpoint", "manifest", "statistics"):
        if name.startswith(special):
            return f"{special}{Path(name).suffix}"
    return Path(name).suffix or "folder"


def refusal(end: End, job: Job, *pieces: str) -> str:
    """What is wrong with a refusal, or "" if it is one message with the expected pieces and no traceback."""
    if end.status != 1:
        return f"status {end.status}"
    messages = [line for line in end.said.splitlines() if line.startswith(f"{job.rule}: ")]
    if TRACEBACK in end.said or BUG in end.said or not messages:
        return f"no message but: {end.said[-1500:]}"
    missing = [piece for piece in pieces if piece not in messages[-1]]
    return f"{missing} not in {messages[-1]!r}" if missing else ""


def half_a_database(bench: Bench) -> bool:
    """Whether an output has a manifest, so counts as complete, and is not what the job makes."""
    folders = [path for path in bench.job.outputs if (bench.lab.run / path / "manifest.json").exists()]
    return any((bench.folder / f / "manifest.json").exists() and f in bench.unlike() for f in folders)


def run_again(bench: Bench, what: str, at: str, happened: str) -> Throw:
    """Run the job again with undamaged inputs. It must give the artefacts of the undisturbed run."""
    for path in bench.job.outputs:  # as Snakemake does before a job
        if (bench.folder / path).is_dir():
            shutil.rmtree(bench.folder / path)
    end = bench.run()
    if end.status != 0:
        return Throw(what, at, FAULT, f"{bench.job.name}: the run after it ended in {end.said[-1500:]}")
    if unlike := bench.unlike():
        return Throw(what, at, FAULT, f"{bench.job.name}: the run after it made another {unlike}")
    if left := [str(p) for p in (bench.folder / "results").rglob("*.part")]:
        return Throw(what, at, FAULT, f"{bench.job.name}: left {left}")
    return Throw(what, at, happened)


def some_input_file(bench: Bench, rng: Random) -> Path:
    """A random input file. Small and large files are equally likely; of a folder, any file in it."""
    path = bench.folder / rng.choice(bench.artefacts)
    if path.is_dir():
        return rng.choice(sorted(p for p in path.rglob("*") if p.is_file() and not p.name.startswith(".")))
    return path


def judged(bench: Bench, what: str, target: Path, rng: Random) -> Throw:
    """A damaged input is refused with its name, or the result is the same as with the undamaged one."""
    at = kind(str(target)) if target.is_file() else "any file"
    what = f"bytes {what}" if what in DAMAGES else what
    end = bench.run()
    if end.status == 0:
        if unlike := bench.unlike():
            return Throw(what, at, FAULT, f"{bench.job.name} took {target.name} and made another {unlike}")
        return Throw(what, at, UNHARMED)
    named = target.name if "database" not in target.parts or target.name != "manifest.json" else "database"
    if wrong := refusal(end, bench.job, named):
        return Throw(what, at, FAULT, f"{bench.job.name}, {target.name}: {wrong}")
    if rng.random() < 0.2:  # with the whole input back, all is well
        shutil.rmtree(bench.folder / "results")
        bench.fill()
        return run_again(bench, what, at, REFUSED)
    return Throw(what, at, REFUSED)
