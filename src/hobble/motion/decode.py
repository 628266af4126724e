"""Converts a BVH file's channels to rotations and positions, in the file's own unit and axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.read import Bvh

# Frames a second. Of two rates that fit a file equally well, the one that is listed first is taken.
STANDARD_RATES = (120, 60, 30, 24, 25, 50, 100, 90, 48, 72, 144, 180, 200, 240, 250, 300, 15, 20, 12, 10)

# A file whose angles are all below 2 pi is in radians if one of them changes by more than this. If they were
# degrees, they would be too small for a body that moves.
RADIANS = 0.5
BLOCK = 4096  # frames that are converted at a time, to keep intermediate arrays small


@dataclass(frozen=True)
class Decoded:
    """F frames of J joints, in the file's unit.

    rotations: (F, J, 4) local. root: (F, 3) positions of the root. offsets: (J, 3) from the parents.
    translations: (F, J, 3) positions relative to the parents, or None if no joint but the root moves
    relative to its parent. repairs: sentences on how the position channels of joints other than the root were
    read. notes: sentences on oddities that need no repair.
    """

    rotations: Array = field(repr=False)
    root: Array = field(repr=False)
    offsets: Array = field(repr=False)
    translations: Array | None = field(repr=False)
    repairs: list[str]
    notes: list[str]


def frame_rate(frame_time: float, text: str) -> float:
    """Frames a second for a file's frame time.

    If the frame time can be the rounded frame time of a standard rate, that rate is returned.

    frame_time: seconds. text: the same number as the file writes it, which shows to how many digits it was
    rounded.

    >>> frame_rate(0.008333, "0.008333"), frame_rate(0.0333, "0.0333"), frame_rate(0.016, "0.016")
    (120.0, 30.0, 60.0)
    >>> round(frame_rate(0.0417083, "0.0417083"), 3)
    23.976
    """
    mantissa = text.lower().split("e")[0]
    if "e" not in text.lower() and "." in mantissa:
        step = 10.0 ** -len(mantissa.split(".")[1])
        # Some programs cut digits off instead of rounding: .016 for 1/60.
        fit = [rate for rate in STANDARD_RATES if abs(1 / rate - frame_time) < step * 1.01]
        fit = [rate for rate in fit if abs(rate * frame_time - 1) < 0.045]
        if fit:
            return float(min(fit, key=lambda rate: abs(rate * frame_time - 1)))
    nearest = round(1 / frame_time)
    return float(nearest) if abs(nearest * frame_time - 1) < 1e-5 else 1 / frame_time


def check_angles(bvh: Bvh) -> None:
    """Raise InputError if the angles seem to be in radians, or if there are none."""
    turns = [name.endswith("rotation") for channels in bvh.channels for name in channels]
    if not any(turns):
        fix = "Export the clip with rotations, as nearly all programs do."
        raise InputError(bvh.path, "no joint has rotations, only positions", fix=fix)
    angles = bvh.values[:, turns]
    most = float(np.abs(angles).max())
    if most <= 2 * np.pi and np.ptp(angles, axis=0).max() > RADIANS:
        raise InputError(
            bvh.path,
            f"no angle is larger than {most:.2f}, so they seem to be in radians",
            fix="Export the clip again with angles in degrees.",
        )


def decode(bvh: Bvh, still: float) -> Decoded:
    """Rotations and positions of a BVH file.

    A position channel replaces its component of the joint's OFFSET, as all current programs intend. If the
    position channels of a joint below the root are about zero although its OFFSET is not, their values are
    added to the OFFSET instead. still: a joint whose position stays this close to its offset (in the file's
    unit) does not move relative to its parent.
    """
    frames, joints = len(bvh), len(bvh.names)
    rotations = np.broadcast_to(quat.IDENTITY, (frames, joints, 4)).copy()
    starts = np.cumsum([0, *(len(c) for c in bvh.channels)])
    groups: dict[tuple[str, ...], list[int]] = {}
    for j, channels in enumerate(bvh.channels):
        groups.setdefault(channels, []).append(j)
    for channels, members in groups.items():
        turns = [i for i, name in enumerate(channels) if name.endswith("rotation")]
        columns = starts[members][:, None] + np.array(turns, int)
        order = "".join(channels[i][0] for i in turns)
        for first in range(0, frames if turns else 0, BLOCK):
            angles = np.radians(bvh.values[first : first + BLOCK, columns])
            rotations[first : first + BLOCK, members] = quat.from_euler(angles, order)
    root, offsets, translations, repairs = _positions(bvh, starts, still)
    notes = _wraps(bvh, starts)
    return Decoded(quat.continuous(rotations), root, offsets, translations, repairs, notes)


def _wraps(bvh: Bvh, starts: Array) -> list[str]:
    """A sentence on angles that jump by half a turn or more, as they do when they wrap at 360 degrees."""
    channels = enumerate(bvh.channels)
    turning = [starts[j] + i for j, names in channels for i, name in enumerate(names) if "rot" in name]
    leaps = np.abs(np.diff(bvh.values[:, turning], axis=0)) > 180.0
    if not leaps.any():
        return []
    after, column = (int(x) for x in np.argwhere(leaps)[0])
    joint = bvh.names[int(np.searchsorted(starts, turning[column], side="right")) - 1]
    times = int(leaps.any(axis=1).sum())
    return [
        f"Angles wrap by up to a whole turn between {times} pairs of frames (first {joint}, frames "
        f"{after + 1} and {after + 2}); as rotations they are smooth."
    ]


def _positions(bvh: Bvh, starts: Array, still: float) -> tuple[Array, Array, Array | None, list[str]]:
    """The fields `root`, `offsets`, `translations` and `repairs` of `Decoded`.

    starts: the first column of each joint's channels.
    """
    root = np.broadcast_to(bvh.offsets[0], (len(bvh), 3)).copy()
    below = []
    for j, channels in enumerate(bvh.channels):
        places = {name[0]: starts[j] + i for i, name in enumerate(channels) if name.endswith("position")}
        if j == 0:
            for axis, column in places.items():
                root[:, "XYZ".index(axis)] = bvh.values[:, column]
        elif places:
            below.append((j, places))
    if not below:
        return root, bvh.offsets, None, []
    local = np.broadcast_to(bvh.offsets, (len(bvh), *bvh.offsets.shape)).copy()
    given = np.zeros(bvh.offsets.shape, bool)
    for j, places in below:
        for axis, column in places.items():
            local[:, j, "XYZ".index(axis)] = bvh.values[:, column]
            given[j, "XYZ".index(axis)] = True
    return root, *_judge_channels(bvh, local, given, still)


def _judge_channels(
    bvh: Bvh, local: Array, given: Array, still: float
) -> tuple[Array, Array | None, list[str]]:
    """Judges which position channels carry motion, which only repeat an offset, and which contradict it.

    Returns the fields `offsets`, `translations` and `repairs` of `Decoded`. local: (F, J, 3) positions
    relative to the parents; where channels must be added to the OFFSETs, this array is changed. given: (J, 3)
    bool, which components of the positions come from channels.
    """
    joints = np.flatnonzero(given.any(axis=1)).tolist()
    middle = np.median(local, axis=0)
    added = _increments(bvh.offsets, middle, given, still)
    notes = []
    if added:
        if np.abs(local[:, joints] * given[joints]).max() <= still:
            dropped = f"The position channels of {len(joints)} joints are zero and were dropped."
            return bvh.offsets, None, [dropped]
        for values in (local, middle):
            values[..., added, :] += bvh.offsets[added] * given[added]
        notes.append(
            f"The position channels of {_list(bvh, added)} are about zero, unlike their OFFSETs, and were "
            "added to them."
        )
    moving = [j for j in joints if np.abs(local[:, j] - middle[j]).max() > still]
    wrong = [j for j in joints if j not in moving and np.abs(middle[j] - bvh.offsets[j]).max() > still]
    offsets = bvh.offsets.copy()
    offsets[wrong] = middle[wrong]
    if wrong:
        notes.append(
            f"The OFFSET of {_list(bvh, wrong)} contradicts its position channels, which never change; their "
            "value was used."
        )
    if moving:
        others = "" if len(moving) == len(joints) else ", those of the others do not"
        notes.append(
            f"{len(joints)} joints below the root have position channels. Those of {_list(bvh, moving)} "
            f"change{others}."
        )
    else:
        notes.append(
            f"The position channels of {len(joints)} joints below the root only repeat their offsets and "
            "were dropped."
        )
    return offsets, (local if moving else None), notes


def _increments(offsets: Array, middle: Array, given: Array, still: float) -> list[int]:
    """Joints whose position channels are about zero although their offsets are not.

    The channels of such a joint must be added to its offset: if they replaced it, the bone would be far
    shorter than its OFFSET. About zero is at most a tenth of the offset, but at least `still` and at most 10
    times `still`.

    middle: (J, 3) the median over the frames of the positions relative to the parents. given: (J, 3) bool,
    which components of the positions come from channels.
    """
    apart = np.linalg.norm(middle * given, axis=1)
    length = np.linalg.norm(offsets * given, axis=1)
    about_zero = apart <= np.clip(0.1 * length, still, 10 * still)
    return np.flatnonzero((length > still) & about_zero).tolist()


def _list(bvh: Bvh, joints: list[int]) -> str:
    return ", ".join(bvh.names[j] for j in joints[:6]) + (", ..." if len(joints) > 6 else "")
