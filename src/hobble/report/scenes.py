"""Generated motion, packed small enough to lie in the page and play."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.models.packing import packed
from hobble.report.body import body

FPS = 30
UNIT = 0.01  # centimetres of one step of the 16-bit joint positions
FEET = ("left_heel", "left_toe", "right_heel", "right_toe")
CONTACT = 0.5  # a predicted contact above this is drawn as one

WORDS = {
    "walk": "Walks straight on, then in a curve",
    "jog": "Jogs straight on, then in a curve",
    "crouch": "Crouches straight on",
    "strafe": "Walks sideways, facing one way",
    "backward": "Walks backward",
    "stop_and_go": "Stops and goes",
    "turn_in_place": "Turns on the spot by quarters",
}


def scenes(path: str | Path, skeleton: Mapping[str, Any], links: Sequence[str] = ()) -> dict[str, Any]:
    """What the page's figure plays, from `runtime/scenarios.npz`.

    skeleton: roles of the joints, as the network's file carries them. links: names of all links, for colours.
    Joint positions are kept at 30 Hz, relative to the root joint, in 16-bit steps of 0.1 mm.
    """
    data = load_npz(path)
    joints = [str(name) for name in data["joints"]]
    parents = [int(p) for p in data["parents"]]
    roles = dict(skeleton.get("roles") or {})
    stride = max(1, round(float(data["fps"]) / FPS))
    names = [str(name) for name in data["names"]]
    feet = [joints.index(roles[r]) for r in FEET] if all(r in roles for r in FEET) else []
    dressed = body(joints, parents, roles, links, feet)
    keep = dressed["keep"]
    return {
        "fps": float(data["fps"]) / stride,
        "joints": len(keep),
        "unit": UNIT,
        "links": list(links),
        "feet": [keep.index(j) for j in feet],
        "body": dressed,
        "scenarios": [_scenario(data, name, stride, links, keep) for name in names],
    }


def _scenario(
    data: Mapping[str, Array], name: str, stride: int, links: Sequence[str], keep: list[int]
) -> dict[str, Any]:
    positions = np.asarray(data[f"{name}/positions"], float)[::stride]
    out: dict[str, Any] = {
        "name": readable(name),
        "description": WORDS.get(name, ""),
        "frames": len(positions),
        **pack_positions(positions, keep),
    }
    contacts, phase = data.get(f"{name}/contacts"), data.get(f"{name}/phase")
    if contacts is not None:
        bits = (np.asarray(contacts)[::stride, :4] > CONTACT) @ (1 << np.arange(4))
        out["contacts"] = packed(bits.astype(np.uint8))
    if phase is not None:
        out["phase"] = packed(np.round(255 * (np.asarray(phase)[::stride] % 1.0)).astype(np.uint8))
    hurt = str(data.get(f"{name}/hurt", ""))
    if hurt in links:
        severity = np.asarray(data[f"{name}/severity"])[::stride]
        table = np.zeros((len(positions), len(links)), np.uint8)
        table[:, list(links).index(hurt)] = np.clip(np.round(25 * severity), 0, 250)
        out["severity"] = packed(table)
        out["description"] = f"Walks while {hurt} hurts more and more"
    return out


def pack_positions(positions: Array, keep: Sequence[int] | slice = slice(None)) -> dict[str, str]:
    """Positions (F, J, 3): `root` as float32 cm, `pose` as int16 steps of UNIT from it, joints to keep."""
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    return {"root": packed(root), "pose": packed(np.clip(steps, -32767, 32767).astype(np.int16))}


def readable(name: str) -> str:
    """A file's name as a title.

    >>> readable("stop_and_go")
    'Stop and go'
    """
    return name.replace("_", " ").capitalize()
