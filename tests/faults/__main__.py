"""Make faults in the workflow: `make faults N=200`, or python -m tests.faults --rounds 200 --seed 7."""

from __future__ import annotations

import argparse
import secrets
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path
from random import Random

from tests.conftest import ROOT

from .lab import Lab
from .throws import FAULT, KINDS, REFUSED, REMADE, SKIPPED, UNHARMED, Throw

TARGET = "results/test/report.html"
PAGE = ROOT / "docs/faults.md"
BEGIN, END = "<!-- what was thrown -->", "<!-- end of what was thrown -->"


def main() -> int:
    """Make the faults and print the results. Exit status 1 if Hobble failed at one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], prog="python -m tests.faults")
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    parser.add_argument("--only", type=int, help="this one round of the seed")
    parser.add_argument("--page", action="store_true", help=f"write the list into {PAGE.relative_to(ROOT)}")
    asked = parser.parse_args()
    print(f"seed {asked.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="faults-") as scratch:
        Path(scratch).chmod(0o755)  # a job runs as the user `nobody`
        lab = Lab(Path(scratch) / "lab", TARGET)
        print(f"{len(lab.jobs)} jobs of an undisturbed run are ready", flush=True)
        numbers = range(asked.rounds) if asked.only is None else [asked.only]
        thrown = [_round(lab, asked.seed, number) for number in numbers]
    listed = _list(thrown)
    print(listed)
    if asked.page:
        text = PAGE.read_text(encoding="utf-8")
        command = f"make faults N={asked.rounds} SEED={asked.seed}"
        text = f"{text.split(BEGIN)[0]}{BEGIN}\nMade by `{command}`:\n\n{listed}\n{END}{text.split(END)[1]}"
        PAGE.write_text(text, encoding="utf-8")
    return int(any(throw.happened == FAULT for throw in thrown))


def _round(lab: Lab, seed: int, number: int) -> Throw:
    rng = Random(f"{seed}-{number}")
    (throw,) = rng.choices(list(KINDS), list(KINDS.values()))
    try:
        done = throw(lab, rng)
    except Exception as error:  # of the harness itself, which must not end the others
        done = Throw(throw.__name__, FAULT, f"{type(error).__name__}: {error}")
    print(f"{number}: {done.what}: {done.happened} {done.detail}", flush=True)
    return done


def _list(thrown: list[Throw]) -> str:
    """A line for each kind of fault: how often it ended in what."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for throw in sorted(thrown, key=lambda throw: throw.what):
        counts[throw.what][throw.happened] += 1
    counts["In all"] = Counter(throw.happened for throw in thrown)
    ends = (REFUSED, REMADE, UNHARMED, SKIPPED, FAULT)
    return "\n".join(
        f"- {kind}: {', '.join(f'{found[end]} {end}' for end in ends if found[end])}"
        for kind, found in counts.items()
    )


if __name__ == "__main__":
    sys.exit(main())
