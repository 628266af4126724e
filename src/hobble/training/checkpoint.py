"""The state of a training: its history, its checkpoints, and how a training begins or resumes."""

import hashlib
import json
import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numba
import numpy as np
import torch

from hobble.core.declared import ArrayOf, check_arrays
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import DELETE_IT, Arrays, load_npz, printable, write_tables
from hobble.core.processors import count_cores, multiplies_bfloat16
from hobble.core.skeleton import Skeleton
from hobble.database.chunks import FILE
from hobble.database.reader import Database
from hobble.models.blend import BlendedOptions, TrainableBlend
from hobble.models.model import Options
from hobble.models.step import AutogradStep
from hobble.training import Machines, Training
from hobble.training.optimiser import Adam
from hobble.training.processes import ALONE, Processes

# The columns of history.csv before the held-out errors of the blocks of Y.
COLUMNS = ("pass", "section", "samples", "seconds", "train_mse", "held_out_mse")


def write_history(path: Path, blocks: Iterable[str], rows: Sequence[Sequence[float]]) -> None:
    """Write history.csv. blocks: names of the blocks of Y. rows: the values of the columns for each section.

    Samples and seconds are totals from the start; passes and sections begin at 1. train_mse is the mean over
    the section's batches, with dropout. The held-out errors are measured at the end of the section, without
    dropout. All errors are mean squared errors of the standardised output. A value that is nan (a held-out
    error without held-out clips) is left empty.
    """
    names, lines = [*COLUMNS, *(f"held_out_{name}" for name in blocks)], []
    for row in rows:
        counts, seconds, errors = map(round, row[:3]), round(row[3], 3), (float(f"{v:.8g}") for v in row[4:])
        lines.append(dict(zip(names, (*counts, seconds, *errors), strict=True)))
    write_tables(path.parent, {path.stem: lines})


# Checkpoints. Each is one file with the complete state of a training.


@dataclass
class State:
    """The state of a training after `sections_done` whole sections (parts of a pass), counted from its start.

    adam: the optimiser. samples, seconds: training samples and training time so far. best: the weights with
    the lowest held-out error so far, laid out like `network.flat`. history: one row of numbers per section,
    with the COLUMNS, then the held-out error of each block of Y. recipe: hash of everything that determines
    the result (`run_name`). half: whether products round their factors to bfloat16, as chosen for the machine
    on which the training began.
    There is no state of random generators: pass and section seed the order of the rows and dropout.
    """

    network: TrainableBlend
    adam: Adam
    sections_done: int = 0
    samples: int = 0
    seconds: float = 0.0
    best: torch.Tensor | None = None
    history: list[list[float]] = field(default_factory=list)
    recipe: str = ""
    half: bool = False

    @property
    def tensors(self) -> dict[str, torch.Tensor]:
        """Name in a checkpoint -> each tensor that determines how the training goes on."""
        adam = self.adam
        return {"weights": self.network.flat, "first": adam.first_moment, "second": adam.second_moment}

    def keep_best(self, held_out_mse: float) -> None:
        """Remember the present weights if their held-out error is the lowest so far."""
        if held_out_mse < min(self.held_out_errors, default=float("inf")):
            self.best = self.network.flat.clone()

    @property
    def held_out_errors(self) -> list[float]:
        """The held-out error after each section."""
        return [row[COLUMNS.index("held_out_mse")] for row in self.history]


def pack(state: State) -> dict[str, np.ndarray]:
    """Copies of everything in `state`, as the arrays of a checkpoint file."""
    tensors = {**state.tensors, "best": state.network.flat if state.best is None else state.best}
    return {
        **{name: tensor.detach().cpu().numpy().copy() for name, tensor in tensors.items()},
        "steps": np.array(state.adam.steps),
        "sections": np.array(state.sections_done),
        "samples": np.array(state.samples),
        "seconds": np.array(state.seconds),
        "half": np.array(state.half),
        "history": np.array(state.history, float),
        "network": np.array(state.network.description),
        "recipe": np.array(state.recipe),
    }


