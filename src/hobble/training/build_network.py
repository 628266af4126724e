"""Builds a network that needs no training, such as motion matching, from the clips."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from hobble.core.errors import HobbleError
from hobble.core.files import save_npz
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models import model_of_kind
from hobble.models.load import load_network
from hobble.models.model import BuiltModel, FinishedNetwork
from hobble.models.network import Network
from hobble.models.options import Options
from hobble.training.batches import TRAIN
from hobble.training.held_out import HeldOutErrors
from hobble.training.history import duration, write_history
from hobble.training.weights import write_weights

log = logging.getLogger("hobble.training")


def build_and_save(
    database: Database,
    clips: Mapping[str, str | Path],
    *,
    configuration: str,
    network: Options,
    weights: Path,
    history: Path,
    checkpoint: Path,
    terrain_side: float,
) -> None:
    """Build a network and write the files that a training would write: weights, history and checkpoint.

    clips: name -> file with the clip's rows in order; it has at least the training clips of the database.
    configuration: its name. terrain_side: distance from the path to the points at its sides where rows have
    ground heights, cm. The history has one line, because every frame is read once. The checkpoint only
    describes the network; training cannot resume from it.
    """
    began = time.perf_counter()
    built, rows = build(database, network, clips)
    seconds = time.perf_counter() - began
    log.info("%s, from %d rows in %s", built.description, rows, duration(seconds))
    about_training = {"passes": 1, "samples": rows, "steps": 0, "terrain_side": terrain_side}
    write_weights(weights, built, database, configuration, about_training)
    blocks = database.layout.blocks("y")
    errors = HeldOutErrors(database, torch.device("cpu"), 0).errors_on_every_row(
        StandardisedNetwork(load_network(weights))
    )
    log.info("error on every held-out row: %.4f", errors[0])
    write_history(history, blocks, [[1, 1, rows, seconds, float("nan"), *errors]])
    save_npz(checkpoint, network=np.array(built.description), sections=np.array(0))


def build(
    database: Database, network: Options, clips: Mapping[str, str | Path]
) -> tuple[FinishedNetwork, int]:
    """Build the network from the training clips; return it and the number of their rows in the database.

    clips: as in `build_and_save`. Raises InputError if a file does not fit the database, and HobbleError if
    a clip has no file.
    """
    kind = model_of_kind(network.kind)
    assert isinstance(kind, BuiltModel), "this kind is trained, not built"
    used = [clip for clip in database.manifest.clips if clip["split"] == TRAIN and clip["rows"]]
    if missing := [clip["clip"] for clip in used if clip["clip"] not in clips]:
        raise HobbleError(
            f"the database has rows of {', '.join(missing)}, but the files of these clips are missing"
        )
    files = [clips[clip["clip"]] for clip in used]
    built = kind.build(network, files, database.layout, Skeleton.from_dict(database.skeleton))
    return built, sum(clip["rows"] for clip in used)


class StandardisedNetwork:
    """A network read from a file, with standardised inputs and outputs like a network in training."""

    def __init__(self, network: Network) -> None:
        self.network, self.outputs = network, len(network.y_mean)

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs x (B, X) at phases p (B,)."""
        n = self.network
        y = n.predict(x.numpy() * n.x_std + n.x_mean, p.numpy())
        return torch.from_numpy((y - n.y_mean) / np.maximum(n.y_std, 1e-30))
