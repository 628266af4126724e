"""The stage `training`: from a database on disk to weights, history and checkpoint; the training loop.

A pass goes once through all training samples. It has `training.sections` sections, and each section has many
batches. If the options say so, each batch is augmented: its motion is played slower or faster, other poses
are mixed into its input poses, and the network's earlier errors are added to them. Then the optimiser takes a
step. After each section the loop logs the errors and saves a checkpoint.
"""

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
from hobble.core.messages import format_duration
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.load import load_network
from hobble.models.model import BuiltOptions, FinishedNetwork, Options
from hobble.models.network import TERRAIN_SIDE, Network, TrainingFacts
from hobble.rows.layout import CONTACTS, GAITS
from hobble.training import Training
from hobble.training.augment import augmentations, channel_columns
from hobble.training.batches import HELD_OUT, TRAIN, HeldOutErrors, HostRows, LossWatch, Predict
from hobble.training.checkpoint import (
    State,
    begin_or_resume,
    pack,
    recipe_hash,
    step_for,
    use_threads,
    write_history,
)
from hobble.training.optimiser import STEPS_BETWEEN, Symmetry, Update
from hobble.training.processes import ALONE, Processes

log = logging.getLogger("hobble.training")

UNITS = "centimetres, 60 Hz frames, velocities per frame, right-handed, Y up, +Z forward, +X left"


def train(
    database: Database,
    *,
    network: Options,
    training: Training,
    checkpoints: Path,
    threads: int = 1,
    start: Path | None = None,
    code: str | None = None,
    processes: Processes = ALONE,
) -> State:
    """Train to `training.passes` passes over the database's training clips; returns the final state.

    network, training: the options of a configuration. checkpoints: a folder with a subfolder for each run,
    which is called by a hash of everything that determines the run's result. A run resumes from its own
    checkpoint there. start: a checkpoint to start from if the run has none of its own. If it was trained with
    another recipe (options, data, code), its arrays are also part of the hash. code: a fingerprint of the
    source code of the training, also part of the hash. processes: the group that trains together. Each
    process calls this function; the first one reads and writes checkpoints and records the history.

    The result depends on the arguments and the number of threads, but not on interruptions. Raises
    HobbleError if the training error is not finite (the message names the batch, and the last checkpoint
    stays), if there are fewer samples than sections, and if `keep: best` needs a held-out error but no clip
    is held out.
    """
    use_threads(threads)
    if training.keep == "best" and not database.row_count(HELD_OUT):
        raise HobbleError(
            "`training.keep: best` needs the held-out error, but no clip is held out. List some clips under "
            "held_out in the data set."
        )
    samples, sections = database.sample_count(TRAIN), training.sections
    if samples < sections:
        raise HobbleError(
            f"{samples} training samples are fewer than training.sections, {sections}. "
            "Lower training.sections, or add clips."
        )
    recipe = recipe_hash(network, training, database, code)
    state, path = begin_or_resume(database, network, training, recipe, Path(checkpoints), start, processes)
    recorder = TrainingRecorder(state, database, training, path) if processes.is_first else None
    _run(state, database, training, processes, recorder)
    return state


