"""How a training begins: its threads and device, its name, and where it goes on from."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numba
import torch

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.database.manifest import FILE
from hobble.database.reader import Database
from hobble.training.checkpoint import State, unpack
from hobble.training.fused import FusedStep
from hobble.training.network import Network, initialise
from hobble.training.optimiser import Adam
from hobble.training.products import bfloat16_is_fast
from hobble.training.schedule import depends_on_passes
from hobble.training.step import Step

log = logging.getLogger("hobble.training")

NOT_IN_THE_NAME = ("continues", "device")
OF_ADAM = ("learning_rate", "beta1", "beta2", "l1")
HALF_FROM = 256  # batch from which the products take most of the time


def use_threads(threads: int) -> None:
    """Use as many threads in PyTorch and numba, and only algorithms that give the same bits again."""
    threads = max(1, min(threads, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    torch.set_num_threads(threads)
    numba.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)


def recipe_hash(
    network: Mapping[str, Any], training: Mapping[str, Any], database: Database, code: str | None
) -> str:
    """Names all that determines a training section by section.

    How many passes there are is no part of it, unless the learning rate goes by that.
    code: a fingerprint of the training's source, where there is one.
    """
    kept = {key: value for key, value in training.items() if key not in NOT_IN_THE_NAME}
    if not depends_on_passes(training):
        del kept["passes"]
    data = hashlib.sha256((database.path / FILE).read_bytes()).hexdigest()
    text = json.dumps([dict(network), kept, data, code], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def begin(
    database: Database,
    network: Mapping[str, Any],
    training: Mapping[str, Any],
    recipe: str,
    own: Path,
    start: Path | None,
) -> State:
    """The run's own checkpoint, else the one it is to start from, else a new network.

    A checkpoint of its own that is past the passes wanted (they were lowered) is left aside. Raises
    InputError where a checkpoint is damaged or of a network of another shape.
    """
    state = fresh(database, network, training)
    goal = training["passes"] * training["sections"]
    for path in (own, start):
        if path is None or not path.exists():
            continue
        data = load_npz(path)
        if int(data.get("sections", 0)) > goal:
            log.warning("%s is past %d passes; starting anew", path, training["passes"])
            continue
        unpack(data, state, path)
        if str(data.get("recipe")) != recipe:
            log.warning("%s was made with other settings, data or code; going on from it all the same", path)
        log.info("going on from %s, after section %d of %d", path, state.sections, goal)
        break
    return state


def fresh(database: Database, network: Mapping[str, Any], training: Mapping[str, Any]) -> State:
    """A new network, sized for the database's rows, and an optimiser that has not moved."""
    layout = database.layout
    sizes = (layout.x_size, *[network["units"]] * network["hidden_layers"], layout.y_size)
    new = initialise(sizes, network["control_points"], training["seed"]).to(device(training["device"]))
    return State(new, Adam(new, **{key: training[key] for key in OF_ADAM}))


def device(wanted: str) -> torch.device:
    """The device of `training.device`: auto, cpu or cuda. Raises HobbleError where there is no such thing."""
    there = torch.cuda.is_available()
    if wanted == "cuda" and not there:
        raise HobbleError("training.device is cuda, but PyTorch finds no CUDA device here; use auto or cpu")
    return torch.device("cuda" if there and wanted != "cpu" else "cpu")


def step_for(network: Network, training: Mapping[str, Any]) -> Step:
    """The way to find gradients that suits the device, the precision wanted and the size of a batch.

    Sums are float32 whatever the factors. TF32, which rounds factors to 11 bits, is a setting of the process.
    """
    on_cpu = network.flat.device.type == "cpu"
    precision = training["precision"]
    half = precision == "bfloat16"
    if precision == "auto" and training["batch"] >= HALF_FROM:
        half = bfloat16_is_fast() if on_cpu else torch.cuda.is_bf16_supported()
    torch.backends.cuda.matmul.allow_tf32 = precision in ("auto", "tf32")
    return (FusedStep if on_cpu else Step)(network, training["dropout"], half)
