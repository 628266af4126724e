"""One of the processes of a training, as torchrun starts it: python -m hobble.workflow.process JOB.json

The file has the arguments of `hobble.training.train.train` as plain data, the number of threads and the log.
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


def main(told: Path) -> int:
    """Train with the others; the status of the process, 1 where a message lies beside the file."""
    rank = int(os.environ["RANK"])
    job = json.loads(told.read_text(encoding="utf-8"))
    logger = logging.getLogger("hobble")
    logger.setLevel(logging.INFO if rank == 0 else logging.ERROR)
    to_file = logging.FileHandler(job["log"], encoding="utf-8")
    to_file.setFormatter(logging.Formatter(FORMAT))
    logger.addHandler(to_file)
    try:
        with ends_with_run():
            _train(job)
    except HobbleError as error:
        # The first process's first: what stopped it stopped the others.
        (told.parent / f"error-{rank:05d}").write_text(str(error), encoding="utf-8")
        return 1
    return 0


def _train(job: dict[str, Any]) -> None:
    from hobble.database.reader import Database
    from hobble.models import network_options
    from hobble.training.options import Training
    from hobble.training.processes import joined
    from hobble.training.train import train

    training = Training.model_validate(job["training"])
    with joined(training.device == "cuda") as processes:
        train(
            Database.open(job["database"], training.memory_mb),
            network=network_options(job["network"]),
            training=training,
            checkpoints=Path(job["checkpoints"]),
            threads=job["threads"],
            start=Path(job["start"]) if job["start"] else None,
            code=job["code"],
            processes=processes,
        )


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
