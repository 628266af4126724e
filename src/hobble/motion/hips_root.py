"""Folds joints above the hips, such as the "Reference" of some programs, into the hips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.motion.decode import Decoded, decode
from hobble.motion.read import Bvh


def below_hips(file: Bvh, hips: int) -> Bvh:
    """The file with the joint `hips` as its root. Joints that are not below it are left out."""
    if not hips:
        return file
    below = [hips]
    for j in range(hips + 1, len(file.names)):
        if file.parents[j] in below:
            below.append(j)
    return part(file, below)


def decode_below(file: Bvh, hips: int, still: float) -> Decoded:
    """Rotations and positions of `below_hips`. The motion of the joints above is added to that of the hips.

    still: a joint whose position stays this close to its offset (in the file's unit) does not move relative
    to its parent.
    """
    decoded = decode(below_hips(file, hips), still)
    if not hips:
        return decoded
    above: list[int] = []
    joint = file.parents[hips]
    while joint >= 0:
        above.insert(0, joint)
        joint = file.parents[joint]
    carrier = decode(part(file, above), 0.0)
    place, turn = carrier.root, carrier.rotations[:, 0]
    for i in range(1, len(above)):
        offset = carrier.offsets[i] if carrier.translations is None else carrier.translations[:, i]
        place = place + quat.rotate(turn, offset)
        turn = quat.mul(turn, carrier.rotations[:, i])
    rotations = decoded.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    root = place + quat.rotate(turn, decoded.root)
    names = ", ".join(file.names[j] for j in above)
    notes = [f"The joints above {file.names[hips]} ({names:.100}) were folded into it.", *decoded.notes]
    return replace(decoded, rotations=quat.continuous(rotations), root=root, notes=notes)


def part(file: Bvh, joints: list[int]) -> Bvh:
    """The same file with only some of its joints. joints: parents before children; the first is the root."""
    new = {old: i for i, old in enumerate(joints)}
    starts = np.cumsum([0, *(len(c) for c in file.channels)])
    columns = [column for j in joints for column in range(starts[j], starts[j + 1])]
    names = tuple(file.names[j] for j in joints)
    return replace(
        file,
        names=names,
        parents=tuple(new.get(file.parents[j], -1) for j in joints),
        offsets=file.offsets[joints],
        channels=tuple(file.channels[j] for j in joints),
        values=file.values[:, columns],
        end_sites={name: sites for name, sites in file.end_sites.items() if name in names},
    )
