"""Make faults in the workflow: `make faults N=200`, or python -m tests.faults --rounds 200 --seed 7."""

from __future__ import annotations

import argparse
import re
import secrets
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from random import Random

from . import texts, throws
from .grammar import STATUS_BASE, Case
from .judging import FAULT, REFUSED, REMADE, SKIPPED, UNHARMED, Throw
from .lab import ROOT, Lab

TARGET = "results/test/report.html"
KINDS: dict[Callable[[Lab, Random], Throw], int] = {
    throws.kill: 22,
    throws.harm: 36,
    throws.gone: 5,
    throws.orphan: 8,
    throws.full_disk: 10,
    throws.no_permission: 8,
    throws.wrong_value: 25,
    throws.spoilt_checkpoint: 4,
}
TEXTS_PER_ROUND = 5
OUTCOMES = (REFUSED, REMADE, UNHARMED, SKIPPED, FAULT)
PAGE = ROOT / "docs/faults.md"
BEGIN, END = "<!-- what was thrown -->", "<!-- end of what was thrown -->"


def main() -> int:
    """Make the faults, print the results, write the list. Exit status 1 if Hobble failed at one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], prog="python -m tests.faults")
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    parser.add_argument("--only", type=int, help="this one round of the seed")
    parser.add_argument("--page", action="store_true", help=f"write the list into {PAGE.relative_to(ROOT)}")
    arguments = parser.parse_args()
    print(f"seed {arguments.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="faults-") as scratch:
        Path(scratch).chmod(0o755)
        lab = Lab(Path(scratch) / "lab", fresh=True)
        lab.undisturbed(TARGET)
        print(f"{len(lab.jobs)} jobs of an undisturbed run are ready", flush=True)
        thrown = _rounds(
            lab, arguments.seed, range(arguments.rounds) if arguments.only is None else [arguments.only]
        )
        if arguments.only is None:
            thrown += _texts(lab, Path(scratch), arguments.seed, arguments.rounds * TEXTS_PER_ROUND)
    listed = _list(thrown)
    print(listed)
    if arguments.page:
        _write(f"make faults N={arguments.rounds} SEED={arguments.seed}", listed)
    faults = [throw for throw in thrown if throw.happened == FAULT]
    print(f"{len(thrown)} thrown, {len(faults)} faults")
    return 1 if faults else 0


def _rounds(lab: Lab, seed: int, numbers: range | list[int]) -> list[Throw]:
    done = []
    for number in numbers:
        rng = Random(f"{seed}-{number}")
        (throw,) = rng.choices(list(KINDS), list(KINDS.values()))
        began = time.monotonic()
        try:
            done.append(throw(lab, rng))
        except Exception as error:  # of the harness itself, which must not end the others
            done.append(Throw(throw.__name__, "-", FAULT, f"{type(error).__name__}: {error}"))
        last = done[-1]
        seconds = time.monotonic() - began
        print(f"{number}: {seconds:.1f} s: {last.what}, {last.at}: {last.happened} {last.detail}", flush=True)
    return done


def _texts(lab: Lab, folder: Path, seed: int, examples: int) -> list[Throw]:
    thrown: list[Throw] = []
    clip = lab.run / next(path for job in lab.jobs for path in job.outputs if path.endswith(".bvh"))
    bases = {"bvh": texts.base_bvh(clip), "status": STATUS_BASE}
    names = {"bvh": "a BVH file", "status": "a status file"}
    for which, base in bases.items():

        def report(case: Case, became: str, which: str = which) -> None:
            what = f"{names[which]} with {len(case.names)} mutation{'s' * (len(case.names) > 1)}"
            thrown.append(Throw(what, "its reader", REFUSED if became == "refused" else UNHARMED))

        try:
            texts.throw(which, base, folder, examples, seed, report)
        except AssertionError as error:
            thrown.append(Throw(names[which], "its reader", FAULT, str(error)))
            print(thrown[-1], flush=True)
    return thrown


def _list(thrown: list[Throw]) -> str:
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for throw in thrown:
        counts[_kind(throw.what)][throw.happened] += 1
        counts["In all"][throw.happened] += 1
    happened = {
        kind: ", ".join(f"{found[c]} {c}" for c in OUTCOMES if found[c]) for kind, found in counts.items()
    }
    last = happened.pop("In all", "nothing")
    return "\n".join([*(f"- {kind}: {happened[kind]}" for kind in sorted(happened)), f"- In all: {last}"])


def _kind(what: str) -> str:
    """The line of the list. Faults that differ only in number, kind of damage or leftovers share one."""
    if what.startswith("bytes "):
        return "damaged bytes of a file"
    return re.sub(r" with \d+ mutations?$", " with mutations", what).split(", ")[0]


def _write(command: str, listed: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\nMade by `{command}`:\n\n{listed}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
