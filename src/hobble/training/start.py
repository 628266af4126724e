"""How a training begins: its threads and device, its name, and where it goes on from."""

from __future__ import annotations

import hashlib
import json
import logging
from pathlib import Path

import numba
import torch

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import Arrays, load_npz
from hobble.core.processors import cores, multiplies_bfloat16
from hobble.core.skeleton import Skeleton
from hobble.database.manifest import FILE
from hobble.database.reader import Database
from hobble.models import model
from hobble.models.model import Trained
from hobble.models.options import Options
from hobble.models.trainable import Step, Trainable
from hobble.training.checkpoint import State, unpack
from hobble.training.optimiser import Adam
from hobble.training.options import Machines, Training
from hobble.training.processes import ALONE, Processes
from hobble.training.schedule import depends_on_passes

log = logging.getLogger("hobble.training")

NOT_IN_THE_NAME = ("continues", "device", "keep", "patience", *Machines.model_fields)
OF_ADAM = ("learning_rate", "beta1", "beta2", "l1")
OF_A_START = ("weights", "first", "second", "steps", "sections")  # what it gives to the run that goes on
HALF_FROM = 256  # batch from which the products take most of the time


def use_threads(threads: int) -> None:
    """Use as many threads in PyTorch and numba, at most one a core, and only algorithms that give the same
    bits again."""
    threads = max(1, min(threads, cores(), numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    torch.set_num_threads(threads)
    numba.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    # Nothing is read before it is written, so nothing has to be filled first.
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]


def recipe_hash(network: Options, training: Training, database: Database, code: str | None) -> str:
    """Names all that determines a training section by section.

    How many passes there are is no part of it, unless the learning rate goes by that. Nor are the machines:
    a training goes on with another number of them.
    code: a fingerprint of the training's source, where there is one.
    """
    kept = training.model_dump(mode="json", exclude=set(NOT_IN_THE_NAME))
    if not depends_on_passes(training):
        del kept["passes"]
    if training.stretches is None:
        del kept["stretches"]
    data = hashlib.sha256((database.path / FILE).read_bytes()).hexdigest()
    text = json.dumps([network.model_dump(mode="json"), kept, data, code], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def run_name(recipe: str, start: Arrays | None) -> str:
    """The recipe, and with it what a run starts from where that was made by another recipe.

    A start of the same recipe is where the run itself would have come by.
    """
    if start is None or str(start.get("recipe")) == recipe:
        return recipe
    name = hashlib.sha256(recipe.encode())
    for part in OF_A_START:
        name.update(start[part].tobytes())
    return name.hexdigest()[:16]


def begin(
    database: Database,
    network: Options,
    training: Training,
    recipe: str,
    checkpoints: Path,
    start: Path | None,
    processes: Processes = ALONE,
) -> tuple[State, Path]:
    """The run's own checkpoint, else the one it is to start from, else a new network; and where its own lies.

    A checkpoint of its own that is past the passes wanted (they were lowered) is left aside. Raises
    InputError where a checkpoint is damaged or of a network of another shape, and where a start is past the
    passes wanted or of other sections. Of several processes the first reads the checkpoint and tells the
    others.
    """
    begun = load_npz(start) if start is not None and processes.first else None
    state = fresh(database, network, training, processes)
    if not processes.first:
        return _told(state, processes), checkpoints
    state, own = _found(state, training, recipe, checkpoints, start, begun)
    return _told(state, processes), own


def _told(state: State, processes: Processes) -> State:
    """Where the first process stands, in all of them."""
    processes.take_from_first(state.network.flat, state.adam.first, state.adam.second)
    numbers = processes.numbers_of_first(state.adam.steps, state.sections, state.samples)
    state.adam.steps, state.sections, state.samples = numbers
    return state


def _found(
    state: State,
    training: Training,
    recipe: str,
    checkpoints: Path,
    start: Path | None,
    begun: Arrays | None,
) -> tuple[State, Path]:
    """A fresh state, set to what a checkpoint holds where there is one; and where its own lies."""
    state.recipe = run_name(recipe, begun)
    own = checkpoints / state.recipe / "checkpoint.npz"
    goal = training.passes * training.sections
    if own.exists():
        data = load_npz(own)
        if int(data.get("sections", 0)) <= goal:
            unpack(data, state, own)
            log.info("going on from %s, after section %d of %d", own, state.sections, goal)
            return state, own
        log.warning("%s is past %d passes; starting anew", own, training.passes)
    if start is not None and begun is not None:
        unpack(begun, state, start)
        _check_start(state, training, start)
        if state.recipe != recipe:
            log.warning("%s was made with other settings, data or code; going on from it all the same", start)
        log.info("going on from %s, after section %d of %d", start, state.sections, goal)
    return state, own


def _check_start(state: State, training: Training, path: Path) -> None:
    """Where a training stands is counted in sections, so those of the start have to be its own."""
    sections = int(max(row[1] for row in state.history)) if state.history else training.sections
    if sections != training.sections:
        raise InputError(
            path,
            f"was trained in {sections} sections a pass, and is to go on in {training.sections}",
            fix=f"Give training.sections {sections}, or leave out training.continues.",
        )
    passes = state.sections // sections
    if passes > training.passes:
        raise InputError(
            path,
            f"stands after {passes} passes, and is to go on to {training.passes}",
            fix=f"Give training.passes more than {passes}, or leave out training.continues.",
        )


def fresh(database: Database, network: Options, training: Training, processes: Processes = ALONE) -> State:
    """A new network, sized for the database's rows, and an optimiser that has not moved."""
    skeleton = Skeleton.from_dict(database.skeleton)
    kind = model(network.kind)
    assert isinstance(kind, Trained), "what is built is not trained"
    new = kind.trainable(network, database.layout, skeleton, training.seed)
    new = new.to(device(training.device, processes))
    return State(new, Adam(new, **training.model_dump(include=set(OF_ADAM))))


def device(wanted: str, processes: Processes = ALONE) -> torch.device:
    """The device of `training.device`: auto, cpu or cuda; of several processes each has a GPU of its own.

    Raises HobbleError where there is no such thing.
    """
    there = torch.cuda.is_available()
    if wanted == "cuda" and not there:
        raise HobbleError("training.device is cuda, but PyTorch finds no CUDA device here; use auto or cpu")
    if not there or wanted == "cpu":
        return torch.device("cpu")
    return torch.device("cuda") if processes.alone else torch.device("cuda", processes.local)


def step_for(network: Trainable, training: Training) -> Step:
    """The way to find gradients that suits the device, the precision wanted and the size of a batch.

    Sums are float32 whatever the factors. TF32, which rounds factors to 11 bits, is a setting of the process.
    """
    on_cpu = network.flat.device.type == "cpu"
    precision = training.precision
    half = precision == "bfloat16"
    if precision == "auto" and training.batch >= HALF_FROM:
        half = multiplies_bfloat16() if on_cpu else torch.cuda.is_bf16_supported(including_emulation=False)
    torch.backends.cuda.matmul.allow_tf32 = precision in ("auto", "tf32")
    torch.backends.cuda.matmul.allow_bf16_reduced_precision_reduction = False
    return network.step(training.dropout, half)
