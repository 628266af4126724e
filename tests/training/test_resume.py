"""A training that is killed, prolonged or continued ends with the same bits; damaged files are refused."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import _HOST, load_npz, save_npz
from hobble.database.reader import Database
from hobble.training import checkpoint
from hobble.training import train as module
from hobble.training.checkpoint import State, pack
from tests.faults.damage import change_file

from .conftest import run_in

Settings = dict[str, Any]
Run = Callable[..., State]
LEFT = f".{_HOST}.{1 << 30}.part"  # the end of the name of a file that a process left which lives no more


def numbers(state: State) -> dict[str, bytes]:
    """All results of a run except times."""
    arrays = pack(state)
    arrays["history"][:, 3] = 0
    return {name: array.tobytes() for name, array in arrays.items() if name != "seconds"}


@pytest.mark.parametrize(("written", "number"), [(True, 1), (False, 3)])
def test_a_training_killed_at_any_write_ends_with_the_same_bits(
    go: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: bool, number: int
) -> None:
    """Killed while a checkpoint is half written, and right after it has got its name."""
    recipe = {"schedule": "cosine", "warm_up": 0.3, "rollout": 4, "batch": 256}
    count = iter(range(100))

    def dying(path: Path, **arrays: np.ndarray) -> None:
        if next(count) != number:
            return save_npz(path, **arrays)
        if written:
            save_npz(path, **arrays)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.with_name(f".{path.name}{LEFT}").write_bytes(b"half of it")
        raise SystemExit

    with monkeypatch.context() as patch:
        patch.setattr(module, "save_npz", dying)
        with pytest.raises(SystemExit):
            go("killed", **recipe)
    assert numbers(go("killed", **recipe)) == numbers(go("whole", **recipe))
    assert not list(tmp_path.rglob("*.part"))


def test_more_passes_resume_and_fewer_start_again(
    data: Database, go: Run, training: Settings, tmp_path: Path
) -> None:
    """A fraction of a pass is its first sections."""
    third, whole = go("a", passes=1 / 3), go("b", passes=1)
    assert third.samples == data.section_sample_count("train", 0, 3) < data.sample_count("train")
    assert [row[:3] for row in third.history] == [row[:3] for row in whole.history[:1]]
    for passes in (1, 7 / 3):
        resumed = go("a", passes=passes)
        assert len(resumed.history) == round(3 * passes)
        assert torch.equal(resumed.network.flat, go(f"to {passes}", passes=passes).network.flat)
    assert len(list((tmp_path / "a").iterdir())) == 1
    assert torch.equal(go("a").network.flat, go("c").network.flat)
    with pytest.raises(ValueError, match="whole number"):
        training | {"passes": 0.5}


def test_a_resumed_training_keeps_the_precision_with_which_it_began(
    go: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first part ran on a machine that multiplies bfloat16, the second does not."""
    half = {"batch": 256, "precision": "auto"}
    monkeypatch.setattr(checkpoint, "multiplies_bfloat16", lambda: True)
    whole = go("whole", **half)
    go("cut", passes=1, **half)
    monkeypatch.setattr(checkpoint, "multiplies_bfloat16", lambda: False)
    resumed, other = go("cut", **half), go("other", **half)
    assert resumed.half
    assert torch.equal(resumed.network.flat, whole.network.flat)
    assert not torch.equal(other.network.flat, whole.network.flat)


def test_continuing_a_configuration_equals_one_longer_training(
    small_database: Path, network: Settings, training: Settings, tmp_path: Path
) -> None:
    def to(name: str, passes: int, start: str | None) -> dict[str, np.ndarray]:
        recipe = training | {"passes": passes, "continues": start}
        begun = tmp_path / start / "checkpoint.npz" if start else None
        run_in(tmp_path / name, small_database, network, recipe, start=begun, code="fingerprint")
        return load_npz(tmp_path / name / "weights.npz")

    to("holden", 2, None)
    continued, scratch = to("holden-xt", 4, "holden"), to("scratch", 4, None)
    for name in continued:
        if name != "meta":
            assert np.array_equal(continued[name], scratch[name]), name
    assert len((tmp_path / "holden-xt" / "history.csv").read_text().splitlines()) == 1 + 4 * 3
    assert json.loads(str(continued["meta"]))["passes"] == 4
    names = ("holden-xt", "holden", "scratch")
    assert [load_npz(tmp_path / name / "checkpoint.npz")["steps"] for name in names] == [288, 144, 288]


def test_another_start_network_ignores_the_earlier_checkpoint(go: Run, network: Any, tmp_path: Path) -> None:
    """A run with its own recipe and another start does not use its earlier checkpoint."""
    first, second = (tmp_path / f"start {seed}.npz" for seed in (1, 2))
    for seed, path in enumerate((first, second), 1):
        save_npz(path, **pack(go(path.stem, seed=seed)))

    def to(folder: str, start: Path | None) -> torch.Tensor:
        return go(folder, start, passes=3, learning_rate=5e-4).network.flat

    one = to("run", first)
    assert torch.equal(to("run", second), to("fresh", second))
    assert torch.equal(to("run", None), to("scratch", None))
    assert torch.equal(to("run", first), one)
    assert not torch.equal(to("run", second), one)
    assert len(list((tmp_path / "run").iterdir())) == 3
    # `hobble.workflow.project` refuses other sections and fewer passes, before the run.
    with pytest.raises(InputError, match=r"start 1\.npz: holds a network of \d+-24-24-.* not of .*-30-30-"):
        go("other", first, kind=network.model_copy(update={"units": 30}))


# Artefacts of the database and of the training that were changed without breaking a checksum.


@pytest.mark.parametrize("name", ["manifest.json", "statistics.npz"])
def test_a_changed_manifest_or_statistics(small_database: Path, tmp_path: Path, name: str) -> None:
    """Each is refused in one line, or gives finite numbers."""
    folder = tmp_path / "db"
    shutil.copytree(small_database, folder)
    path, refusals = next(folder.rglob(name)), []
    whole = path.read_bytes()
    for number in range(80):
        path.write_bytes(whole)
        change_file(Random(f"{name}-{number}"), path)
        try:
            found = next(Database.open(folder, 64).blocks("train", 0, 0, 3, 1))[:3]
        except HobbleError as error:
            refusals.append(str(error))
        else:
            assert all(np.isfinite(array).all() for array in found), number
    assert refusals
    assert not [said for said in refusals if "\n" in said]


def test_a_changed_checkpoint(go: Run, tmp_path: Path) -> None:
    go(passes=1)
    path = next(tmp_path.glob("*/*/checkpoint.npz"))
    arrays = load_npz(path)
    for name in set(arrays) - {"recipe", "history"}:  # a history may lack numbers
        array = arrays[name]
        for wrong in (array[None], np.full(array.shape, np.nan), np.full(array.shape, "a")):
            save_npz(path, **{**arrays, name: wrong})
            with pytest.raises(InputError, match=r"checkpoint\.npz: "):
                go(passes=1)
