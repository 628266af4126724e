"""Small 3D views of terrain fits: the ground of a gait cycle, the soles, and the body at three moments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.mesh import body, mesh_key
from hobble.figure.pack import packed_turns
from hobble.models.packing import packed

STEPS_PER_CM = 10  # lengths are stored as 16-bit integers, in millimetres
MOST_VIEWS = 24  # the page has at most this many views
# The arrays of a view. In the file they are called picture<number>_<name>.
ARRAYS = ("cycle", "x", "z", "ground", "soles", "contacts", "pose")


def ground_pictures(paths: Iterable[str | Path], skeleton: Mapping[str, Any]) -> dict[str, Any]:
    """Views of the fits in `terrain/clips/<clip>.npz`, packed for the page.

    Clips on flat ground have no views. skeleton: the network's, as a dict; empty if it has none.
    """
    pictures: list[dict[str, Any]] = []
    if not skeleton:
        return {"joints": 0, "body": "", "pictures": pictures}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    keep = body(figure).bones
    for path in paths:
        if len(pictures) == MOST_VIEWS:
            break
        file = ArrayParts(path)
        count = int(file.whole("pictures")) if "pictures" in file else 0
        for k in range(min(count, MOST_VIEWS - len(pictures))):
            view = {array: file.whole(f"picture{k}_{array}") for array in ARRAYS}
            if view["pose"].shape[1] == len(figure.joints):
                name = f"{Path(path).stem}, cycle {int(view['cycle']) + 1}"
                turns = fitted_rotations(figure, np.asarray(view["pose"], float))[:, keep]
                view["pose"] = view["pose"][:, keep]
                pictures.append({"name": name, **_packed(view), "turn": packed_turns(turns)})
    return {"joints": len(keep), "body": mesh_key(figure), "pictures": pictures}


def _packed(view: Mapping[str, Array]) -> dict[str, Any]:
    """Packs a view. x and z become relative to the body at the second moment, so that 16 bits are enough."""
    middle = view["pose"][1, 0] * np.array([1.0, 0.0, 1.0])  # any bone will do
    return {
        "n": len(view["x"]),
        "x": [float(view["x"][0] - middle[0]), float(view["x"][-1] - middle[0])],
        "z": [float(view["z"][0] - middle[2]), float(view["z"][-1] - middle[2])],
        "ground": _steps(view["ground"]),
        "soles": _steps(view["soles"] - middle),
        "contacts": packed(np.asarray(view["contacts"], np.uint8)),
        "pose": _steps(view["pose"] - middle),
    }


def _steps(values: Array) -> str:
    return packed(np.clip(np.round(values * STEPS_PER_CM), -32767, 32767).astype(np.int16))
