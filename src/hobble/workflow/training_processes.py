"""Trains in several processes, which torchrun starts. On several machines, SLURM's srun starts torchrun.

A process is `python -m hobble.workflow.training_processes JOB.json`. JOB.json holds the arguments of
`hobble.training.train.train`, the number of threads and the path of the log file, as plain data.
"""

import json
import logging
import os
import platform
import socket
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hobble.core.errors import HobbleError
from hobble.core.section import Section
from hobble.training import Machines, Training
from hobble.workflow import lifetime

SLURM_VARIABLE = "SLURM_JOB_ID"  # environment variable that SLURM sets in a job
GRACE_SECONDS = 10.0  # time for torchrun to end its processes


def on_machines(training: Training, machines: Machines, gpus: bool) -> Training:
    """The training options with the numbers of machines and processes, and the device, for these machines.

    machines: `processes` is the number of processes of each machine, also with GPUs. gpus: whether each
    process uses a GPU; a single process uses the device of `training` instead.
    """
    device = training.device if machines.count == 1 else "cuda" if gpus else "cpu"
    keys = {"nodes": machines.nodes, "gpus" if gpus else "processes": machines.processes_per_node}
    return Training.model_validate({**training.model_dump(), **keys, "device": device})


def train_together(machines: Machines, threads: int, log: Path, arguments: Mapping[str, Any]) -> None:
    """Train in `machines.count` processes. Returns when the last checkpoint is on disk.

    threads: number of threads of all processes of one machine together. log: file to which the output of the
    processes is appended. arguments: `database`, `network`, `training`, `checkpoints`, `start` and `code` of
    `hobble.training.train.train`. All machines must be able to read and write them. Raises HobbleError if
    a process fails, with its message or with the exit status.
    """
    job: dict[str, Any] = {
        name: value.model_dump(mode="json") if isinstance(value, Section) else value and str(value)
        for name, value in arguments.items()
    }
    checkpoints = Path(job["checkpoints"])
    checkpoints.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="processes-", dir=checkpoints) as folder:
        job_file = Path(folder, "job.json")
        own_threads = max(1, threads // machines.processes_per_node)  # of each process
        job_file.write_text(json.dumps({**job, "threads": own_threads, "log": str(log)}), encoding="utf-8")
        with open(log, "ab") as output:
            streams: Any = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": output}
            environment = _environment(machines, own_threads)
            process = subprocess.Popen(command(machines, job_file), **streams, env=environment)
            try:
                status = process.wait()
            finally:
                if process.poll() is None:
                    lifetime.end_children(os.getpid(), GRACE_SECONDS)
        errors = [file.read_text(encoding="utf-8") for file in sorted(Path(folder).glob("error-*"))]
    if errors:
        raise HobbleError(errors[0])
    if status:
        raise HobbleError(
            f"one of the {machines.count} training processes died, and the others ended with it "
            f"(exit status {status}). The output of the processes is in {log}. The same command continues "
            "from the last checkpoint, also with another number of processes."
        )


def command(machines: Machines, job_file: Path) -> list[str]:
    """The command that starts the processes. job_file: the arguments of `train` as JSON.

    Raises HobbleError for several machines without SLURM.
    """
    count = f"--nproc-per-node={machines.processes_per_node}"
    torchrun = [sys.executable, "-m", "torch.distributed.run", count]
    program = ["-m", "hobble.workflow.training_processes", str(job_file)]
    if machines.nodes == 1:
        return [*torchrun, "--standalone", *program]
    if SLURM_VARIABLE not in os.environ:
        raise HobbleError(
            f"training.nodes is {machines.nodes}, but this is not a SLURM job, so the processes cannot be "
            "started on other machines. Use the profile slurm, or nodes: 1."
        )
    with socket.socket() as probe:  # a TCP port that no program on this machine uses
        probe.bind(("", 0))
        port = int(probe.getsockname()[1])
    rendezvous = [
        f"--nnodes={machines.nodes}",
        "--rdzv-backend=c10d",
        f"--rdzv-endpoint={platform.node()}:{port}",
        f"--rdzv-id={uuid.uuid4().hex}",
    ]
    srun = ["srun", "--overlap", "--kill-on-bad-exit=1", f"--ntasks={machines.nodes}", "--cpu-bind=none"]
    return [*srun, *torchrun, *rendezvous, *program]


def _environment(machines: Machines, threads: int) -> dict[str, str]:
    """Environment variables for the training processes. threads: number of threads of each.

    If there is only one machine, the variables make the processes end when this process ends.
    """
    variables = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    variables["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    if machines.nodes == 1:
        variables[lifetime.RUN_VARIABLE] = str(os.getpid())
    else:  # other machines cannot see whether this process runs
        variables.pop(lifetime.RUN_VARIABLE, None)
    return variables


def main(job_file: Path) -> int:
    """Train together with the other processes. Returns the exit status.

    job_file: path of JOB.json. After a HobbleError the status is 1, and the message is in the file
    error-<rank> beside `job_file`, where the rank is the number of this process, from 0.
    """
    rank = int(os.environ["RANK"])  # torchrun sets it
    job = json.loads(job_file.read_text(encoding="utf-8"))
    logger = logging.getLogger("hobble")
    logger.setLevel(logging.INFO if rank == 0 else logging.ERROR)  # one process logs for all
    file_handler = logging.FileHandler(job["log"], encoding="utf-8")
    file_handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger.addHandler(file_handler)
    try:
        # If the training has only one machine, this process ends when the job that started torchrun ends.
        with lifetime.ends_with_run():
            _train(job)
    except HobbleError as error:
        # If several processes fail, the user sees the message of the lowest rank. Five digits keep the file
        # names in the order of the ranks.
        (job_file.parent / f"error-{rank:05d}").write_text(str(error), encoding="utf-8")
        return 1
    return 0


def _train(job: dict[str, Any]) -> None:
    """Train together with the other processes. job: the content of JOB.json."""
    from hobble.database.reader import Database
    from hobble.models import network_options
    from hobble.training.processes import join_processes
    from hobble.training.train import train

    training = Training.model_validate(job["training"])
    with join_processes(training.device == "cuda") as processes:
        train(
            Database.open(job["database"], training.memory_mb, training.phase_weight, training.scales),
            network=network_options(job["network"]),
            training=training,
            checkpoints=Path(job["checkpoints"]),
            threads=job["threads"],
            start=Path(job["start"]) if job["start"] else None,
            code=job["code"],  # hash of the source code
            processes=processes,
        )


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
