"""A few faults of every kind in the jobs that make the rows of two clips; `make faults N=200` makes more."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from . import bvh_grammar, status_grammar, texts, throws
from .damage import DAMAGES
from .grammar import Case, mutated
from .judging import FAULT, REFUSED
from .lab import Lab
from .same import same

pytestmark = [pytest.mark.workflow, pytest.mark.slow]
SEED = 20
CLIPS = ("walk-straight-1_hurt1", "uneven-1")
TARGETS = [f"results/datasets/tiny/database/clips/{clip}.npz" for clip in CLIPS]


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    with tempfile.TemporaryDirectory(prefix="lab-") as folder:
        Path(folder).chmod(0o755)  # a job runs as the user `nobody`, who may not enter pytest's own folders
        made = Lab(Path(folder) / "lab")
        made.undisturbed(*TARGETS)
        rules = {job.rule for job in made.jobs}
        assert rules >= {"synthetic_clips", "motion_clips", "terrain_fits", "database_clips"}
        yield made


@pytest.mark.parametrize(
    ("throw", "times"),
    [
        (throws.kill, 16),
        (throws.gone, 5),
        (throws.full_disk, 4),
        (throws.no_permission, 4),
        (throws.changing_clip, 6),
    ],
)
def test_no_fault_during_a_job_damages_a_result(lab: Lab, throw, times: int) -> None:
    thrown = [throw(lab, Random(f"{SEED}-{number}")) for number in range(times)]
    assert "\n".join(one.detail for one in thrown if one.happened == FAULT) == ""


@pytest.mark.parametrize(
    "rule", ["hurt_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips"]
)
def test_a_damaged_input_is_refused_or_harmless(lab: Lab, rule: str) -> None:
    thrown = [throws.harm(lab, Random(f"{SEED}-{number}"), rule) for number in range(8)]
    assert "\n".join(one.detail for one in thrown if one.happened == FAULT) == ""
    assert sum(one.happened == REFUSED for one in thrown) >= 4


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("texts")


def test_every_mutation_of_a_bvh_gives_a_clip_or_one_message(tiny_bvh: str, folder: Path) -> None:
    assert len(bvh_grammar.MUTATIONS) > 150
    path = folder / "clip.bvh"
    path.write_text(tiny_bvh)
    whole = texts.read_clip(path)
    for number, name in enumerate(bvh_grammar.MUTATIONS):
        case = mutated(tiny_bvh, bvh_grammar.MUTATIONS, [name], number)
        texts.judge(case, path, texts.read_clip, whole)


def test_every_mutation_of_a_status_file_gives_severities_or_one_message(folder: Path) -> None:
    assert len(status_grammar.MUTATIONS) > 100
    path = folder / "clip_injuries.txt"
    path.write_text(status_grammar.BASE)
    whole = texts.read_severity(path)
    for number, name in enumerate(status_grammar.MUTATIONS):
        case = mutated(status_grammar.BASE, status_grammar.MUTATIONS, [name], number)
        texts.judge(case, path, texts.read_severity, whole)


def test_several_mutations_of_one_file_give_a_result_or_one_message(folder: Path) -> None:
    became: list[str] = []

    def report(case: Case, what: str) -> None:
        became.append(what)

    texts.throw("status", status_grammar.BASE, folder, 60, SEED, report)
    assert len(became) >= 60


def test_damage_always_changes_the_bytes() -> None:
    from .damage import damaged

    for name in DAMAGES:
        for number in range(20):
            rng = Random(number)
            data = rng.randbytes(rng.randint(1, 300))
            assert damaged(rng, name, data) != data


def test_same_ignores_times_and_nothing_else(tmp_path: Path) -> None:
    a, b = tmp_path / "a/responsivity.json", tmp_path / "b/responsivity.json"
    for path, time, laps in ((a, 1, 2), (b, 9, 2)):
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'{{"milliseconds": {{"total": {time}}}, "laps": {laps}}}')
    assert same(a, b)
    assert same(a.parent, b.parent)
    b.write_text('{"milliseconds": {"total": 1}, "laps": 3}')
    assert not same(a, b)
    assert not same(a.parent, b.parent)
