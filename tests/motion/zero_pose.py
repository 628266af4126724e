"""Other zero poses: rotations that are added to each joint, so that a rig stands otherwise at angles of 0."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.core import quat

Array = np.ndarray
RESTS = (
    "own",
    "a pose",
    "arms down",
    "lying",
    "facing x",
    "one axis",
    "one axis per side",
    "twisted",
    "heap",
    "sitting",
)


def zero_pose(
    places: Array,
    turns: Array,
    parents: Sequence[int],
    names: Sequence[str],
    rest: str,
    rng: np.random.Generator,
) -> Array:
    """(J, 4) rotation to add to each joint. places, turns: (F, J, 3) and (F, J, 4). rest: one of RESTS."""
    n = len(parents)
    none = np.broadcast_to(quat.IDENTITY, (n, 4)).copy()
    x, z = np.eye(3)[0], np.eye(3)[2]
    if rest == "own":
        return none
    if rest in ("a pose", "arms down"):
        angle = np.radians(45.0 if rest == "a pose" else 80.0)
        for side, sign in (("Left", 1), ("Right", -1)):
            for j in _arm_of(names, parents, places, turns, side):
                none[j] = quat.from_axis_angle(z, np.array(angle * sign))
        return none
    if rest == "lying":
        return np.broadcast_to(quat.from_axis_angle(x, np.array(np.pi / 2)), (n, 4)).copy()
    if rest == "facing x":
        return np.broadcast_to(quat.yaw(-np.pi / 2), (n, 4)).copy()
    if rest == "sitting":
        bent = quat.from_axis_angle(x, np.array(np.pi / 2))
        for j in _thighs(parents, places, turns):
            none[j] = bent
        return none
    if rest == "heap":
        return quat.normalize(rng.normal(size=(n, 4)))
    for j in range(n):
        below = [k for k in range(n) if parents[k] == j]
        bones = [
            np.median(quat.rotate(quat.inv(turns[:, j]), places[:, k] - places[:, j]), axis=0) for k in below
        ]
        bone = max(bones, key=np.linalg.norm, default=x)
        if np.linalg.norm(bone) < 1.0:
            bone = x
        roll = rng.choice([0.0, 0.5, 1.0, 1.5]) * np.pi if rest != "twisted" else rng.uniform(-np.pi, np.pi)
        spin = quat.from_axis_angle(bone / np.linalg.norm(bone), np.array(roll))
        if rest == "twisted":
            none[j] = spin
            continue
        axis = -x if rest == "one axis per side" and bone[0] < -0.5 else x
        none[j] = quat.mul(spin, quat.between(axis, bone))
    return none


def _local(places: Array, turns: Array, j: int, k: int) -> Array:
    return np.median(quat.rotate(quat.inv(turns[:, j]), places[:, k] - places[:, j]), axis=0)


def _thighs(parents: Sequence[int], places: Array, turns: Array) -> list[int]:
    """Joints that point down in the clip's own zero pose, as do their children."""
    out = []
    for j in range(len(parents)):
        for k in (k for k in range(len(parents)) if parents[k] == j):
            bone = _local(places, turns, j, k)
            if bone[1] < -15 and parents[j] >= 0 and not any(parents[j] == o for o in out):
                out.append(j)
    return out


def _arm_of(
    names: Sequence[str], parents: Sequence[int], places: Array, turns: Array, side: str
) -> list[int]:
    """The joints of one arm from the shoulder on, if they point outward in the clip's own zero pose."""
    sign = 1 if side == "Left" else -1
    out: list[int] = []
    for j in range(len(parents)):
        below = [k for k in range(len(parents)) if parents[k] == j]
        bones = [_local(places, turns, j, k) for k in below]
        long = any(b[0] * sign > 15 and abs(b[1]) < 1 and abs(b[2]) < 0.8 for b in bones)
        if parents[j] in out or long:
            out.append(j)
    return out