def _run(
    state: State,
    database: Database,
    training: Training,
    processes: Processes,
    recorder: TrainingRecorder | None,
) -> None:
    """Train section by section, and change `state` in place. recorder: None except in the first process."""
    sections, seed = training.sections, training.seed
    device, batch_size = state.network.flat.device, training.batch
    step = step_for(state.network, training, state.half)
    undropped = channel_columns(database.layout, device) if training.keep_channels else None
    update = Update(step, state.adam, batch_size, processes, undropped)
    symmetry = Symmetry(state.network, database) if training.symmetric else None
    if symmetry and not state.adam.steps:  # no step yet, so the weights are new
        symmetry.make_new_network_symmetric()
    rows = HostRows(database, device, processes, training.stretches)
    augmented = augmentations(database, training, processes.own_places(batch_size), device)
    samples = database.sample_count(TRAIN)
    for index in range(state.sections_done, training.all_sections):
        pass_index, section = divmod(index, sections)
        where = f"pass {pass_index + 1} of {training.passes:g}, section {section + 1} of {sections}"
        watch = LossWatch(where, database.clips)
        step.seed(section_seed(seed, index))
        for augmentation in augmented:
            augmentation.begin_section()
        for batch in rows.batches(pass_index, section, sections, seed, batch_size):
            for augmentation in augmented if len(batch.p) else ():
                augmentation.change(batch)
            rate_share = training.learning_rate_share((state.samples + watch.samples) / samples)
            watch.add(update(batch.x, batch.y, batch.p, rate_share, batch.total), batch)
            for augmentation in augmented:
                augmentation.after(step.error)
            if symmetry and state.adam.steps % STEPS_BETWEEN == 0:
                symmetry.enforce()
        if symmetry:
            symmetry.enforce()
        train_mse = watch.mean()
        processes.check_same(state.network.flat)
        state.sections_done, state.samples = index + 1, state.samples + watch.samples
        if recorder:
            recorder.end_section(where, [pass_index + 1, section + 1], train_mse)


def section_seed(seed: int, index: int) -> int:
    """The seed of dropout in a section, from 0 to 2^63 - 1.

    seed: that of the training. index: number of sections before this one, in all passes.
    """
    # 1 gives other random numbers than 0, which is for the first weights. The shift clears the highest bit.
    return int(np.random.SeedSequence([seed, 1, index]).generate_state(1, np.uint64)[0] >> 1)


