"""A training that is killed, prolonged or continued ends with the same bits; damaged files are refused."""

import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import _HOST, load_npz, read_json, save_npz, write_json
from hobble.database.reader import Database
from hobble.rows.layout import CONTACTS, GAITS, layout_from_data
from hobble.training import checkpoint
from hobble.training import train as module
from hobble.training.checkpoint import State, pack, recipe_hash

from .conftest import run_in

Settings = dict[str, Any]
Run = Callable[..., State]
LEFT = f".{_HOST}.{1 << 30}.part"  # the end of the name of a file that a process left which lives no more
PROCESS = """
import json, sys
from pathlib import Path
from hobble.database.reader import Database
from hobble.models import network_options
from hobble.training.options import Training
from hobble.training.train import train
sections = json.loads(sys.argv[3])
typed = {"network": network_options(sections["network"]), "training": Training(**sections["training"])}
train(Database.open(sys.argv[1], 64), checkpoints=Path(sys.argv[2]), threads=1, **typed)
"""


def numbers(state: State) -> dict[str, bytes]:
    """All results of a run except times."""
    arrays = pack(state)
    arrays["history"][:, 3] = 0
    return {name: array.tobytes() for name, array in arrays.items() if name != "seconds"}


def sections_in(folder: Path) -> int:
    paths = list(folder.glob("*/checkpoint.npz"))
    return int(load_npz(paths[0])["sections"]) if paths else 0


def test_a_training_killed_at_any_moment_ends_with_the_same_bits(
    small_database: Path, go: Run, network: Settings, training: Settings, tmp_path: Path
) -> None:
    settings = {"network": network, "training": training | {"passes": 8}}
    plain = {name: section.model_dump(mode="json") for name, section in settings.items()}
    killed = tmp_path / "killed"
    command = [sys.executable, "-c", PROCESS, str(small_database), str(killed), json.dumps(plain)]
    process = subprocess.Popen(command)
    while process.poll() is None and not sections_in(killed):
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert 0 < sections_in(killed) < 24
    (next(killed.iterdir()) / f".checkpoint.npz{LEFT}").write_bytes(b"what a kill leaves")
    final = go("killed", passes=8)
    assert numbers(final) == numbers(go("whole", passes=8))
    assert len(final.history) == 24
    assert not list(killed.rglob("*.part"))


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


def test_the_weights_file_is_enough_for_the_runtime(
    small_database: Path, data: Database, go: Run, network: Settings, training: Settings, tmp_path: Path
) -> None:
    first, again = (
        run_in(tmp_path / name, small_database, network, training, terrain_side=31.0) / "weights.npz"
        for name in ("first", "again")
    )
    assert first.read_bytes() == again.read_bytes()
    weights = load_npz(first)
    meta = json.loads(str(weights["meta"]))
    assert layout_from_data("meta", meta["layout"]) == data.layout
    assert list(meta["skeleton"]["joints"]) == list(data.skeleton["joints"])
    assert (meta["gaits"], meta["contacts"]) == (list(GAITS), list(CONTACTS))
    assert (meta["channels"], meta["configuration"]) == ({"injury": ["Hips-LeftLeg"]}, "example")
    assert (meta["kind"], meta["terrain_side"]) == ("pfnn", 31.0)
    assert weights["W0"].shape == (4, 24, data.layout.x_size)
    assert weights["b2"].shape == (4, data.layout.y_size)
    block = next(data.blocks("held_out", 0, 0, data.manifest.visits, 0))
    p, y = np.array([0.25, 0.5]), []
    for row, phase in enumerate(p):  # at a control point the network is that control point's
        x = block.x[row]
        for layer in range(3):
            x = weights[f"W{layer}"][int(phase * 4)] @ x + weights[f"b{layer}"][int(phase * 4)]
            x = np.where(x > 0, x, np.expm1(x)) if layer < 2 else x
        y.append(x)
    ours = go("first/checkpoints").network(
        torch.from_numpy(block.x[:2]), torch.from_numpy(p.astype(np.float32))
    )
    assert np.allclose(ours.numpy(), np.stack(y), rtol=1e-4, atol=1e-4)