# What a checkpoint holds, for a network of N parameters after S sections. If no clip is held out, its history
# has NaN.
DECLARED = {
    "network": ArrayOf((), "U"),
    **{name: ArrayOf(("N",)) for name in ("weights", "first", "best")},
    "second": ArrayOf(("N",), low=0),
    **{name: ArrayOf((), "iu", low=0) for name in ("sections", "steps", "samples")},
    "seconds": ArrayOf((), low=0),
    "half": ArrayOf((), "b"),
    "history": ArrayOf(("S", "columns"), finite=False),
}


def unpack(data: Mapping[str, np.ndarray], state: State, path: Path) -> None:
    """Set `state` from the arrays `data` of the checkpoint `path`.

    Raises InputError if an array is missing or wrong, or if the checkpoint's network has another shape.
    """
    check_arrays(path, data, {"network": DECLARED["network"]}, fix=DELETE_IT)
    described = str(data["network"])
    if described != state.network.description:
        raise InputError(
            path,
            printable(f"holds a network of {described:.200}, not of {state.network.description}", 500),
            fix="Training can resume only with a network of the same shape: change the section network, "
            "or remove training.continues.",
        )
    lengths = {"N": state.network.flat.numel()}
    found = check_arrays(path, data, DECLARED, lengths, DELETE_IT)
    if found["S"] != int(data["sections"]) or found["columns"] < len(COLUMNS):
        raise InputError(path, "its history does not fit its number of sections", fix=DELETE_IT)
    for name, tensor in state.tensors.items():
        tensor.copy_(torch.from_numpy(data[name]))
    state.adam.steps = int(data["steps"])
    state.best, state.half = torch.from_numpy(data["best"]), bool(data["half"])
    state.sections_done, state.samples = int(data["sections"]), int(data["samples"])
    state.seconds, state.history = float(data["seconds"]), data["history"].tolist()


# Prepares a training: sets threads and device, names the run, and reads the checkpoint to resume from.
#
# A run is a training that has a folder of checkpoints of its own.


log = logging.getLogger("hobble.training")

# Keys of the section `training` that the recipe hash leaves out; see `recipe_hash`.
NOT_IN_RECIPE_HASH = ("continues", "device", "keep", *Machines.model_fields)
# Keys of the section `training` that are arguments of `Adam`.
ADAM_KEYS = ("learning_rate", "beta1", "beta2", "l1")
# The arrays of a checkpoint that determine how a training goes on. `run_name` includes them in the run's
# name: weights, first and second (moments of the optimiser), and the numbers of steps and sections so far.
START_ARRAYS = ("weights", "first", "second", "steps", "sections")
# `precision: auto` uses bfloat16 for batches of this many rows or more, in which matrix products take most of
# the time.
BFLOAT16_FROM_BATCH = 256


