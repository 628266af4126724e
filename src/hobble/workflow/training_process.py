"""Runs one process of a training. torchrun starts: python -m hobble.workflow.training_process JOB.json

JOB.json holds the arguments of `hobble.training.train.train`, the number of threads and the path of the log
file, as plain data. `hobble.workflow.training_processes` writes it.
"""

from __future__ import annotations

import json
import logging
import os
import sys
from pathlib import Path
from typing import Any

from hobble.core.errors import HobbleError
from hobble.workflow.lifetime import ends_with_run

LOG_FORMAT = "%(asctime)s %(levelname)s %(message)s"


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
    file_handler.setFormatter(logging.Formatter(LOG_FORMAT))
    logger.addHandler(file_handler)
    try:
        # If the training has only one machine, this process ends when the job that started torchrun ends.
        with ends_with_run():
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
    from hobble.training.options import Training
    from hobble.training.processes import join_processes
    from hobble.training.train import train

    training = Training.model_validate(job["training"])
    with join_processes(training.device == "cuda") as processes:
        train(
            Database.open(job["database"], training.memory_mb),
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
