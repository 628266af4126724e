"""Makes the hips the root of a rig, if its file has joints above them, such as "Reference".

The motion of the joints above is added to the motion of the hips.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.motion.read import Bvh, Decoded, decode_channels


def below_hips(file: Bvh, hips: int) -> Bvh:
    """The file with its hips as the root. Joints that are not below them are left out.

    hips: index of the hips.
    """
    if hips == 0:
        return file
    below = [hips]
    for j in range(hips + 1, len(file.names)):
        if file.parents[j] in below:
            below.append(j)
    return _with_joints(file, below)


def decode_below(file: Bvh, hips: int, still: float) -> Decoded:
    """Rotations and positions of the joints of `below_hips`, as if the hips had always been the root.

    hips: index of the hips. still: a joint whose position stays this close to its offset (in the file's
    unit) does not move relative to its parent.
    """
    decoded = decode_channels(below_hips(file, hips), still)
    if hips == 0:
        return decoded
    above: list[int] = []
    joint = file.parents[hips]
    while joint >= 0:
        above.insert(0, joint)
        joint = file.parents[joint]
    chain = decode_channels(_with_joints(file, above), 0.0)
    # World position and rotation of the joint directly above the hips, added up from the root downward.
    place, turn = chain.root, chain.rotations[:, 0]
    for i in range(1, len(above)):
        offset = chain.offsets[i] if chain.translations is None else chain.translations[:, i]
        place = place + quat.rotate(turn, offset)
        turn = quat.mul(turn, chain.rotations[:, i])
    rotations = decoded.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    root = place + quat.rotate(turn, decoded.root)
    names = ", ".join(file.names[j] for j in above)
    note = f"The joints above {file.names[hips]} ({names:.100}) were left out; their motion was added to it."
    return replace(decoded, rotations=quat.continuous(rotations), root=root, notes=[note, *decoded.notes])


def _with_joints(file: Bvh, joints: list[int]) -> Bvh:
    """The same file with only some of its joints. joints: parents before children; the first is the root."""
    new_index = {old: i for i, old in enumerate(joints)}
    # starts: the first column of each joint's channels in `file.values`.
    starts = np.cumsum([0, *(len(c) for c in file.channels)])
    columns = [column for j in joints for column in range(starts[j], starts[j + 1])]
    names = tuple(file.names[j] for j in joints)
    return replace(
        file,
        names=names,
        parents=tuple(new_index.get(file.parents[j], -1) for j in joints),
        offsets=file.offsets[joints],
        channels=tuple(file.channels[j] for j in joints),
        values=file.values[:, columns],
        end_sites={name: sites for name, sites in file.end_sites.items() if name in names},
    )
