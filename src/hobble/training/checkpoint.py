"""Checkpoints. Each is one file with the complete state of a training."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from hobble.core.errors import InputError
from hobble.core.files import save_npz
from hobble.models.trainable import Trainable
from hobble.training.history import COLUMNS
from hobble.training.optimiser import Adam

HELD_OUT_COLUMN = COLUMNS.index("held_out_mse")  # the place of the held-out error in a row of the history


@dataclass
class State:
    """The state of a training after `sections_done` whole sections (parts of a pass), counted from its start.

    adam: the optimiser. samples, seconds: training samples and training time so far. best_mse, best: the
    lowest held-out error so far, and the weights with this error, laid out like `network.flat`. history: one
    row of numbers per section, with the COLUMNS of `hobble.training.history`, then the held-out error of each
    block of Y. recipe: hash of everything that determines the result (`hobble.training.start.run_name`).
    There is no state of random generators: pass and section seed the order of the rows and dropout.
    """

    network: Trainable
    adam: Adam
    sections_done: int = 0
    samples: int = 0
    seconds: float = 0.0
    best_mse: float = float("inf")
    best: torch.Tensor | None = None
    history: list[list[float]] = field(default_factory=list)
    recipe: str = ""

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
        "history": np.array(state.history, float),
        "network": np.array(state.network.description),
        "recipe": np.array(state.recipe),
    }


def unpack(data: Mapping[str, np.ndarray], state: State, path: Path) -> None:
    """Set `state` from the arrays `data` of the checkpoint `path`.

    Raises InputError if an array is missing or the checkpoint's network has another shape.
    """
    try:
        described = str(data["network"])
        if described != state.network.description:
            raise InputError(
                path,
                f"holds a network of {described:.200}, not of {state.network.description}",
                fix="Training can resume only with a network of the same shape: change the section network, "
                "or remove training.continues.",
            )
        state.network.flat.copy_(torch.from_numpy(data["weights"]))
        state.adam.first_moment.copy_(torch.from_numpy(data["first"]))
        state.adam.second_moment.copy_(torch.from_numpy(data["second"]))
        state.adam.steps = int(data["steps"])
        state.best, state.best_mse = torch.from_numpy(data["best"]), float(data["best_mse"])
        state.sections_done, state.samples = int(data["sections"]), int(data["samples"])
        state.seconds = float(data["seconds"])
        state.history = data["history"].tolist()
    except KeyError as error:
        raise InputError(path, f"is not a checkpoint of a training: it has no array {error}") from None


def _numpy_copy(flat: torch.Tensor) -> np.ndarray:
    return flat.detach().cpu().numpy().copy()


class Saver:
    """Writes checkpoints to `path` in a background thread, one at a time.

    A file has a temporary name until it is complete, so `path` always holds a whole checkpoint.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        for incomplete in path.parent.glob(f".{path.name}.*.part"):  # left by a run that was killed
            incomplete.unlink()
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="checkpoint")
        self._pending: Future[None] | None = None

    def __enter__(self) -> Saver:
        return self

    def __exit__(self, *_: object) -> None:
        self._worker.shutdown(wait=True)

    def save(self, arrays: dict[str, np.ndarray]) -> None:
        """Wait until the previous checkpoint is on disk, then start to write this one. arrays: from `pack`.

        Raises the errors of writing the previous one.
        """
        self.wait()
        self._pending = self._worker.submit(save_npz, self.path, **arrays)

    def wait(self) -> None:
        """Wait until the last checkpoint is on disk; raises the errors of writing it."""
        if self._pending is not None:
            self._pending.result()
            self._pending = None