class TrainingRecorder:
    """Records a training: held-out errors, history, checkpoints in `path`, and one log line a section."""

    def __init__(self, state: State, database: Database, training: Training, path: Path) -> None:
        self.state, self.path = state, path
        samples = database.sample_count(TRAIN)
        self.held_out = HeldOutErrors(database, state.network.flat.device, samples // training.sections)
        self.goal = round(training.passes * samples)  # samples of the whole training
        self.samples_before, self.seconds_before = state.samples, state.seconds  # before this process began
        self.began = time.perf_counter()

    def end_section(self, where: str, place: list[int], train_mse: float) -> None:
        """Measure the network on the held-out clips, add a row to the history, save a checkpoint, log.

        where: names the pass and the section in the log. place: their numbers, from 1. train_mse: mean loss
        of the section.
        """
        state = self.state
        state.seconds = self.seconds_before + time.perf_counter() - self.began
        errors = self.held_out.errors(state.network)
        state.keep_best(errors[0])
        state.history.append([*place, state.samples, state.seconds, train_mse, *errors])
        save_npz(self.path, **pack(state))
        speed = (state.samples - self.samples_before) / (time.perf_counter() - self.began)
        left = format_duration((self.goal - state.samples) / speed)
        said = f"{left} left, error {train_mse:.4f}, held out {errors[0]:.4f}, {speed:,.0f} samples/s"
        # The terminal shows the share done and what follows it, see snakemake_logger_plugin_hobble.
        log.info("%s: %d %% done, %s", where, 100 * state.samples // self.goal, said)


# From a database to the files of a network.


def write_weights(
    path: Path,
    network: FinishedNetwork,
    database: Database,
    configuration: str,
    about_training: Mapping[str, Any],
) -> None:
    """Write the arrays of the network, of the standardisation and of `TrainingFacts`, and `meta`.

    `meta` is JSON that says what each column means and how the network was made. configuration: its name.
    about_training: facts such as the numbers of passes and samples, which are added to `meta`.
    (`TrainingFacts`, in contrast, are arrays about the training rows.) Equal arguments give a file with equal
    bytes.
    """
    statistics, layout = database.statistics, database.layout
    arrays = {
        **network.arrays,
        "Xmean": statistics.x_mean,
        "Xstd": statistics.x_std,
        "Ymean": statistics.y_mean,
        "Ystd": statistics.y_std,
    }
    arrays |= TrainingFacts.from_rows(layout, database.each_row(TRAIN), statistics).arrays()
    skeleton, channels = Skeleton.from_dict(database.skeleton), [channel(name) for name, _ in layout.channels]
    meta = {
        "kind": network.kind,
        "configuration": configuration,
        "layout": layout.to_dict(),
        "skeleton": database.skeleton,
        "gaits": list(GAITS),
        "contacts": list(CONTACTS),
        "channels": {c.name: c.columns(skeleton) for c in channels},
        "exponents": {c.name: c.exponent for c in channels},
        "limits": database.manifest.limits,
        "units": "; ".join([UNITS, *(f"{c.value_word} 0 to {c.highest:g}" for c in channels)]),
        **network.meta,
        **about_training,
    }
    # Keys are not sorted, because the skeleton's joints must keep the order of the columns.
    save_npz(path, **arrays, meta=np.array(json.dumps(meta)))


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
    training, checkpoints, threads, start, code: as in `train`. terrain_side: distance
    from the path to the points at its sides where rows have ground heights, cm. clips: name -> file with the
    clip's rows in order, needed only for a network that is built, not trained.

    For a built network, the history has one line, because every frame is read once. Its checkpoint only
    describes the network; training cannot resume from it.
    """
    use_threads(threads)
    data = Database.open(database, training.memory_mb, training.phase_weight, training.scales)

    def write(finished: FinishedNetwork, about: Mapping[str, Any]) -> None:
        write_weights(weights, finished, data, configuration, {**about, "terrain_side": terrain_side})

    if isinstance(network, BuiltOptions):
        began = time.perf_counter()
        used = [clip for clip in data.manifest.clips if clip["split"] == TRAIN and clip["rows"]]
        files, rows = [(clips or {})[clip["clip"]] for clip in used], sum(clip["rows"] for clip in used)
        built = network.build(files, data.layout, Skeleton.from_dict(data.skeleton))
        seconds = time.perf_counter() - began
        log.info("%s, from %d rows in %s", built.description, rows, format_duration(seconds))
        write(built, {"passes": 1, "samples": rows, "steps": 0})
        errors = errors_on_held_out(data, standardised(load_network(weights)))
        lines = [[1, 1, rows, seconds, float("nan"), *errors]]
        arrays = {"network": np.array(built.description), "sections": np.array(0)}
    else:
        options = {"network": network, "training": training, "checkpoints": checkpoints}
        state = train(data, **options, threads=threads, start=start, code=code)  # type: ignore[arg-type]
        arrays, lines = pack(state), state.history  # of the last weights, before the best ones replace them
        about = {
            "passes": training.passes,
            "samples": state.samples,
            "steps": state.adam.steps,
            "precision": "bfloat16" if state.half else "float32",
        }
        if training.keep == "best" and state.best is not None:
            state.network.flat.copy_(state.best)
            about["best_section"] = 1 + int(np.argmin(state.held_out_errors))
        errors = errors_on_held_out(data, state.network, state.network.flat.device)
        if data.row_count(HELD_OUT):
            about["held_out_mse"] = errors[0]
        write(state.network.finished(), about)
    write_history(history, data.layout.blocks("y"), lines)
    save_npz(checkpoint, **arrays)


def errors_on_held_out(data: Database, network: Predict, device: torch.device | str = "cpu") -> list[float]:
    """The errors of `HeldOutErrors` on every held-out row, which are also logged."""
    errors = HeldOutErrors(data, torch.device(device), 0).errors(network, every_row=True)
    named = zip(["all outputs", *data.layout.blocks("y")], errors, strict=True)
    log.info("error on every held-out row: %s", ", ".join(f"{name} {error:.4f}" for name, error in named))
    return errors


def standardised(network: Network) -> Predict:
    """A network that was read from a file, with standardised inputs and outputs like one in training."""

    def predict(x: Tensor, p: Tensor) -> Tensor:
        y = network.predict(x.numpy() * network.x_std + network.x_mean, p.numpy())
        return torch.from_numpy((y - network.y_mean) / np.maximum(network.y_std, 1e-30))

    return predict