def test_the_recipe_hash_has_all_that_determines_a_training(
    data: Database, network: Settings, training: Settings
) -> None:
    name = recipe_hash(network, training, data, "code")
    assert name == recipe_hash(network, training | {"passes": 99, "continues": "x"}, data, "code")
    others = [
        recipe_hash(network.model_copy(update={"units": 25}), training, data, "code"),
        recipe_hash(network, training | {"learning_rate": 0.1}, data, "code"),
        recipe_hash(network, training, data, "other code"),
        recipe_hash(network, training | {"sections": 4}, data, "code"),
    ]
    assert len({name, *others}) == 5


# Artefacts of the database and of the training that were changed without breaking a checksum.


# What is written in place of a value, whatever it was.
JUNK = [None, True, -1, 0.5, 1e300, "", "../x", [], {}, [None]]
ARRAYS: dict[str, Callable[[np.ndarray], Any]] = {
    "gone": lambda a: None,
    "NaN": lambda a: np.full(a.shape, np.nan),
    "text": lambda a: np.full(a.shape, "a"),
    "one axis more": lambda a: a[None],
    "below 0": lambda a: np.full(a.shape, -7, a.dtype) if a.dtype.kind in "iuf" else None,
    "as if empty": lambda a: a.reshape(-1)[:0],
}


def changed(data: Any) -> list[tuple[str, Any]]:
    """Copies of JSON data, each with one value replaced by junk; of a list, only the first item's."""
    if isinstance(data, dict):
        inner = [(f"{k}.{w}", {**data, k: v}) for k in data for w, v in changed(data[k])]
        inner += [(f"without {k}", {n: v for n, v in data.items() if n != k}) for k in data]
    elif isinstance(data, list) and data:
        inner = [(f"0.{w}", [v, *data[1:]]) for w, v in changed(data[0])]
    else:
        inner = []
    return inner + [(repr(junk), junk) for junk in JUNK if junk != data or type(junk) is not type(data)]


def sound(where: str, read: Callable[[], Any]) -> None:
    """`read` either refuses with a message of one line, or gives finite numbers."""
    try:
        found = read()
    except HobbleError as error:
        if "\n" not in str(error):
            return
        raise
    except Exception as error:
        raise AssertionError(f"{where}: {type(error).__name__}: {error}") from error
    for array in found:
        assert np.isfinite(array).all(), where


def test_a_changed_manifest_or_statistics(small_database: Path, tmp_path: Path) -> None:
    path = tmp_path / "db"
    shutil.copytree(small_database, path)
    manifest = read_json(path / "manifest.json")

    def block() -> Any:
        return next(Database.open(path, 64).blocks("train", 0, 0, 3, 1))[:3]

    for where, other in changed(manifest):
        if not where.startswith(("limits", "skeleton")):
            write_json(path / "manifest.json", other)
            sound(where, block)
    write_json(path / "manifest.json", manifest)
    file = path / manifest["folder"] / "statistics.npz"
    arrays = load_npz(file)
    for name in arrays:
        for how, change in ARRAYS.items():
            array = change(arrays[name])
            save_npz(file, **{k: v for k, v in {**arrays, name: array}.items() if v is not None})
            sound(f"{name}: {how}", block)


def test_a_changed_checkpoint(go: Run, tmp_path: Path) -> None:
    go(passes=1)
    file = next(tmp_path.glob("*/*/checkpoint.npz"))
    arrays = load_npz(file)
    for name in set(arrays) - {"recipe"}:
        for how, change in ARRAYS.items():
            array = change(arrays[name])
            if (how == "below 0" and name in ("weights", "first", "best", "history")) or (
                (how, name) == ("NaN", "history")  # as without held-out clips
            ):
                continue
            save_npz(file, **{k: v for k, v in {**arrays, name: array}.items() if v is not None})
            with pytest.raises(InputError, match=r"checkpoint\.npz: "):
                go(passes=1)
