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
from hobble.core.files import DELETE_IT, Arrays, load_npz, printable, write_text
from hobble.core.processors import count_cores, multiplies_bfloat16
from hobble.core.skeleton import Skeleton
from hobble.database.chunks import FILE
from hobble.database.reader import Database
from hobble.models.blend import BlendedOptions, TrainableBlend
from hobble.models.model import Options
from hobble.models.step import AutogradStep
from hobble.training.optimiser import Adam
from hobble.training.options import Machines, Training
from hobble.training.processes import ALONE, Processes

# The columns of history.csv before the held-out errors of the blocks of Y; `columns` explains them.
COLUMNS = ("pass", "section", "samples", "seconds", "train_mse", "held_out_mse")


def columns(blocks: Iterable[str]) -> list[str]:
    """The names of all columns of history.csv. blocks: names of the blocks of Y.

    Samples and seconds are totals from the start; passes and sections begin at 1. train_mse is the mean over
    the section's batches, with dropout. The held-out errors are measured at the end of the section, without
    dropout. All errors are mean squared errors of the standardised output.
    """
    return [*COLUMNS, *(f"held_out_{name}" for name in blocks)]


def write_history(path: Path, blocks: Iterable[str], rows: Sequence[Sequence[float]]) -> None:
    """Write history.csv. blocks: names of the blocks of Y. rows: the values of `columns` for each section.

    A value that is nan (a held-out error without held-out clips) is left empty.
    """
    lines = [",".join(columns(blocks))]
    lines += [",".join(_cell(i, value) for i, value in enumerate(row)) for row in rows]
    write_text(path, "\n".join(lines) + "\n")


def _cell(column: int, value: float) -> str:
    """A value as text: counts in columns 0 to 2, seconds in column 3, then errors."""
    if value != value:  # nan
        return ""
    return str(round(value)) if column < 3 else f"{value:.3f}" if column == 3 else f"{value:.8g}"


# Checkpoints. Each is one file with the complete state of a training.


HELD_OUT_COLUMN = COLUMNS.index("held_out_mse")  # the place of the held-out error in a row of the history


@dataclass
class State:
    """The state of a training after `sections_done` whole sections (parts of a pass), counted from its start.

    adam: the optimiser. samples, seconds: training samples and training time so far. best_mse, best: the
    lowest held-out error so far, and the weights with this error, laid out like `network.flat`. history: one
    row of numbers per section, with the COLUMNS, then the held-out error of each block of Y. recipe: hash of
    everything that determines the result (`run_name`). half: whether products round their factors to
    bfloat16, as chosen for the machine on which the training began.
    There is no state of random generators: pass and section seed the order of the rows and dropout.
    """

    network: TrainableBlend
    adam: Adam
    sections_done: int = 0
    samples: int = 0
    seconds: float = 0.0
    best_mse: float = float("inf")
    best: torch.Tensor | None = None
    history: list[list[float]] = field(default_factory=list)
    recipe: str = ""
    half: bool = False

    def keep_best(self, held_out_mse: float) -> None:
        """Remember the present weights if their held-out error is the lowest so far."""
        if held_out_mse < self.best_mse:
            self.best_mse, self.best = held_out_mse, self.network.flat.clone()

    @property
    def sections_since_best(self) -> int:
        """Number of sections since the one with the lowest held-out error; 0 before the first section."""
        errors = [row[HELD_OUT_COLUMN] for row in self.history]
        return len(errors) - 1 - int(np.argmin(errors)) if errors else 0


def pack(state: State) -> dict[str, np.ndarray]:
    """Copies of everything in `state`, as the arrays of a checkpoint file."""
    best = state.network.flat if state.best is None else state.best
    return {
        "weights": _numpy_copy(state.network.flat),
        "first": _numpy_copy(state.adam.first_moment),
        "second": _numpy_copy(state.adam.second_moment),
        "best": _numpy_copy(best),
        "best_mse": np.array(state.best_mse),
        "steps": np.array(state.adam.steps),
        "sections": np.array(state.sections_done),
        "samples": np.array(state.samples),
        "seconds": np.array(state.seconds),
        "half": np.array(state.half),
        "history": np.array(state.history, float),
        "network": np.array(state.network.description),
        "recipe": np.array(state.recipe),
    }


