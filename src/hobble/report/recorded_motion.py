"""Packs motion that a page plays: captured beside predicted clips, and fitted grounds."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, map_npz, to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, load_clip_rows, unbroken_stretches
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.generated import restore_bone_lengths

FPS = 20  # frame rate of the motion in the page
UNIT = 0.01  # joint positions are stored as 16-bit integers in steps of this many cm
TURN = 32767  # the integer that stands for 1 in packed rotations


def packed_motion(positions: Array, rotations: Array, keep: Sequence[int]) -> dict[str, str]:
    """Packs world positions (F, J, 3), cm, and rotations (F, J, 4) of the joints `keep`, as base64.

    In the result, `root`: (F, 3) positions of joint 0, float32, cm. `pose`: positions relative to joint 0,
    int16, in steps of UNIT. `turn`: rotations, int16, where TURN stands for 1.
    """
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    turns = np.round(np.clip(rotations[:, keep], -1, 1) * TURN)
    return {
        "root": to_base64(root),
        "pose": to_base64(np.clip(steps, -32767, 32767).astype(np.int16)),
        "turn": to_base64(turns.astype(np.int16)),
    }


FEWEST_CLIPS = 6  # if fewer clips are held out, training clips are added up to this number
MOST_HELD_OUT = 6  # at most this many held-out clips are shown; each takes up to 150 kB of the page
LONGEST = 12 * 60  # at most this many frames of a clip are shown: 12 seconds


def packed_comparisons(
    network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]
) -> dict[str, Any]:
    """The longest stretch of consecutive frames of each shown clip, captured and predicted.

    paths: `database/clips/<clip>.npz`. splits: clip -> "held_out" or "train". At most MOST_HELD_OUT held-out
    clips are shown. If fewer than FEWEST_CLIPS are held out, training clips are added. Each pose is predicted
    from the captured input of the frame before. The ground is the first terrain fit of the frame: fits are
    ground heights that suit the motion. Both motions are drawn at the captured root.

    Keys of the result: `fps`; `joints`, the number of joints that are drawn; `body`, the key of the body's
    mesh; `clips`, one `_compared_clip` each. It is {} if there is no clip to show or the network has no
    skeleton.
    """
    if network.skeleton is None:
        return {}
    drawn_joints = body_mesh(network.skeleton).bones.tolist()
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    # Take clips from all over the list: neighbours in it are often takes of the same motion.
    for path in order[: max(FEWEST_CLIPS, held_out)][:: max(1, -(-held_out // MOST_HELD_OUT))]:
        rows = load_clip_rows(path, longest_stretch(path))
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared_clip(network, rows, splits.get(rows.clip, "train"), drawn_joints))
    if not clips:
        return {}
    return {"fps": FPS, "joints": len(drawn_joints), "body": mesh_key(network.skeleton), "clips": clips}


def longest_stretch(path: str | Path) -> tuple[int, int]:
    """First row of a clip's longest stretch of consecutive frames, and the row after its last.

    The stretch is cut to LONGEST frames. Both numbers are 0 if the clip has no rows.
    """
    stretches = unbroken_stretches(load_npz(path, ["frame"])["frame"])
    if not stretches:
        return 0, 0
    longest = max(stretches, key=len)[:LONGEST]
    return int(longest[0]), int(longest[-1]) + 1


def _compared_clip(network: Network, rows: ClipRows, split: str, drawn_joints: list[int]) -> dict[str, Any]:
    """The data of one clip for the page.

    rows: consecutive frames of the clip. Keys of the result: `name` of the clip; `split`; `frames`, their
    number; `captured` and `predicted`, from `packed_motion`; `error`, for each frame the mean distance from
    predicted to captured joints, cm.
    """
    found = ProceduralAnimation(network).compare(rows).all
    frame_step = round(60 / FPS)  # rows have 60 frames a second, the page has FPS
    error = found.distance.mean(axis=1)[::frame_step]
    assert network.skeleton is not None
    captured, predicted = (
        restore_bone_lengths(
            network.skeleton, pose.positions[::frame_step], pose.rotations[::frame_step].astype(float)
        )
        for pose in (found.truth, found.predicted)
    )
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(error),
        "captured": packed_motion(captured[1], captured[0], drawn_joints),
        "predicted": packed_motion(predicted[1], predicted[0], drawn_joints),
        "error": np.round(error, 2).tolist(),
    }


STEPS_PER_CM = 10  # lengths are stored as 16-bit integers, in steps of a millimetre
MOST_VIEWS = 8  # the page has at most this many views
# The arrays of a view: fields of `hobble.terrain.clip_fits.FitPicture`. In the file they are called
# picture<number>_<field>.
ARRAYS = ("cycle", "x", "z", "ground", "soles", "contacts", "pose", "turns")


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
    drawn_joints = body_mesh(figure).bones.tolist()
    for path in paths:
        if len(pictures) == MOST_VIEWS:
            break
        file = map_npz(path)
        count = int(file["pictures"]) if "pictures" in file else 0
        for i in range(min(count, MOST_VIEWS - len(pictures))):
            view = {array: np.array(file[f"picture{i}_{array}"]) for array in ARRAYS}
            if view["pose"].shape[1] == len(figure.joints):
                name = f"{Path(path).stem}, cycle {int(view['cycle']) + 1}"
                pictures.append({"name": name, **_packed_view(view, drawn_joints)})
    return {"joints": len(drawn_joints), "body": mesh_key(figure), "pictures": pictures}


def _packed_view(view: Mapping[str, Array], keep: Sequence[int]) -> dict[str, Any]:
    """Packs the arrays of a view.

    x and z are measured from the first joint at the second of the three moments, so that 16 bits are enough.
    In the result, `x` and `z` are the first and the last coordinate of the ground's grid, cm. `n` is the
    number of its points along each of them. The figure at the three moments is a `packed_motion`.
    """
    middle = view["pose"][1, 0] * np.array([1.0, 0.0, 1.0])
    return {
        "n": len(view["x"]),
        "x": [float(view["x"][0] - middle[0]), float(view["x"][-1] - middle[0])],
        "z": [float(view["z"][0] - middle[2]), float(view["z"][-1] - middle[2])],
        "ground": _packed_steps(view["ground"]),
        "soles": _packed_steps(view["soles"] - middle),
        "contacts": to_base64(np.asarray(view["contacts"], np.uint8)),
        **packed_motion(view["pose"] - middle, view["turns"], keep),
    }


def _packed_steps(values: Array) -> str:
    """Lengths in cm as 16-bit integers, packed. Lengths beyond their range, about 33 m, are cut."""
    return to_base64(np.clip(np.round(values * STEPS_PER_CM), -32767, 32767).astype(np.int16))
