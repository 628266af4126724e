"""The training loop.

A pass goes once through all training samples. It has `training.sections` sections, and each section has many
batches. If the options say so, each batch is augmented: its motion is played slower or faster, other poses
are mixed into its input poses, and the network's earlier errors are added to them. Then the optimiser takes a
step. After each section the loop logs the errors and saves a checkpoint.
"""

from __future__ import annotations

import logging
import time
from pathlib import Path

import numpy as np

from hobble.core.errors import HobbleError
from hobble.database.reader import Database
from hobble.models.model import Options
from hobble.training.augment import augmentations
from hobble.training.batches import HELD_OUT, TRAIN, HeldOutErrors, HostRows, LossWatch
from hobble.training.checkpoint import (
    Saver,
    State,
    begin_or_resume,
    duration,
    pack,
    recipe_hash,
    step_for,
    use_threads,
)
from hobble.training.optimiser import Symmetry, Update
from hobble.training.options import Training
from hobble.training.processes import ALONE, Processes

log = logging.getLogger("hobble.training")


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
    stays), if there are fewer samples than sections, if `keep` or `patience` need a held-out error but no
    clip is held out, and if `symmetric` is set for a network that cannot be symmetric.
    """
    use_threads(threads)
    if (training.patience or training.keep == "best") and not database.row_count(HELD_OUT):
        raise HobbleError(
            "`training.keep: best` and training.patience need the held-out error, but no clip is held out. "
            "List some clips under held_out in the data set."
        )
    if training.symmetric and network.why_not_symmetric:
        raise HobbleError(f"training.symmetric: {network.why_not_symmetric}. Write `symmetric: false`.")
    samples, sections = database.sample_count(TRAIN), training.sections
    if samples < sections:
        raise HobbleError(
            f"{samples} training samples are fewer than training.sections, {sections}. "
            "Lower training.sections, or add clips."
        )
    recipe = recipe_hash(network, training, database, code)
    state, path = begin_or_resume(database, network, training, recipe, Path(checkpoints), start, processes)
    if not processes.is_first:
        _run(state, database, training, processes, None)
        return state
    with Saver(path) as saver:
        _run(state, database, training, processes, TrainingRecorder(state, database, training, saver))
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
    update = Update(step, state.adam, batch_size, processes, _undropped_inputs(database, training))
    symmetry = Symmetry(state.network, database) if training.symmetric else None
    if symmetry and not state.adam.steps:  # no step yet, so the weights are new
        symmetry.make_new_network_symmetric()
    rows = HostRows(database, device, processes, training.stretches)
    augmented = augmentations(database, training, processes.own_places(batch_size), device)
    samples = database.sample_count(TRAIN)
    for index in range(state.sections_done, training.all_sections):
        if (
            training.patience
            and processes.numbers_of_first(state.sections_since_best)[0] >= training.patience
        ):
            log.info("no lower held-out error for %d sections: training ends", training.patience)
            break
        pass_index, section = divmod(index, sections)
        where = f"pass {pass_index + 1} of {training.passes:g}, section {section + 1} of {sections}"
        watch = LossWatch(where, database.clips, processes)
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
            if symmetry:
                symmetry.after_step(state.adam.steps)
        if symmetry:
            symmetry.enforce()
        train_mse = watch.mean()
        processes.check_same(state.network.flat)
        state.sections_done, state.samples = index + 1, state.samples + watch.samples
        if recorder:
            recorder.end_section(where, [pass_index + 1, section + 1], train_mse)
    if recorder:
        recorder.close()


def _undropped_inputs(database: Database, training: Training) -> list[slice]:
    """The blocks of columns of X that dropout never drops: the channels, or none."""
    layout = database.layout
    return [layout.x_channel(name) for name, _ in layout.channels] if training.keep_channels else []


def section_seed(seed: int, index: int) -> int:
    """The seed of dropout in a section, from 0 to 2^63 - 1.

    seed: that of the training. index: number of sections before this one, in all passes.
    """
    # 1 gives other random numbers than 0, which is for the first weights. The shift clears the highest bit.
    return int(np.random.SeedSequence([seed, 1, index]).generate_state(1, np.uint64)[0] >> 1)


class TrainingRecorder:
    """Records a training: held-out errors, history, checkpoints, and one log line a section."""

    def __init__(self, state: State, database: Database, training: Training, saver: Saver) -> None:
        self.state, self.saver = state, saver
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
        self.saver.save(pack(state))
        self._report(where)

    def close(self) -> None:
        """Wait until everything is on disk."""
        self.saver.wait()

    def _report(self, where: str) -> None:
        """Log the errors, the speed and the time left."""
        state, seconds = self.state, time.perf_counter() - self.began
        speed = (state.samples - self.samples_before) / seconds
        left = duration((self.goal - state.samples) / speed)
        train_mse, held_out_mse = state.history[-1][4:6]
        errors = f"error {train_mse:.4f}, held out {held_out_mse:.4f}"
        # The terminal shows the share done and what follows it, see snakemake_logger_plugin_hobble.
        share = 100 * state.samples // self.goal
        log.info("%s: %d %% done, %s left, %s, %s samples/s", where, share, left, errors, f"{speed:,.0f}")
