"""The stage `training`: from a database on disk to weights, history and checkpoint."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.files import save_npz
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.load import load_network
from hobble.models.model import BuiltOptions, FinishedNetwork, Options
from hobble.models.network import TERRAIN_SIDE, Network, TrainingFacts
from hobble.rows.layout import CONTACTS, GAITS
from hobble.training.batches import TRAIN, HeldOutErrors
from hobble.training.checkpoint import State, duration, pack, write_history
from hobble.training.options import Training
from hobble.training.train import train

UNITS = "centimetres, 60 Hz frames, velocities per frame, right-handed, Y up, +Z forward, +X left"


def write_weights(
    path: Path,
    network: FinishedNetwork,
    database: Database,
    configuration: str,
    about_training: Mapping[str, Any],
) -> None:
    """Write the arrays of the network, of the standardisation and of `TrainingFacts`, and `meta`.

    configuration: its name. about_training: facts such as the numbers of passes and samples, which are added
    to `meta`. (`TrainingFacts`, in contrast, are arrays about the training rows.) Equal arguments give a file
    with equal bytes.
    """
    statistics = database.statistics
    arrays = {
        **network.arrays(),
        "Xmean": statistics.x_mean,
        "Xstd": statistics.x_std,
        "Ymean": statistics.y_mean,
        "Ystd": statistics.y_std,
    }
    arrays |= TrainingFacts.from_rows(database.layout, database.each_row(TRAIN), statistics).arrays()
    save_npz(
        path, **arrays, meta=np.array(network_metadata(network, database, configuration, about_training))
    )


def network_metadata(
    network: FinishedNetwork, database: Database, configuration: str, about_training: Mapping[str, Any]
) -> str:
    """The text of the array `meta`: JSON that says what each column means and how the network was made."""
    skeleton = Skeleton.from_dict(database.skeleton)
    channels = [channel(name) for name, _ in database.layout.channels]
    return json.dumps(
        {
            "kind": network.kind,
            "configuration": configuration,
            "layout": database.layout.to_dict(),
            "skeleton": database.skeleton,
            "gaits": list(GAITS),
            "contacts": list(CONTACTS),
            "channels": {c.name: c.columns(skeleton) for c in channels},
            "limits": database.manifest.limits,
            "units": "; ".join([UNITS, *(f"{c.value_word} 0 to {c.highest:g}" for c in channels)]),
            **network.file_metadata,
            **about_training,
        }
    )  # keys are not sorted, because the skeleton's joints must keep the order of the columns


# Builds a network that needs no training, such as motion matching, from the clips.


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
    assert isinstance(network, BuiltOptions), "this kind is trained, not built"
    used = [clip for clip in database.manifest.clips if clip["split"] == TRAIN and clip["rows"]]
    if missing := [clip["clip"] for clip in used if clip["clip"] not in clips]:
        raise HobbleError(
            f"the database has rows of {', '.join(missing)}, but the files of these clips are missing"
        )
    files = [clips[clip["clip"]] for clip in used]
    built = network.build(files, database.layout, Skeleton.from_dict(database.skeleton))
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


# Entry point of the stage `training`: from a database on disk to weights, history and checkpoint.


def run(
    database: Path,
    *,
    configuration: str,
    network: Options,
    training: Training,
    checkpoints: Path,
    threads: int,
    start: Path | None,
    code: str | None,
    weights: Path,
    history: Path,
    checkpoint: Path,
    terrain_side: float = TERRAIN_SIDE,
    clips: Mapping[str, str | Path] | None = None,
) -> None:
    """Train on the database folder, then write the files `weights`, `history` and `checkpoint`.

    The written weights are the last ones, as in Holden et al. (2017); with `training.keep: best` they are
    those with the lowest held-out error. The checkpoint holds both. configuration: its name. network,
    training, checkpoints, threads, start, code: as in `hobble.training.train.train`. terrain_side: distance
    from the path to the points at its sides where rows have ground heights, cm. clips: name -> file with the
    clip's rows in order, needed only for a network that is built, not trained.
    """
    data = Database.open(database, training.memory_mb).with_phase_weight(training.phase_weight)
    if isinstance(network, BuiltOptions):
        build_and_save(
            data,
            clips or {},
            configuration=configuration,
            network=network,
            weights=weights,
            history=history,
            checkpoint=checkpoint,
            terrain_side=terrain_side,
        )
        return
    state = train(
        data,
        network=network,
        training=training,
        checkpoints=checkpoints,
        threads=threads,
        start=start,
        code=code,
    )
    _write(state, data, configuration, training, terrain_side, weights, history, checkpoint)


def _write(
    state: State,
    data: Database,
    configuration: str,
    training: Training,
    terrain_side: float,
    weights: Path,
    history: Path,
    checkpoint: Path,
) -> None:
    """Measure the held-out error of the finished network, and write the three files."""
    checkpoint_arrays = pack(state)  # of the last state, before the best weights replace the last ones
    about_training = _training_numbers(state, training) | {"terrain_side": terrain_side}
    if training.keep == "best" and state.best is not None:
        state.network.flat.copy_(state.best)
        about_training["best_section"] = state.sections_done - state.sections_since_best
        log.info(
            "best weights: section %d of %d, by the held-out error",
            about_training["best_section"],
            state.sections_done,
        )
    blocks = data.layout.blocks("y")
    errors = HeldOutErrors(data, state.network.flat.device, 0).errors_on_every_row(state.network)
    named = zip(["all outputs", *blocks], errors, strict=True)
    log.info("error on every held-out row: %s", ", ".join(f"{name} {error:.4f}" for name, error in named))
    if data.row_count("held_out"):
        about_training["held_out_mse"] = errors[0]
    write_weights(weights, state.network, data, configuration, about_training)
    write_history(history, blocks, state.history)
    save_npz(checkpoint, **checkpoint_arrays)


def _training_numbers(state: State, training: Training) -> dict[str, Any]:
    """Passes, samples and optimiser steps of a training, for the metadata in the file of its weights."""
    return {
        "passes": count_passes(state.sections_done, training.sections),
        "samples": state.samples,
        "steps": state.adam.steps,
    }


def count_passes(sections: int, per_pass: int) -> float:
    """The number of passes that `sections` sections make up; an int if it is whole.

    per_pass: number of sections in a pass.

    >>> count_passes(40, 4), count_passes(1, 4)
    (10, 0.25)
    """
    return sections // per_pass if sections % per_pass == 0 else round(sections / per_pass, 6)