def use_threads(threads: int) -> None:
    """Set the number of threads of PyTorch and numba, and make PyTorch deterministic.

    threads: the wanted number; it is lowered to the number of cores.
    """
    threads = max(1, min(threads, count_cores(), numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    torch.set_num_threads(threads)
    numba.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    # With deterministic algorithms, PyTorch fills new memory. This costs time and is not needed, because no
    # memory is read before it is written.
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]


def recipe_hash(network: Options, training: Training, database: Database, code: str | None) -> str:
    """A hash of everything that determines the state of a training after each section.

    These are the options, the data and the code. The number of passes is included only if the learning rate
    depends on it. Machines and processes are not included, because a training can resume with others. code: a
    fingerprint of the source code of the training, or None.
    """
    settings = training.model_dump(mode="json", exclude=set(NOT_IN_RECIPE_HASH))
    if training.schedule == "constant":  # more passes only continue a shorter training
        del settings["passes"]
    if training.stretches is None:
        del settings["stretches"]
    data = hashlib.sha256((database.path / FILE).read_bytes()).hexdigest()
    text = json.dumps([network.model_dump(mode="json"), settings, data, code], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def run_name(recipe: str, start: Arrays | None) -> str:
    """The name of a run, and of its folder of checkpoints.

    recipe: the recipe hash. start: arrays of the checkpoint to start from, or None. If it has another recipe,
    the name is a hash of the recipe and of these arrays. Otherwise the name is the recipe hash, because the
    run would reach the same state without this checkpoint.
    """
    if start is None or str(start.get("recipe")) == recipe:
        return recipe
    digest = hashlib.sha256(recipe.encode())
    for name in START_ARRAYS:
        digest.update(start[name].tobytes())
    return digest.hexdigest()[:16]


def begin_or_resume(
    database: Database,
    network: Options,
    training: Training,
    recipe: str,
    checkpoints: Path,
    start: Path | None,
    processes: Processes = ALONE,
) -> tuple[State, Path]:
    """The state to begin with, and the path of the run's own checkpoint.

    recipe: the recipe hash. checkpoints: a folder with a subfolder for each run, called as `run_name` says.
    start: path of another checkpoint to start from, or None.

    The state comes from the run's own checkpoint. If there is none, or if it has more passes than
    `training.passes`, the state comes from `start`, which must have as many sections in a pass. Without
    `start`, it is new. Raises InputError for a checkpoint that is damaged or has a network of another shape.
    If there are several processes, the first one reads the checkpoint and sends the state to the other
    processes. These get `checkpoints` as the path, which they do not use.
    """
    state, path = new_state(database, network, training, processes), checkpoints
    if processes.is_first:
        start_arrays = None if start is None else load_npz(start)
        state.recipe = run_name(recipe, start_arrays)
        data, path = start_arrays, checkpoints / state.recipe / "checkpoint.npz"
        if path.exists():
            own = load_npz(path)
            check_arrays(path, own, {"sections": DECLARED["sections"]}, fix=DELETE_IT)
            data = own if int(own["sections"]) <= training.all_sections else data
        if data is not None:
            unpack(data, state, Path(data.path))
            section = f"section {state.sections_done} of {training.all_sections}"
            log.info("resuming from %s, after %s", data.path, section)
    numbers = (state.adam.steps, state.sections_done, state.samples, state.half)
    numbers = processes.take_from_first(state.tensors.values(), numbers)
    state.adam.steps, state.sections_done, state.samples, state.half = numbers
    return state, path


def new_state(
    database: Database, network: Options, training: Training, processes: Processes = ALONE
) -> State:
    """The state before the first section: a new network for the database's rows, and a new optimiser."""
    skeleton = Skeleton.from_dict(database.skeleton)
    assert isinstance(network, BlendedOptions), "networks of this kind are built from rows without a training"
    device = choose_device(training.device, processes)
    new_network = network.untrained_network(database.layout, skeleton, training.seed).to(device)
    adam = Adam(new_network, **training.model_dump(include=set(ADAM_KEYS)))
    return State(new_network, adam, half=rounds_to_bfloat16(training, device))


def choose_device(wanted: str, processes: Processes = ALONE) -> torch.device:
    """The device to train on. wanted: "auto", "cpu" or "cuda"; "auto" is CUDA if there is a GPU.

    If there are several processes, each one has its own GPU. Raises HobbleError if "cuda" is wanted but not
    available.
    """
    if wanted != "cpu" and torch.cuda.is_available():
        return torch.device("cuda", processes.local_rank)
    if wanted == "cuda":
        raise HobbleError(
            "training.device is cuda, but PyTorch finds no CUDA device here. Set it to auto or cpu"
        )
    return torch.device("cpu")


def rounds_to_bfloat16(training: Training, device: torch.device) -> bool:
    """Whether a training that begins on this machine rounds the factors of matrix products to bfloat16."""
    if training.precision != "auto" or training.batch < BFLOAT16_FROM_BATCH:
        return training.precision == "bfloat16"
    if device.type == "cpu":
        return multiplies_bfloat16()
    return torch.cuda.is_bf16_supported(including_emulation=False)


def step_for(network: TrainableBlend, training: Training, half: bool) -> AutogradStep:
    """The training step for the network's device and the precision of the training. half: see `State`.

    The precision is that of the factors in matrix products; their sums are always float32. TF32 rounds the
    factors to 11 bits. PyTorch switches it on or off for the whole process.
    """
    torch.backends.cuda.matmul.allow_tf32 = training.precision in ("auto", "tf32")
    torch.backends.cuda.matmul.allow_bf16_reduced_precision_reduction = False
    return network.step(training.dropout, half)
