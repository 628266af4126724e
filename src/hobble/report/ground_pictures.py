"""Packs small 3D views of terrain fits for the report page.

A view shows the ground that was fitted to a gait cycle, the paths of the soles, and the body at three
moments.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.figure.pack import packed_turns
from hobble.models.packing import to_base64

STEPS_PER_CM = 10  # lengths are stored as 16-bit integers, in steps of a millimetre
MOST_VIEWS = 24  # the page has at most this many views
# The arrays of a view: fields of `hobble.terrain.fit_picture.FitPicture`. In the file they are called
# picture<number>_<field>.
ARRAYS = ("cycle", "x", "z", "ground", "soles", "contacts", "pose")


def ground_pictures(paths: Iterable[str | Path], skeleton: Mapping[str, Any]) -> dict[str, Any]:
    """Views of the fits in the files `terrain/clips/<clip>.npz`, packed for the page.

    Cycles on flat ground have no views. skeleton: the network's, as a dict; empty if it has none. Keys of the
    result: `joints`, the number of joints that are drawn; `body`, the key of the body's mesh; `pictures`, the
    views.
    """
    pictures: list[dict[str, Any]] = []
    if not skeleton:
        return {"joints": 0, "body": "", "pictures": pictures}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    drawn_joints = body_mesh(figure).bones
    for path in paths:
        if len(pictures) == MOST_VIEWS:
            break
        file = ArrayParts(path)
        count = int(file.read_whole("pictures")) if "pictures" in file else 0
        for i in range(min(count, MOST_VIEWS - len(pictures))):
            view = {array: file.read_whole(f"picture{i}_{array}") for array in ARRAYS}
            if view["pose"].shape[1] == len(figure.joints):
                name = f"{Path(path).stem}, cycle {int(view['cycle']) + 1}"
                turns = fitted_rotations(figure, np.asarray(view["pose"], float))[:, drawn_joints]
                view["pose"] = view["pose"][:, drawn_joints]
                pictures.append({"name": name, **_packed_view(view), "turn": packed_turns(turns)})
    return {"joints": len(drawn_joints), "body": mesh_key(figure), "pictures": pictures}


def _packed_view(view: Mapping[str, Array]) -> dict[str, Any]:
    """Packs the arrays of a view.

    x and z are measured from the first joint at the second of the three moments, so that 16 bits are enough.
    In the result, `x` and `z` are the first and the last coordinate of the ground's grid, cm. `n` is the
    number of its points along each of them.
    """
    middle = view["pose"][1, 0] * np.array([1.0, 0.0, 1.0])
    return {
        "n": len(view["x"]),
        "x": [float(view["x"][0] - middle[0]), float(view["x"][-1] - middle[0])],
        "z": [float(view["z"][0] - middle[2]), float(view["z"][-1] - middle[2])],
        "ground": _packed_steps(view["ground"]),
        "soles": _packed_steps(view["soles"] - middle),
        "contacts": to_base64(np.asarray(view["contacts"], np.uint8)),
        "pose": _packed_steps(view["pose"] - middle),
    }


def _packed_steps(values: Array) -> str:
    """Lengths in cm as 16-bit integers, packed. Lengths beyond their range, about 33 m, are cut."""
    return to_base64(np.clip(np.round(values * STEPS_PER_CM), -32767, 32767).astype(np.int16))
