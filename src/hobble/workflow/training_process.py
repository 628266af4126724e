"""One process of a training. torchrun starts it as: python -m hobble.workflow.training_process JOB.json

The file holds the arguments of `hobble.training.train.train`, the number of threads and the path of the log,
as plain data.
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

FORMAT = "%(asctime)s %(levelname)s %(message)s"


def main(job_file: Path) -> int:
    """Train together with the other processes. Returns the exit status.

    job_file: path of JOB.json. After a HobbleError the status is 1, and the message is in the file
    error-<rank> beside `job_file`.
    """
    rank = int(os.environ["RANK"])
    job = json.loads(job_file.read_text(encoding="utf-8"))
    logger = logging.getLogger("hobble")
    logger.setLevel(logging.INFO if rank == 0 else logging.ERROR)
    to_file = logging.FileHandler(job["log"], encoding="utf-8")
    to_file.setFormatter(logging.Formatter(FORMAT))
    logger.addHandler(to_file)
    try:
        # On a single machine, this process ends when the job that started torchrun ends.
        with ends_with_run():
            _train(job)
    except HobbleError as error:
        # If several processes fail, the message of the lowest rank is shown.
        (job_file.parent / f"error-{rank:05d}").write_text(str(error), encoding="utf-8")
        return 1
    return 0


def _train(job: dict[str, Any]) -> None:
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
