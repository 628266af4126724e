"""A training in several processes: torchrun starts them, on other machines SLURM's srun starts torchrun."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import socket
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import IO

from hobble.core.errors import HobbleError
from hobble.models.options import Options
from hobble.training.options import Machines, Training
from hobble.workflow import lifetime, process

SLURM = "SLURM_JOB_ID"  # in the environment of a job
GRACE = 10.0  # seconds for torchrun to end its processes


def on_machines(training: Training, machines: Machines, gpus: bool) -> Training:
    """The recipe on these machines: several processes are on GPUs, one each, or all on CPUs."""
    device = training.device if machines.count == 1 else "cuda" if gpus else "cpu"
    own = {"nodes": machines.nodes, **({"gpus": machines.each} if gpus else {"processes": machines.each})}
    return Training.model_validate({**training.model_dump(), **own, "device": device})


def train_together(
    machines: Machines,
    threads: int,
    log: Path,
    *,
    database: Path,
    network: Options,
    training: Training,
    checkpoints: Path,
    start: Path | None,
    code: str | None,
) -> None:
    """Train in `machines.count` processes until the last checkpoint is on disk.

    threads: of all processes of one machine. log: what the processes say goes to its end. The others are as
    in `hobble.training.train.train`; all machines have to see these files. Raises HobbleError with the
    message of the process that could not go on, or the status with which they ended.
    """
    job = {
        "database": str(database),
        "network": network.model_dump(mode="json"),
        "training": training.model_dump(mode="json"),
        "checkpoints": str(checkpoints),
        "start": str(start) if start else None,
        "code": code,
    }
    checkpoints.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="processes-", dir=checkpoints) as folder:
        told = Path(folder, "job.json")
        each = max(1, threads // machines.each)
        told.write_text(json.dumps({**job, "threads": each, "log": str(log)}), encoding="utf-8")
        with open(log, "ab") as said:
            status = _ended(command(machines, told), _environment(machines, each), said)
        errors = [file.read_text(encoding="utf-8") for file in sorted(Path(folder).glob("error-*"))]
    if errors:
        raise HobbleError(errors[0])
    if status:
        raise HobbleError(
            f"one of the {machines.count} processes that train together died, and the others ended with it "
            f"(status {status}). The last checkpoint is kept. The same command goes on from there, also with "
            f"another number of processes. {log} has what they said."
        )


def command(machines: Machines, told: Path) -> list[str]:
    """What starts the processes."""
    torchrun = [sys.executable, "-m", "torch.distributed.run", f"--nproc-per-node={machines.each}"]
    start = ["-m", process.__name__, str(told)]
    if machines.nodes == 1:
        return [*torchrun, "--standalone", *start]
    if SLURM not in os.environ:
        raise HobbleError(
            f"training.nodes is {machines.nodes}, but this is not a job of SLURM, which would start the "
            "processes there. Use the profile slurm, or nodes: 1."
        )
    meeting = [
        f"--nnodes={machines.nodes}",
        "--rdzv-backend=c10d",
        f"--rdzv-endpoint={platform.node()}:{_free_port()}",
        f"--rdzv-id={uuid.uuid4().hex}",
    ]
    srun = ["srun", "--overlap", "--kill-on-bad-exit=1", f"--ntasks={machines.nodes}", "--cpu-bind=none"]
    return [*srun, *torchrun, *meeting, *start]


def _ended(command: list[str], environment: Mapping[str, str], said: IO[bytes]) -> int:
    """The status with which the command ended; it does not outlive this process's wish to stop."""
    started = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, env=environment)
    try:
        return started.wait()
    finally:
        if started.poll() is None:
            started.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                started.wait(GRACE)
            started.kill()


def _environment(machines: Machines, threads: int) -> dict[str, str]:
    """That of this process; on its own machine the others end when it is no more."""
    found = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    found["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    if machines.nodes == 1:
        found[lifetime.RUN_VARIABLE] = lifetime.this_process()
    else:
        found.pop(lifetime.RUN_VARIABLE, None)
    return found


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("", 0))
        return int(one.getsockname()[1])
