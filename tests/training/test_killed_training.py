"""A training that is killed goes on and ends with the same bits."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.files import _HOST, load_npz, save_npz
from hobble.database.reader import Database
from hobble.training import train as module
from hobble.training.checkpoint import State, pack
from hobble.training.train import train

Settings = dict[str, Any]
LEFT = f".{_HOST}.{1 << 30}.part"  # the end of the name of a file that a process left which lives no more


HURRIED = {"schedule": "cosine", "warm_up": 0.3, "rollout": 4, "batch": 256}


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


def test_a_training_killed_at_any_moment_ends_with_the_same_bits(
    small_database: Path, data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    settings = {"network": network, "training": training | {"passes": 8}}
    plain = {name: section.model_dump(mode="json") for name, section in settings.items()}
    killed = tmp_path / "killed"
    command = [sys.executable, "-c", PROCESS, str(small_database), str(killed), json.dumps(plain)]
    process = subprocess.Popen(command)
    while process.poll() is None and not _sections(killed):
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert 0 < _sections(killed) < 24
    (next(killed.iterdir()) / f".checkpoint.npz{LEFT}").write_bytes(b"what a kill leaves")
    final = train(data, **settings, checkpoints=killed, threads=1)
    assert _numbers(final) == _numbers(train(data, **settings, checkpoints=tmp_path / "whole", threads=1))
    assert len(final.history) == 24
    assert not list(killed.rglob("*.part"))


def _sections(folder: Path) -> int:
    paths = list(folder.glob("*/checkpoint.npz"))
    return int(load_npz(paths[0])["sections"]) if paths else 0


@pytest.mark.parametrize(
    ("recipe", "written", "number"),
    [(HURRIED, True, 1), (HURRIED, False, 3)],
)
def test_a_training_killed_at_any_write_ends_with_the_same_bits(
    data: Database,
    network: Settings,
    training: Settings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    recipe: Settings,
    written: bool,
    number: int,
) -> None:
    """Killed while a checkpoint is half written, and right after it has got its name."""
    arguments: Settings = {"network": network, "training": training | recipe, "threads": 1}
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
            train(data, **arguments, checkpoints=tmp_path / "killed")
    final = train(data, **arguments, checkpoints=tmp_path / "killed")
    whole = train(data, **arguments, checkpoints=tmp_path / "whole")
    assert _numbers(final) == _numbers(whole)
    assert not list(tmp_path.rglob("*.part"))


def _numbers(state: State) -> dict[str, bytes]:
    """All results of a run except times."""
    arrays = pack(state)
    arrays["history"][:, 3] = 0
    return {name: array.tobytes() for name, array in arrays.items() if name != "seconds"}
