"""Small 3D views of terrain fits: the ground of a cycle, the soles on it, and the figure at three moments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.mesh import body, key
from hobble.figure.pack import packed_turns
from hobble.models.packing import packed

STEPS_PER_CM = 10  # lengths are stored as 16-bit integers, in millimetres
MOST = 24  # most views in the page
PARTS = ("cycle", "x", "z", "ground", "soles", "contacts", "pose")


def ground_pictures(paths: Iterable[str | Path], skeleton: Mapping[str, Any]) -> dict[str, Any]:
    """Views of the fits in `terrain/clips/<clip>.npz`, packed for the page; flat clips have none.

    skeleton: as in the network's file.
    """
    pictures: list[dict[str, Any]] = []
    if not skeleton:
        return {"joints": 0, "body": "", "pictures": pictures}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    keep = body(figure).bones
    for path in paths:
        if len(pictures) == MOST:
            break
        file = ArrayParts(path)
        count = int(file.whole("pictures")) if "pictures" in file else 0
        for k in range(min(count, MOST - len(pictures))):
            part = {key: file.whole(f"picture{k}_{key}") for key in PARTS}
            if part["pose"].shape[1] == len(figure.joints):
                name = f"{Path(path).stem}, cycle {int(part['cycle']) + 1}"
                turns = fitted_rotations(figure, np.asarray(part["pose"], float))[:, keep]
                part["pose"] = part["pose"][:, keep]
                pictures.append({"name": name, **_packed(part), "turn": packed_turns(turns)})
    return {"joints": len(keep), "body": key(figure), "pictures": pictures}


def _packed(part: Mapping[str, Array]) -> dict[str, Any]:
    """Packs a view. Positions become relative to the middle figure, so that 16 bits are enough."""
    middle = part["pose"][1, 0] * np.array([1.0, 0.0, 1.0])  # any bone will do
    return {
        "n": len(part["x"]),
        "x": [float(part["x"][0] - middle[0]), float(part["x"][-1] - middle[0])],
        "z": [float(part["z"][0] - middle[2]), float(part["z"][-1] - middle[2])],
        "ground": _steps(part["ground"]),
        "soles": _steps(part["soles"] - middle),
        "contacts": packed(np.asarray(part["contacts"], np.uint8)),
        "pose": _steps(part["pose"] - middle),
    }


def _steps(values: Array) -> str:
    return packed(np.clip(np.round(values * STEPS_PER_CM), -32767, 32767).astype(np.int16))
