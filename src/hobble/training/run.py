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
from hobble.training.batches import HELD_OUT, TRAIN, HeldOutErrors, PredictsStandardised
from hobble.training.checkpoint import duration, pack, write_history
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

    For a built network, the history has one line, because every frame is read once. Its checkpoint only
    describes the network; training cannot resume from it.
    """
    data = Database.open(database, training.memory_mb, training.phase_weight, training.scales)

    def write(finished: FinishedNetwork, about: Mapping[str, Any]) -> None:
        write_weights(weights, finished, data, configuration, {**about, "terrain_side": terrain_side})

    if isinstance(network, BuiltOptions):
        began = time.perf_counter()
        built, rows = build(data, network, clips or {})
        seconds = time.perf_counter() - began
        log.info("%s, from %d rows in %s", built.description, rows, duration(seconds))
        write(built, {"passes": 1, "samples": rows, "steps": 0})
        errors = errors_on_held_out(data, StandardisedNetwork(load_network(weights)))
        lines = [[1, 1, rows, seconds, float("nan"), *errors]]
        arrays = {"network": np.array(built.description), "sections": np.array(0)}
    else:
        options = {"network": network, "training": training, "checkpoints": checkpoints}
        state = train(data, **options, threads=threads, start=start, code=code)  # type: ignore[arg-type]
        arrays, lines = pack(state), state.history  # of the last weights, before the best ones replace them
        about = {
            "passes": count_passes(state.sections_done, training.sections),
            "samples": state.samples,
            "steps": state.adam.steps,
            "precision": "bfloat16" if state.half else "float32",
        }
        if training.keep == "best" and state.best is not None:
            state.network.flat.copy_(state.best)
            about["best_section"] = state.sections_done - state.sections_since_best
            log.info("best weights: section %d of %d", about["best_section"], state.sections_done)
        errors = errors_on_held_out(data, state.network, state.network.flat.device)
        if data.row_count(HELD_OUT):
            about["held_out_mse"] = errors[0]
        write(state.network, about)
    write_history(history, data.layout.blocks("y"), lines)
    save_npz(checkpoint, **arrays)


def errors_on_held_out(
    data: Database, network: PredictsStandardised, device: torch.device | str = "cpu"
) -> list[float]:
    """The errors of `HeldOutErrors` on every held-out row, which are also logged."""
    errors = HeldOutErrors(data, torch.device(device), 0).errors_on_every_row(network)
    named = zip(["all outputs", *data.layout.blocks("y")], errors, strict=True)
    log.info("error on every held-out row: %s", ", ".join(f"{name} {error:.4f}" for name, error in named))
    return errors


def build(
    database: Database, network: BuiltOptions, clips: Mapping[str, str | Path]
) -> tuple[FinishedNetwork, int]:
    """Build the network from the training clips; return it and the number of their rows in the database.

    clips: as in `run`. Raises InputError if a file does not fit the database, and HobbleError if
    a clip has no file.
    """
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


def count_passes(sections: int, per_pass: int) -> float:
    """The number of passes that `sections` sections make up; an int if it is whole.

    per_pass: number of sections in a pass.

    >>> count_passes(40, 4), count_passes(1, 4)
    (10, 0.25)
    """
    return sections // per_pass if sections % per_pass == 0 else round(sections / per_pass, 6)
