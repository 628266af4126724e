"""Packs motion that a page plays: scripted walks, captured beside predicted clips, and fitted grounds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, map_npz, to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.figure.pack import packed_turns
from hobble.figure.rig import fitted_rotations
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, load_clip_rows, unbroken_stretches
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import restore_bone_lengths

FPS = 20  # frame rate of the motion in the page
UNIT = 0.01  # joint positions are stored as 16-bit integers in steps of this many cm
# Roles of the joints that can touch the ground, in the order of the predicted contacts.
FEET = ("left_heel", "left_toe", "right_heel", "right_toe")
CONTACT = 0.5  # a joint touches the ground if its predicted contact (0 to 1) is above this

# Scripted walk -> its description on the page.
DESCRIPTIONS = {
    "walk": "Walks straight on, then in a curve",
    "jog": "Jogs straight on, then in a curve",
    "crouch": "Crouches straight on",
    "strafe": "Walks sideways, facing ahead",
    "backward": "Walks backward",
    "stop_and_go": "Stops and goes",
    "turn_in_place": "Turns on the spot in quarter turns",
}


def packed_scenes(path: str | Path, skeleton: Mapping[str, Any]) -> dict[str, Any]:
    """The scripted walks of the page; {} without a skeleton.

    path: `runtime/scenarios.npz`, from `hobble.runtime.scenarios.generate_scenarios`. Walks in which a value
    of a channel rises are left out: readers set it in Play. skeleton: the network's, as a dict; empty if it
    has none.

    The motion is stored at FPS, for the joints that move the drawn body. Their positions are relative to the
    root joint, as 16-bit integers in steps of 0.1 mm. Rotations have 16 bits, too.
    """
    data = load_npz(path)
    if not skeleton:
        return {}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    bones = body_mesh(figure).bones.tolist()  # the joints that move the drawn body
    feet = [figure.role(role) if figure.roles.get(role) in figure.joints else -1 for role in FEET]
    frame_step = max(1, round(float(data["fps"]) / FPS))
    walks = []
    for name in map(str, data["names"]):
        # Arrays of the walk, of every frame_step-th frame.
        motion = {key.removeprefix(f"{name}/"): v for key, v in data.items() if key.startswith(f"{name}/")}
        if any(map(str, motion.pop("swept"))):
            continue
        walk = {"name": title_of(name), "description": DESCRIPTIONS.get(name, "")}
        motion = {key: values[::frame_step] for key, values in motion.items()}
        walks.append({**walk, **_packed_walk(motion, figure, bones)})
    return {
        "fps": float(data["fps"]) / frame_step,
        "joints": len(bones),
        "unit": UNIT,
        "feet": [bones.index(j) for j in feet] if all(j in bones for j in feet) else [],
        "body": mesh_key(figure),
        "scenarios": walks,
    }


def _packed_walk(motion: Mapping[str, Array], figure: Skeleton, keep: list[int]) -> dict[str, Any]:
    """One scripted walk, packed for the page. motion: its arrays. keep: joints to store."""
    # One byte for each frame: bit 0 is the contact of FEET[0], bit 3 that of FEET[3].
    contacts = (motion["contacts"][:, :4] > CONTACT) @ (1 << np.arange(4))
    return {
        "frames": len(motion["positions"]),
        **packed_motion(figure, motion["positions"].astype(float), motion["rotations"].astype(float), keep),
        "contacts": to_base64(contacts.astype(np.uint8)),
        # 0 to 255 stands for phase 0 to 1.
        "phase": to_base64(np.round(255 * (motion["phase"] % 1.0)).astype(np.uint8)),
    }


def packed_motion(
    figure: Skeleton, positions: Array, rotations: Array, keep: Sequence[int]
) -> dict[str, str]:
    """Packs positions (F, J, 3) and rotations (F, J, 4) as a motion with constant bone lengths.

    keep: the joints to store. In the result, `root` and `pose` are from `pack_positions`. `turn` has the
    joints' rotations, from `hobble.figure.pack.packed_turns`.
    """
    world_rotations, world_positions = restore_bone_lengths(figure, positions, rotations)
    return {**pack_positions(world_positions, keep), "turn": packed_turns(world_rotations[:, keep])}


def pack_positions(positions: Array, keep: Sequence[int] | slice = slice(None)) -> dict[str, str]:
    """Packs joint positions (F, J, 3), cm, as base64.

    keep: the joints to store. In the result, `root`: (F, 3) positions of joint 0, float32, cm. `pose`:
    positions of the joints `keep` relative to joint 0, int16, in steps of UNIT.
    """
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    return {"root": to_base64(root), "pose": to_base64(np.clip(steps, -32767, 32767).astype(np.int16))}


def title_of(name: str) -> str:
    """The title of a scripted walk. name: as in the file.

    >>> title_of("stop_and_go")
    'Stop and go'
    """
    return name.replace("_", " ").capitalize()


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

    Keys of the result: `fps`; `unit`, cm for a step of the packed positions; `joints`, the number of joints
    that are drawn; `body`, the key of the body's mesh; `clips`, one `_compared_clip` each. It is {} if there
    is no clip to show or the network has no skeleton.
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
    mesh = mesh_key(network.skeleton)
    return {"fps": FPS, "unit": UNIT, "joints": len(drawn_joints), "body": mesh, "clips": clips}


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
        packed_motion(
            network.skeleton, pose.positions[::frame_step], pose.rotations[::frame_step], drawn_joints
        )
        for pose in (found.truth, found.predicted)
    )
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(error),
        "captured": captured,
        "predicted": predicted,
        "error": np.round(error, 2).tolist(),
    }


STEPS_PER_CM = 10  # lengths are stored as 16-bit integers, in steps of a millimetre
MOST_VIEWS = 8  # the page has at most this many views
# The arrays of a view: fields of `hobble.terrain.clip_fits.FitPicture`. In the file they are called
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
        file = map_npz(path)
        count = int(file["pictures"]) if "pictures" in file else 0
        for i in range(min(count, MOST_VIEWS - len(pictures))):
            view = {array: np.array(file[f"picture{i}_{array}"]) for array in ARRAYS}
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
