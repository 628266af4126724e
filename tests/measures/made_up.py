"""Made-up motion for several tests: captured walks, rows of random values, and a network that fits them."""

import json
from collections.abc import Collection, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.measures.accuracy_run import RollOutCrowd, RollOutInputs
from hobble.measures.measure import MeasureInputs
from hobble.models.load import NEEDED_ROLES
from hobble.models.network import Predictor
from hobble.rows.clip_rows import Captured, ClipRows, save_clip_rows
from hobble.rows.layout import GAITS, RowLayout

LAYOUT = RowLayout(3, channels=(("injury", 1),))
SKELETON = {
    "name": "stick",
    "joints": {
        n: {"parent": p, "offset": [0, 1, 0]} for n, p in (("Hips", None), ("Arm", "Hips"), ("Foot", "Hips"))
    },
    "roles": dict.fromkeys(NEEDED_ROLES, "Foot") | {"hips": "Hips"},
    "links": [["Hips", "Arm"]],
}


def captured_walk(name: str, local: np.ndarray, channels: Mapping[str, np.ndarray]) -> Captured:
    """A walk straight ahead with the joints `local` (F, J, 3). channels: name -> (F, columns)."""
    frames = len(local)
    contacts, still, rows = np.zeros((frames, 4)), np.zeros(frames), np.arange(frames)
    contacts[:, 0] = contacts[:, 3] = np.sin(2 * np.pi * rows / 60) > 0
    gait = np.tile(np.eye(len(GAITS))[GAITS.index("walk")], (frames, 1))
    velocity, root = np.tile([0.0, 2.0], (frames, 1)), np.zeros((frames, 3))
    root[:, 2] = 2.0 * rows
    return Captured(name, local, contacts, still, dict(channels), gait, velocity, root, still, rows)


def random_rows(
    clip: str,
    rows: int,
    fits: int,
    seed: int,
    layout: RowLayout = LAYOUT,
    skeleton: Any = SKELETON,
    spread: float = 5.0,
) -> ClipRows:
    """Random rows with `fits` fits each, and severities from 0 to 10. spread: of Y."""
    rng = np.random.default_rng(seed)
    return ClipRows(
        clip,
        layout,
        skeleton,
        rng.normal(size=(rows, layout.x_terrain.start)).astype(np.float32),
        rng.normal(2, spread, (rows, layout.y_size)).astype(np.float32),
        rng.random(rows).astype(np.float32),
        {name: rng.random((rows, columns)).astype(np.float32) * 10 for name, columns in layout.channels},
        np.arange(rows),
        np.zeros(rows, int),
        np.full(rows, fits),
        rng.normal(size=(rows * fits, 36)).astype(np.float32),
        rng.normal(size=rows * fits).astype(np.float32),
    )


def made_up_inputs(
    folder: Path, clips: Mapping[str, ClipRows], held_out: Collection[str] = ()
) -> MeasureInputs:
    """A random network and these clips as the inputs of a measurement, with files in `folder`."""
    files = {name: folder / f"{name}.npz" for name in clips}
    for name, rows in clips.items():
        save_clip_rows(files[name], rows)
    splits = {name: "held_out" if name in held_out else "train" for name in clips}
    return MeasureInputs("made up", {"weights": random_network(folder / "weights.npz")}, files, splits)


def random_network(path: Path) -> Path:
    """Write a network with random weights for rows of LAYOUT. Returns `path`."""
    rng = np.random.default_rng(0)
    arrays: dict[str, np.ndarray] = {}
    for i, (a, b) in enumerate(pairwise((LAYOUT.x_size, 16, 16, LAYOUT.y_size))):
        arrays[f"W{i}"] = rng.normal(0, 0.2, (4, b, a)).astype(np.float32)
        arrays[f"b{i}"] = rng.normal(0, 0.1, (4, b)).astype(np.float32)
    for name, size in (("X", LAYOUT.x_size), ("Y", LAYOUT.y_size)):
        arrays[f"{name}mean"] = rng.normal(size=size).astype(np.float32)
        arrays[f"{name}std"] = (rng.random(size) + 0.5).astype(np.float32)
    meta = {"layout": LAYOUT.to_dict(), "skeleton": SKELETON, "channels": {"injury": ["Hips-Arm"]}}
    np.savez(path, **arrays, meta=np.array(json.dumps(meta)))
    return path


def roll_out(
    predictor: Predictor, inputs: RollOutInputs, starts: np.ndarray, length: int
) -> tuple[list[Array], Array]:
    """The joints of roll-outs that begin at frames `starts` (n,), which rise, and their last phases (n,).

    For each age from 1 to `length` there is an array (n', J, 3), in the root frame of frame start + age - 1,
    with heights minus that frame's mean. It holds the first n' roll-outs, those still inside the stretch.
    """
    crowd = RollOutCrowd(predictor, inputs, starts, np.minimum(starts + length, len(inputs.x)))
    return [place for *_, place in crowd.frames()], crowd.phase