# What a checkpoint holds, for a network of N parameters after S sections. Held-out errors are NaN, and the
# best one is infinite, if no clip is held out.
DECLARED = {
    "network": ArrayOf((), "U"),
    **{name: ArrayOf(("N",)) for name in ("weights", "first", "best")},
    "second": ArrayOf(("N",), low=0),
    **{name: ArrayOf((), "iu", low=0) for name in ("sections", "steps", "samples")},
    "best_mse": ArrayOf((), low=0, finite=False),
    "seconds": ArrayOf((), low=0),
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
    state.network.flat.copy_(torch.from_numpy(data["weights"]))
    state.adam.first_moment.copy_(torch.from_numpy(data["first"]))
    state.adam.second_moment.copy_(torch.from_numpy(data["second"]))
    state.adam.steps = int(data["steps"])
    state.best, state.best_mse = torch.from_numpy(data["best"]), float(data["best_mse"])
    state.sections_done, state.samples = int(data["sections"]), int(data["samples"])
    state.seconds, state.history = float(data["seconds"]), data["history"].tolist()
    state.half = bool(data.get("half", state.half))


def _numpy_copy(flat: torch.Tensor) -> np.ndarray:
    return flat.detach().cpu().numpy().copy()


# Prepares a training: sets threads and device, names the run, and reads the checkpoint to resume from.
#
# A run is a training that has a folder of checkpoints of its own.


log = logging.getLogger("hobble.training")

# Keys of the section `training` that the recipe hash leaves out; see `recipe_hash`.
NOT_IN_RECIPE_HASH = ("continues", "device", "keep", "patience", *Machines.model_fields)
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
        path = _restore(state, training, recipe, checkpoints, start)
    processes.take_from_first(state.network.flat, state.adam.first_moment, state.adam.second_moment)
    numbers = (state.adam.steps, state.sections_done, state.samples, int(state.half))
    state.adam.steps, state.sections_done, state.samples, half = processes.numbers_of_first(*numbers)
    state.half = bool(half)
    return state, path


def _restore(state: State, training: Training, recipe: str, checkpoints: Path, start: Path | None) -> Path:
    """Fill `state` from the run's own checkpoint or from `start`. Without both, leave it new.

    For the arguments see `begin_or_resume`. Returns the path of the run's own checkpoint.
    """
    start_arrays = None if start is None else load_npz(start)
    state.recipe = run_name(recipe, start_arrays)
    own_path = checkpoints / state.recipe / "checkpoint.npz"
    last_section = training.all_sections
    if own_path.exists():
        data = load_npz(own_path)
        check_arrays(own_path, data, {"sections": DECLARED["sections"]}, fix=DELETE_IT)
        if int(data["sections"]) <= last_section:
            unpack(data, state, own_path)
            log.info("resuming from %s, after section %d of %d", own_path, state.sections_done, last_section)
            return own_path
        log.warning(
            "%s has more than %g passes, so it is not used and the training starts again",
            own_path,
            training.passes,
        )
    if start is not None and start_arrays is not None:
        unpack(start_arrays, state, start)
        if state.recipe != recipe:
            log.warning(
                "%s was made with other settings, data or code; the training resumes from it all the same",
                start,
            )
        log.info("resuming from %s, after section %d of %d", start, state.sections_done, last_section)
    return own_path


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
    has_cuda = torch.cuda.is_available()
    if wanted == "cuda" and not has_cuda:
        raise HobbleError(
            "training.device is cuda, but PyTorch finds no CUDA device here. Set it to auto or cpu"
        )
    if not has_cuda or wanted == "cpu":
        return torch.device("cpu")
    return torch.device("cuda") if processes.is_alone else torch.device("cuda", processes.local_rank)


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
