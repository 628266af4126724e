"""Several processes take the steps of one, on loopback; after one dies, the next run resumes."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.database.write import write_database
from hobble.training import Machines
from hobble.workflow.training_processes import on_machines, train_together

from .conftest import SPLITS, Recipe, clip_rows

IN_FLOAT64 = Path(__file__).with_name("in_float64.py")
# Short batches, roll-outs, poses of other clips, dropout, a rate that changes: all that goes by the place of
# a row in a batch.
HARD = {
    "batch": 90,
    "rollout": 4,
    "other_poses": 0.5,
    "other_paces": 1.2,
    "dropout": 0.2,
    "l1": 0.1,
    "learning_rate": 1e-3,
    "warm_up": 0.5,
    "passes": 1,
    "sections": 2,
    "memory_mb": 64,
    "device": "cpu",
}


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """2,300 samples a pass in many small chunks, far more than fit into the memory of a test."""
    path = tmp_path_factory.mktemp("database") / "all"
    clips = {"walk": clip_rows("walk", 150, 1, 1), "hop": clip_rows("hop", 80, 10, 2)}
    write_database(path, clips, SPLITS, channels=["injury"], joint_weight=0.1, chunk_bytes=12_000)
    return path


def ends(database: Path, folder: Path, processes: int, ways: list[tuple[int, int]]) -> list[Any]:
    """The ends of trainings. ways: numbers of stretches, and of chunks held at a time (0 for all)."""
    jobs = [
        {
            "database": str(database),
            "network": {"kind": "pfnn", "hidden_layers": 2, "units": 24, "control_points": 4},
            "training": HARD | {"stretches": stretches},
            "checkpoints": str(folder / f"{processes}-{number}"),
            "out": str(folder / f"{processes}-{number}.npz"),
            "window": window,
        }
        for number, (stretches, window) in enumerate(ways)
    ]
    job_file = folder / f"{processes}.json"
    job_file.write_text(json.dumps(jobs))
    start = ["-m", "torch.distributed.run", "--standalone", f"--nproc-per-node={processes}"]
    arguments = [*(start if processes > 1 else []), str(IN_FLOAT64), str(job_file)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, *arguments], check=True, env=environment)
    return [dict(np.load(job["out"])) for job in jobs]


def furthest(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
    assert one["steps"] == other["steps"]
    return max(float(np.abs(one[name] - other[name]).max()) for name in ("flat", "first", "second", "losses"))


def test_several_processes_train_like_one(database: Path, tmp_path: Path) -> None:
    """With three stretches for each process, all chunks in memory or three at a time."""
    uncut, *alone = ends(database, tmp_path, 1, [(1, 0), (6, 0), (6, 3)])
    both = ends(database, tmp_path, 2, [(6, 0), (6, 3)])
    for one, other in zip(alone, both, strict=True):
        assert furthest(one, other) < 1e-10
        assert furthest(uncut, other) > 1e-6


@pytest.fixture
def together(database: Path, network: Any, training: Recipe, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Train in several processes as the workflow does, and return the content of the checkpoint."""

    def go(processes: int, folder: str = "checkpoints", **changes: Any) -> dict[str, Any]:
        machines = Machines(processes=processes)
        typed = on_machines(training | HARD | {"sections": 3} | changes, machines, gpus=False)
        given = {"database": database, "network": network, "training": typed, "start": None, "code": None}
        train_together(machines, processes, tmp_path / "log", {**given, "checkpoints": tmp_path / folder})
        return load_npz(next((tmp_path / folder).glob("*/checkpoint.npz")))

    return go


@pytest.mark.slow
def test_after_a_crash_another_number_of_processes_can_resume(
    together: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    import psutil

    def kill_one() -> None:
        while not list((tmp_path / "checkpoints").glob("*/checkpoint.npz")):
            time.sleep(0.01)
        for process in psutil.Process().children(recursive=True):
            if process.environ().get("RANK") == "1":
                process.send_signal(signal.SIGKILL)

    # An earlier test may have left multiprocessing's own process behind.
    before = set(psutil.Process().children(recursive=True))
    killer = threading.Thread(target=kill_one)
    killer.start()
    with pytest.raises(HobbleError, match=r"one of the 2 training processes died"):
        together(2, passes=40)
    killer.join()
    left = set(psutil.Process().children(recursive=True)) - before
    assert not [process for process in left if process.status() != psutil.STATUS_ZOMBIE]
    reached = int(load_npz(next((tmp_path / "checkpoints").glob("*/checkpoint.npz")))["sections"])
    assert 0 < reached < 120
    assert not list((tmp_path / "checkpoints").glob("processes-*"))
    final = together(3, passes=reached // 3 + 1)
    assert int(final["sections"]) == (reached // 3 + 1) * 3
    assert int(final["samples"]) == (reached // 3 + 1) * 2300
    assert f"after section {reached} of" in (tmp_path / "log").read_text()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gpus": 2, "processes": 2}, "one process for each GPU"),
        ({"gpus": 2, "device": "cpu"}, "no `device: cpu`"),
        ({"nodes": 5, "processes": 8}, "one sample for each of 40 processes"),
        ({"stretches": 33}, "one sample for each of 33 processes or stretches"),
        ({"stretches": 4, "processes": 3}, "must be a multiple of the 3 processes"),
        ({"schedule": "cosine", "continues": "holden"}, "`continues` needs `schedule: constant`"),
    ],
)
def test_invalid_settings_are_refused(training: Recipe, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        training | changes
