"""Packs generated motion, which the report page plays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import ChannelDisplay, channel_display, channel_words
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.figure.pack import packed_turns
from hobble.models.packing import to_base64
from hobble.runtime.export import restore_bone_lengths

FPS = 30  # frame rate of the motion in the page
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


def packed_scenes(
    path: str | Path, skeleton: Mapping[str, Any], channels: Mapping[str, Sequence[str]] | None = None
) -> dict[str, Any]:
    """The scripted walks of the page; {} without a skeleton.

    path: `runtime/scenarios.npz`, the motion that the network generated. skeleton: the network's, as a dict;
    empty if it has none. channels: channel (group of inputs of the network) -> labels of its columns.

    The motion is stored at 30 Hz, for the joints that move the drawn body. Their positions are relative to
    the root joint, as 16-bit integers in steps of 0.1 mm. Rotations have 16 bits, too.
    """
    data = load_npz(path)
    if not skeleton:
        return {}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    displays = {
        name: channel_display(name, figure, columns, columns) for name, columns in (channels or {}).items()
    }
    frame_step = max(1, round(float(data["fps"]) / FPS))
    names = [str(name) for name in data["names"]]
    bones = body_mesh(figure).bones.tolist()  # the joints that move the drawn body
    feet = [figure.role(role) if figure.roles.get(role) in figure.joints else -1 for role in FEET]
    return {
        "fps": float(data["fps"]) / frame_step,
        "joints": len(bones),
        "unit": UNIT,
        "feet": [bones.index(j) for j in feet] if all(j in bones for j in feet) else [],
        "body": mesh_key(figure),
        "regions": next((list(display.regions) for display in displays.values() if display.regions), []),
        "scenarios": [
            _packed_walk(data, name, frame_step, channels or {}, displays, figure, bones) for name in names
        ],
    }


def _packed_walk(
    data: Mapping[str, Array],
    name: str,
    frame_step: int,
    channels: Mapping[str, Sequence[str]],
    displays: Mapping[str, ChannelDisplay],
    figure: Skeleton,
    keep: list[int],
) -> dict[str, Any]:
    """One scripted walk, packed for the page.

    data: arrays of the file, called <name>/positions and so on. frame_step: every frame_step-th frame is
    stored. channels: as in `packed_scenes`. displays: channel -> how it is shown. keep: joints to store.
    """
    positions = np.asarray(data[f"{name}/positions"], float)[::frame_step]
    rotations = data.get(f"{name}/rotations")
    rotations = (
        fitted_rotations(figure, positions)
        if rotations is None
        else np.asarray(rotations, float)[::frame_step]
    )
    out: dict[str, Any] = {
        "name": title_of(name),
        "description": DESCRIPTIONS.get(name, ""),
        "frames": len(positions),
        **packed_motion(figure, positions, rotations, keep),
    }
    contacts, phase = data.get(f"{name}/contacts"), data.get(f"{name}/phase")
    if contacts is not None:
        # One byte for each frame: bit 0 is the contact of FEET[0], bit 3 that of FEET[3].
        bits = (np.asarray(contacts)[::frame_step, :4] > CONTACT) @ (1 << np.arange(4))
        out["contacts"] = to_base64(bits.astype(np.uint8))
    if phase is not None:
        # 0 to 255 stands for phase 0 to 1.
        out["phase"] = to_base64(np.round(255 * (np.asarray(phase)[::frame_step] % 1.0)).astype(np.uint8))
    # In some walks the value of one column rises from 0 to the highest.
    swept_channel, column = (str(v) for v in data.get(f"{name}/swept", ("", "")))
    if column in channels.get(swept_channel, ()):
        index, highest = list(channels[swept_channel]).index(column), channel(swept_channel).highest
        display = displays[swept_channel]
        # The column's name for readers.
        word = next(
            (label for label, c in display.sliders.items() if c == column), display.spoken_names[index]
        )
        share = np.asarray(data[f"{name}/swept_values"])[::frame_step] / highest
        out["swept"] = {
            "column": index,
            "spoken": word,
            "highest": highest,
            "placed": bool(display.regions),  # whether the value belongs to a part of the body
            # 0 to 250 stands for 0 to the highest value.
            "values": to_base64(np.clip(np.round(250 * share), 0, 250).astype(np.uint8)),
        }
        out["description"] = channel_words(swept_channel).sweep_description.format(word)
    return out


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
