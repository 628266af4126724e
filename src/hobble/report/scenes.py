"""Generated motion, packed for the page to play."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import ChannelDisplay, shown, words
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.fit_rotations import fitted_rotations
from hobble.figure.mesh import body, mesh_key
from hobble.figure.pack import packed_turns
from hobble.models.packing import packed
from hobble.runtime.export import jointed

FPS = 30  # of the motion in the page
UNIT = 0.01  # cm, one step of the 16-bit joint positions
# Roles of the joints with a contact, in the order of the contacts.
FEET = ("left_heel", "left_toe", "right_heel", "right_toe")
CONTACT = 0.5  # a predicted contact above this counts as contact

# Scenario -> its description on the page.
WORDS = {
    "walk": "Walks straight on, then in a curve",
    "jog": "Jogs straight on, then in a curve",
    "crouch": "Crouches straight on",
    "strafe": "Walks sideways, facing ahead",
    "backward": "Walks backward",
    "stop_and_go": "Stops and goes",
    "turn_in_place": "Turns on the spot in quarter turns",
}


def scenes(
    path: str | Path, skeleton: Mapping[str, Any], channels: Mapping[str, Sequence[str]] | None = None
) -> dict[str, Any]:
    """The scripted walks of the page, from `runtime/scenarios.npz`.

    skeleton: the network's, as a dict; empty if it has none. channels: channel -> its columns. Positions of
    bones are stored at 30 Hz, relative to the root joint, as 16-bit integers in steps of 0.1 mm. Rotations
    have 16 bits, too.
    """
    data = load_npz(path)
    if not skeleton:
        return {}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    displays = {name: shown(name, figure, columns, columns) for name, columns in (channels or {}).items()}
    frame_step = max(1, round(float(data["fps"]) / FPS))
    names = [str(name) for name in data["names"]]
    keep = body(figure).bones.tolist()
    joints = [figure.role(r) if figure.roles.get(r) in figure.joints else -1 for r in FEET]
    return {
        "fps": float(data["fps"]) / frame_step,
        "joints": len(keep),
        "unit": UNIT,
        "feet": [keep.index(j) for j in joints] if all(j in keep for j in joints) else [],
        "body": mesh_key(figure),
        "regions": next((list(display.regions) for display in displays.values() if display.regions), []),
        "scenarios": [
            _scenario(data, name, frame_step, channels or {}, displays, figure, keep) for name in names
        ],
    }


def _scenario(
    data: Mapping[str, Array],
    name: str,
    frame_step: int,
    channels: Mapping[str, Sequence[str]],
    displays: Mapping[str, ChannelDisplay],
    figure: Skeleton,
    keep: list[int],
) -> dict[str, Any]:
    """One walk of the file.

    frame_step: frames of the file for each frame of the page. displays: channel -> how it is shown. keep:
    joints to store.
    """
    positions = np.asarray(data[f"{name}/positions"], float)[::frame_step]
    rotations = data.get(f"{name}/rotations")
    rotations = (
        fitted_rotations(figure, positions)
        if rotations is None
        else np.asarray(rotations, float)[::frame_step]
    )
    out: dict[str, Any] = {
        "name": readable(name),
        "description": WORDS.get(name, ""),
        "frames": len(positions),
        **packed_motion(figure, positions, rotations, keep),
    }
    contacts, phase = data.get(f"{name}/contacts"), data.get(f"{name}/phase")
    if contacts is not None:
        bits = (np.asarray(contacts)[::frame_step, :4] > CONTACT) @ (1 << np.arange(4))
        out["contacts"] = packed(bits.astype(np.uint8))
    if phase is not None:
        out["phase"] = packed(np.round(255 * (np.asarray(phase)[::frame_step] % 1.0)).astype(np.uint8))
    # The column whose value rises during the walk, if any.
    swept_channel, column = (str(v) for v in data.get(f"{name}/swept", ("", "")))
    if column in channels.get(swept_channel, ()):
        index, highest = list(channels[swept_channel]).index(column), channel(swept_channel).highest
        display = displays[swept_channel]
        word = next((label for label, c in display.sliders.items() if c == column), display.spoken[index])
        share = np.asarray(data[f"{name}/swept_values"])[::frame_step] / highest
        out["swept"] = {
            "column": index,
            "spoken": word,
            "highest": highest,
            "placed": bool(display.regions),
            "values": packed(np.clip(np.round(250 * share), 0, 250).astype(np.uint8)),
        }
        out["description"] = words(swept_channel).grows.format(word)
    return out


def packed_motion(
    figure: Skeleton, positions: Array, rotations: Array, keep: Sequence[int]
) -> dict[str, str]:
    """Packs positions (F, J, 3) and rotations (F, J, 4) as a motion with constant bone lengths.

    In the result, `root` and `pose` are from `pack_positions`. `turn` has the rotations of the joints in
    `keep`, from `hobble.figure.pack.packed_turns`.
    """
    world, places = jointed(figure, positions, rotations)
    return {**pack_positions(places, keep), "turn": packed_turns(world[:, keep])}


def pack_positions(positions: Array, keep: Sequence[int] | slice = slice(None)) -> dict[str, str]:
    """Packs positions (F, J, 3), cm.

    In the result, `root`: positions of joint 0, float32, cm. `pose`: positions of the joints in `keep`
    relative to joint 0, int16, in steps of UNIT.
    """
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    return {"root": packed(root), "pose": packed(np.clip(steps, -32767, 32767).astype(np.int16))}


def readable(name: str) -> str:
    """The name of a scenario as a title.

    >>> readable("stop_and_go")
    'Stop and go'
    """
    return name.replace("_", " ").capitalize()
