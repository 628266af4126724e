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
from hobble.figure.mesh import body, key
from hobble.figure.pack import packed_turns
from hobble.models.packing import packed
from hobble.runtime.export import jointed

FPS = 30
UNIT = 0.01  # cm, one step of the 16-bit joint positions
FEET = ("left_heel", "left_toe", "right_heel", "right_toe")
CONTACT = 0.5  # a predicted contact above this counts as contact

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

    skeleton: as in the network's file. channels: channel -> its columns. Positions of bones are stored at 30
    Hz, relative to the root joint, as 16-bit integers in steps of 0.1 mm. Rotations have 16 bits, too.
    """
    data = load_npz(path)
    if not skeleton:
        return {}
    figure = Skeleton.from_dict({"name": "", **skeleton})
    faces = {name: shown(name, figure, columns, columns) for name, columns in (channels or {}).items()}
    stride = max(1, round(float(data["fps"]) / FPS))
    names = [str(name) for name in data["names"]]
    keep = body(figure).bones.tolist()
    at = [figure.role(r) if figure.roles.get(r) in figure.joints else -1 for r in FEET]
    return {
        "fps": float(data["fps"]) / stride,
        "joints": len(keep),
        "unit": UNIT,
        "feet": [keep.index(j) for j in at] if all(j in keep for j in at) else [],
        "body": key(figure),
        "regions": next((list(face.regions) for face in faces.values() if face.regions), []),
        "scenarios": [_scenario(data, name, stride, channels or {}, faces, figure, keep) for name in names],
    }


def _scenario(
    data: Mapping[str, Array],
    name: str,
    stride: int,
    channels: Mapping[str, Sequence[str]],
    faces: Mapping[str, ChannelDisplay],
    figure: Skeleton,
    keep: list[int],
) -> dict[str, Any]:
    positions = np.asarray(data[f"{name}/positions"], float)[::stride]
    rotations = data.get(f"{name}/rotations")
    rotations = (
        fitted_rotations(figure, positions) if rotations is None else np.asarray(rotations, float)[::stride]
    )
    out: dict[str, Any] = {
        "name": readable(name),
        "description": WORDS.get(name, ""),
        "frames": len(positions),
        **packed_motion(figure, positions, rotations, keep),
    }
    contacts, phase = data.get(f"{name}/contacts"), data.get(f"{name}/phase")
    if contacts is not None:
        bits = (np.asarray(contacts)[::stride, :4] > CONTACT) @ (1 << np.arange(4))
        out["contacts"] = packed(bits.astype(np.uint8))
    if phase is not None:
        out["phase"] = packed(np.round(255 * (np.asarray(phase)[::stride] % 1.0)).astype(np.uint8))
    one, column = (str(v) for v in data.get(f"{name}/swept", ("", "")))
    if column in channels.get(one, ()):
        at, highest = list(channels[one]).index(column), channel(one).highest
        word = next((s for s, c in faces[one].sliders.items() if c == column), faces[one].spoken[at])
        share = np.asarray(data[f"{name}/swept_values"])[::stride] / highest
        out["swept"] = {
            "column": at,
            "spoken": word,
            "highest": highest,
            "placed": bool(faces[one].regions),
            "values": packed(np.clip(np.round(250 * share), 0, 250).astype(np.uint8)),
        }
        out["description"] = words(one).grows.format(word)
    return out


def packed_motion(
    figure: Skeleton, positions: Array, rotations: Array, keep: Sequence[int]
) -> dict[str, str]:
    """Packs positions (F, J, 3) and rotations (F, J, 4) as a motion with constant bone lengths (`jointed`).

    In the result, `root` and `pose` are from `pack_positions`. `turn`: rotations of the joints in `keep`,
    from `packed_turns`.
    """
    world, places = jointed(figure, positions, rotations)
    return {**pack_positions(places, keep), "turn": packed_turns(world[:, keep])}


def pack_positions(positions: Array, keep: Sequence[int] | slice = slice(None)) -> dict[str, str]:
    """Packs positions (F, J, 3), cm. `root`: of joint 0, float32, cm. `pose`: of the joints in `keep`, int16,
    relative to joint 0, in steps of UNIT."""
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    return {"root": packed(root), "pose": packed(np.clip(steps, -32767, 32767).astype(np.int16))}


def readable(name: str) -> str:
    """A file's name as a title.

    >>> readable("stop_and_go")
    'Stop and go'
    """
    return name.replace("_", " ").capitalize()
