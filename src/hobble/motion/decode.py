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

# If all angles of a file are below 2 pi and one of them changes by more than this, they are in radians: as
# degrees they would be too small for a body that moves.
RADIANS = 0.5
BLOCK = 4096  # frames that are converted at a time, to keep intermediate arrays small


@dataclass(frozen=True)
class Decoded:
    """F frames of J joints, in the file's unit.

    rotations: (F, J, 4) quaternions, relative to the parents. root: (F, 3) positions of the root. offsets:
    (J, 3) constant positions relative to the parents. translations: (F, J, 3) positions relative to the
    parents in each frame, or None if no joint but the root moves relative to its parent. repairs: sentences
    on how the position channels of joints other than the root were read. notes: sentences on oddities that
    need no repair.
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
        last_digit = 10.0 ** -len(mantissa.split(".")[1])  # one unit of the last decimal place
        # Some programs cut digits off instead of rounding. They write .016 for 1/60, which is 4% less.
        rates = [rate for rate in STANDARD_RATES if abs(1 / rate - frame_time) < last_digit * 1.01]
        rates = [rate for rate in rates if abs(rate * frame_time - 1) < 0.045]
        if rates:
            return float(min(rates, key=lambda rate: abs(rate * frame_time - 1)))
    nearest = round(1 / frame_time)
    return float(nearest) if abs(nearest * frame_time - 1) < 1e-5 else 1 / frame_time


def check_angles(bvh: Bvh) -> None:
    """Raise InputError if the angles seem to be in radians, or if no joint has rotation channels."""
    is_rotation = [name.endswith("rotation") for channels in bvh.channels for name in channels]
    if not any(is_rotation):
        fix = "Export the clip with rotations, as nearly all programs do."
        raise InputError(bvh.path, "no joint has rotations, only positions", fix=fix)
    angles = bvh.values[:, is_rotation]
    most = float(np.abs(angles).max())
    if most <= 2 * np.pi and np.ptp(angles, axis=0).max() > RADIANS:
        raise InputError(
            bvh.path,
            f"no angle is larger than {most:.2f}, so they seem to be in radians",
            fix="Export the clip again with angles in degrees.",
        )


def decode_channels(bvh: Bvh, still: float) -> Decoded:
    """Rotations and positions of a BVH file.

    A position channel replaces its component of the joint's OFFSET, as all current programs intend. If the
    position channels of a joint below the root are about zero although its OFFSET is not, their values are
    added to the OFFSET instead. still: a joint whose position stays this close to its offset (in the file's
    unit) does not move relative to its parent.
    """
    frames, joints = len(bvh), len(bvh.names)
    rotations = np.broadcast_to(quat.IDENTITY, (frames, joints, 4)).copy()
    starts = np.cumsum([0, *(len(c) for c in bvh.channels)])  # the first column of each joint's channels
    # Joints with the same channels are converted together, which is faster.
    groups: dict[tuple[str, ...], list[int]] = {}
    for j, channels in enumerate(bvh.channels):
        groups.setdefault(channels, []).append(j)
    for channels, members in groups.items():
        rotation_channels = [i for i, name in enumerate(channels) if name.endswith("rotation")]
        columns = starts[members][:, None] + np.array(rotation_channels, int)
        order = "".join(channels[i][0] for i in rotation_channels)
        for first in range(0, frames if rotation_channels else 0, BLOCK):
            angles = np.radians(bvh.values[first : first + BLOCK, columns])
            rotations[first : first + BLOCK, members] = quat.from_euler(angles, order)
    root, offsets, translations, repairs = _decode_positions(bvh, starts, still)
    notes = _notes_on_wraps(bvh, starts)
    return Decoded(quat.continuous(rotations), root, offsets, translations, repairs, notes)


def _notes_on_wraps(bvh: Bvh, starts: Array) -> list[str]:
    """A sentence on angles that jump by more than half a turn, as they do when they wrap at 360 degrees.

    starts: the first column of each joint's channels. The list is empty if no angle jumps.
    """
    channels = enumerate(bvh.channels)
    rotation_columns = [
        starts[j] + i for j, names in channels for i, name in enumerate(names) if "rot" in name
    ]
    jumps = np.abs(np.diff(bvh.values[:, rotation_columns], axis=0)) > 180.0
    if not jumps.any():
        return []
    frame, column = (int(x) for x in np.argwhere(jumps)[0])
    joint = bvh.names[int(np.searchsorted(starts, rotation_columns[column], side="right")) - 1]
    times = int(jumps.any(axis=1).sum())
    return [
        f"Angles jump by up to a whole turn from one frame to the next, {times} times (first {joint} between "
        f"frames {frame + 1} and {frame + 2}). The rotations themselves are smooth."
    ]


def _decode_positions(bvh: Bvh, starts: Array, still: float) -> tuple[Array, Array, Array | None, list[str]]:
    """The fields `root`, `offsets`, `translations` and `repairs` of `Decoded`.

    starts: the first column of each joint's channels. still: as in `decode_channels`.
    """
    root = np.broadcast_to(bvh.offsets[0], (len(bvh), 3)).copy()
    below_root = []
    for j, channels in enumerate(bvh.channels):
        columns = {name[0]: starts[j] + i for i, name in enumerate(channels) if name.endswith("position")}
        if j == 0:
            for axis, column in columns.items():
                root[:, "XYZ".index(axis)] = bvh.values[:, column]
        elif columns:
            below_root.append((j, columns))
    if not below_root:
        return root, bvh.offsets, None, []
    local = np.broadcast_to(bvh.offsets, (len(bvh), *bvh.offsets.shape)).copy()
    has_channel = np.zeros(bvh.offsets.shape, bool)
    for j, columns in below_root:
        for axis, column in columns.items():
            local[:, j, "XYZ".index(axis)] = bvh.values[:, column]
            has_channel[j, "XYZ".index(axis)] = True
    return root, *_judge_channels(bvh, local, has_channel, still)


def _judge_channels(
    bvh: Bvh, local: Array, has_channel: Array, still: float
) -> tuple[Array, Array | None, list[str]]:
    """Judges which position channels carry motion, which only repeat an offset, and which contradict it.

    Returns the fields `offsets`, `translations` and `repairs` of `Decoded`. local: (F, J, 3) positions
    relative to the parents; where channels must be added to the OFFSETs, this array is changed. has_channel:
    (J, 3) bool, which components of the positions come from channels. still: as in `decode_channels`.
    """
    joints = np.flatnonzero(has_channel.any(axis=1)).tolist()
    median = np.median(local, axis=0)
    added = _joints_to_add(bvh.offsets, median, has_channel, still)
    repairs = []
    if added:
        if np.abs(local[:, joints] * has_channel[joints]).max() <= still:
            dropped = f"The position channels of {len(joints)} joints are zero and were dropped."
            return bvh.offsets, None, [dropped]
        for values in (local, median):
            values[..., added, :] += bvh.offsets[added] * has_channel[added]
        repairs.append(
            f"The position channels of {_list_names(bvh, added)} are about zero, but the OFFSETs are not. "
            "The channels were added to the OFFSETs."
        )
    moving = [j for j in joints if np.abs(local[:, j] - median[j]).max() > still]
    wrong = [j for j in joints if j not in moving and np.abs(median[j] - bvh.offsets[j]).max() > still]
    offsets = bvh.offsets.copy()
    offsets[wrong] = median[wrong]
    if wrong:
        repairs.append(
            f"The OFFSET of {_list_names(bvh, wrong)} contradicts its position channels, which never change. "
            "The values of the channels were used."
        )
    if moving:
        others = "" if len(moving) == len(joints) else ", those of the others do not"
        repairs.append(
            f"{len(joints)} joints below the root have position channels. "
            f"Those of {_list_names(bvh, moving)} change{others}."
        )
    else:
        repairs.append(
            f"The position channels of {len(joints)} joints below the root only repeat their offsets and "
            "were dropped."
        )
    return offsets, (local if moving else None), repairs


def _joints_to_add(offsets: Array, median: Array, has_channel: Array, still: float) -> list[int]:
    """Joints whose position channels are about zero although their offsets are not.

    The channels of such a joint must be added to its offset: if they replaced it, the bone would be far
    shorter than its OFFSET. "About zero" means at most a tenth of the offset's length. This limit is raised
    to `still` if it is less, and lowered to 10 times `still` if it is more.

    median: (J, 3) median, over the frames, of the positions relative to the parents. has_channel: (J, 3)
    bool, which components of the positions come from channels.
    """
    channel_length = np.linalg.norm(median * has_channel, axis=1)
    offset_length = np.linalg.norm(offsets * has_channel, axis=1)
    about_zero = channel_length <= np.clip(0.1 * offset_length, still, 10 * still)
    return np.flatnonzero((offset_length > still) & about_zero).tolist()


def _list_names(bvh: Bvh, joints: list[int]) -> str:
    """The names of the first six joints, with "..." if there are more."""
    return ", ".join(bvh.names[j] for j in joints[:6]) + (", ..." if len(joints) > 6 else "")
