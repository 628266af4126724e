"""Entry point of the stage `training`: from a database on disk to weights, history and checkpoint."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hobble.core.files import save_npz
from hobble.database.reader import Database
from hobble.models import model_of_kind
from hobble.models.model import BuiltModel
from hobble.models.network import TERRAIN_SIDE
from hobble.models.options import Options
from hobble.training.build_network import build_and_save
from hobble.training.checkpoint import State, pack
from hobble.training.held_out import HeldOutErrors
from hobble.training.history import write_history
from hobble.training.options import Training
from hobble.training.train import train
from hobble.training.weights import write_weights

log = logging.getLogger("hobble.training")


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
    if isinstance(model_of_kind(network.kind), BuiltModel):
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
