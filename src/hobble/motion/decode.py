"""From a BVH file's channels to rotations and positions, still in the file's own unit and axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.read import Bvh

STANDARD_RATES = (120, 60, 30, 24, 25, 50, 100, 90, 48, 72, 144, 180, 200, 240, 250, 300, 15, 20, 12, 10)


@dataclass(frozen=True)
class Decoded:
    """F frames of J joints, in the file's unit.

    rotations: (F, J, 4) local. root: (F, 3). translations: (F, J, 3) local joint positions where some joint
    but the root really moves in its parent, else None. notes: sentences on what was dropped or kept.
    """

    rotations: Array = field(repr=False)
    root: Array = field(repr=False)
    translations: Array | None = field(repr=False)
    notes: list[str]


def frame_rate(frame_time: float, text: str) -> float:
    """Frames a second of a Frame Time; a standard rate where its digits, rounded as written, say so.

    >>> frame_rate(0.008333, "0.008333"), frame_rate(0.0333, "0.0333")
    (120.0, 30.0)
    >>> round(frame_rate(0.0417083, "0.0417083"), 3)
    23.976
    """
    mantissa = text.lower().split("e")[0]
    if "e" not in text.lower() and "." in mantissa:
        step = 10.0 ** -len(mantissa.split(".")[1])
        for rate in STANDARD_RATES:
            # Some writers cut the digits off instead of rounding.
            if abs(1 / rate - frame_time) < step * 1.01 and abs(rate * frame_time - 1) < 0.03:
                return float(rate)
    nearest = round(1 / frame_time)
    return float(nearest) if abs(nearest * frame_time - 1) < 1e-5 else 1 / frame_time


def decode(bvh: Bvh, still: float) -> Decoded:
    """Rotations and positions of a BVH file.

    A position channel replaces that component of the joint's OFFSET, as every current program writes it;
    where all joints below the root carry zeros against offsets that are not, the channels are added to them
    instead. `still`: a joint whose position stays this close to its offset (file units) only repeats it.
    """
    frames, joints = len(bvh), len(bvh.names)
    rotations = np.broadcast_to(quat.IDENTITY, (frames, joints, 4)).copy()
    starts = np.cumsum([0, *(len(c) for c in bvh.channels)])
    groups: dict[tuple[str, ...], list[int]] = {}
    for j, channels in enumerate(bvh.channels):
        groups.setdefault(channels, []).append(j)
    for channels, members in groups.items():
        turns = [i for i, name in enumerate(channels) if name.endswith("rotation")]
        if turns:
            columns = starts[members][:, None] + np.array(turns)
            order = "".join(channels[i][0] for i in turns)
            rotations[:, members] = quat.from_euler(np.radians(bvh.values[:, columns]), order)
    root, translations, notes = _positions(bvh, starts, still)
    return Decoded(quat.continuous(rotations), root, translations, notes)


def _positions(bvh: Bvh, starts: Array, still: float) -> tuple[Array, Array | None, list[str]]:
    local = np.broadcast_to(bvh.offsets, (len(bvh), *bvh.offsets.shape)).copy()
    moved = []
    for j, channels in enumerate(bvh.channels):
        for i, name in enumerate(channels):
            if name.endswith("position"):
                local[:, j, "XYZ".index(name[0])] = bvh.values[:, starts[j] + i]
                moved.append(j)
    below = sorted({j for j in moved if j})
    notes: list[str] = []
    if below:
        zeros = np.abs(local[:, below]).max() <= still
        if zeros and np.abs(bvh.offsets[below]).max() > still:
            local[:, below] = bvh.offsets[below]
            notes.append(f"The position channels of {len(below)} joints are zero and were dropped.")
            below = []
    far = np.abs(local - bvh.offsets).max(axis=(0, 2)) if len(bvh) else np.zeros(len(bvh.names))
    real = [j for j in below if far[j] > still]
    if below and not real:
        notes.append(
            f"The position channels of {len(below)} joints below the root only repeat their offsets and were "
            "dropped."
        )
    if real:
        names = ", ".join(bvh.names[j] for j in real[:6]) + (", ..." if len(real) > 6 else "")
        notes.append(
            f"{len(real)} of {len(below)} joints with position channels move in their parents and keep "
            f"that motion ({names})."
        )
    return local[:, 0].copy(), (local if real else None), notes
