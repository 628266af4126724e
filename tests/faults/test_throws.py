"""A few faults of every kind in the jobs that make the rows of two clips.

`make faults N=200 SEED=7` throws 200 random ones at the jobs of results/test/report.html, and prints a list.
"""

import os
import secrets
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from . import throws
from .lab import Lab

pytestmark = [pytest.mark.workflow, pytest.mark.slow]
CLIPS = ("walk-straight-1_hurt1", "uneven-1")


def reachable_lab(*targets: str) -> Iterator[Lab]:
    """A lab in a folder that the user `nobody` may enter, who may not enter pytest's own ones."""
    with tempfile.TemporaryDirectory(prefix="lab-") as folder:
        Path(folder).chmod(0o755)
        yield Lab(Path(folder) / "lab", *targets)


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    for made in reachable_lab(*(f"results/datasets/tiny/database/clips/{clip}.npz" for clip in CLIPS)):
        rules = {job.rule for job in made.jobs}
        assert rules >= {"synthetic_clips", "motion_clips", "terrain_fits", "database_clips"}
        yield made


@pytest.mark.parametrize(
    ("throw", "times", "refusals"),
    [(throws.kill, 16, 0), (throws.orphan, 8, 0), (throws.gone, 5, 0), (throws.full_disk, 4, 0),
     (throws.no_permission, 4, 0), (throws.harm, 40, 20), (throws.wrong_value, 60, 15)],
)  # fmt: skip
def test_no_fault_of_a_job_damages_a_result(lab: Lab, throw, times: int, refusals: int) -> None:
    thrown = [throw(lab, Random(f"20-{number}")) for number in range(times)]
    assert "\n".join(one.detail for one in thrown if one.happened == throws.FAULT) == ""
    assert sum(one.happened == throws.REFUSED for one in thrown) >= refusals


@pytest.mark.skipif("N" not in os.environ, reason="make faults N=200 throws random faults")
def test_no_random_fault_damages_a_result() -> None:
    seed = os.environ.get("SEED") or str(secrets.randbelow(10**6))
    print(f"SEED={seed}")
    counts: dict[str, Counter[str]] = {}
    for lab in reachable_lab("results/test/report.html"):
        for number in range(int(os.environ["N"])):
            rng = Random(f"{seed}-{number}")
            (throw,) = rng.choices(list(throws.KINDS), list(throws.KINDS.values()))
            done = throw(lab, rng)
            print(f"{number}: {done.what}: {done.happened} {done.detail}", flush=True)
            counts.setdefault(done.what, Counter())[done.happened] += 1
    counts = {**dict(sorted(counts.items())), "In all": sum(counts.values(), Counter())}
    for what, found in counts.items():
        print(f"- {what}: {', '.join(f'{count} {happened}' for happened, count in sorted(found.items()))}")
    assert throws.FAULT not in counts["In all"]
