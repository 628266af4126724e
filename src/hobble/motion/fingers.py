"""Finds the joint that shows where a hand points: the base of a finger."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.names import part_of
from hobble.motion.tree import above

AWAY = (0.1, 0.7)  # range of the distance from the wrist to the base of a finger, in forearm lengths
# Forearm lengths. If a finger is shorter than the longest finger by less than this, both are equally long.
EQUAL = 0.03


def pointing_fingers(skeleton: Skeleton, wrists: Mapping[str, int]) -> dict[str, int]:
    """Side -> the base of the hand's longest finger. Sides without a finger are left out.

    wrists: side -> joint of the wrist. A thumb does not count, nor a chain longer than the forearm: this is
    an object held in the hand. Fingers whose names say that they point where the hand does (like the index
    finger) are preferred. If several fingers are about as long as the longest, the middle one is taken.
    """
    lengths = np.linalg.norm(skeleton.offsets, axis=-1)
    fingers = {}
    for side, wrist in wrists.items():
        forearm = float(lengths[wrist])
        found = _fingers(skeleton, wrist, forearm)
        if not found:
            continue
        longest = max(length for length, _, _ in found)
        bases = {joint: place for length, joint, place in found if length > longest - EQUAL * forearm}
        middle = np.mean(list(bases.values()), axis=0)
        fingers[side] = min(bases, key=lambda joint: float(np.linalg.norm(bases[joint] - middle)))
    return fingers


def _fingers(skeleton: Skeleton, wrist: int, forearm: float) -> list[tuple[float, int, Array]]:
    """Length, base, and (3,) position of the base relative to the wrist, of each chain that can be a finger.

    If the names say that a finger points where the hand does (`_points`), the length of the forearm is added
    to the finger's, so that all other fingers are shorter.
    """
    found = []
    chains = _chains(skeleton.parents, wrist)
    numbers = {_number([skeleton.joints[j] for j in chain]) for chain in chains} - {None}
    # The lowest number is the thumb's.
    thumb = min((n for n in numbers if n is not None), default=None) if len(numbers) > 1 else None
    for chain in chains:
        names = [skeleton.joints[j] for j in chain]
        number = _number(names)
        if "thumb" in "".join(names).lower() or (number is not None and number == thumb):
            continue
        length = float(np.linalg.norm(skeleton.offsets[chain], axis=-1).sum())
        places = np.cumsum(skeleton.offsets[chain], axis=0)
        distances = np.linalg.norm(places, axis=-1)
        far = np.flatnonzero((distances > AWAY[0] * forearm) & (distances < AWAY[1] * forearm))
        preference = forearm if _points(names, skeleton.joints[wrist]) else 0.0
        if len(far) and length < forearm:
            found.append((length + preference, chain[far[0]], places[far[0]]))
    return found


def _chains(parents: Sequence[int], wrist: int) -> list[list[int]]:
    """For each joint below the wrist, the chain of joints from the wrist's child to that joint."""
    out = []
    for end in range(len(parents)):
        chain = above(parents, end)
        if wrist in chain[1:]:
            out.append(chain[: chain.index(wrist)][::-1])
    return out


def _points(names: Sequence[str], wrist: str) -> bool:
    """Whether the names of a chain say that it points where the hand does.

    They do if a name contains "index" or "middle", or "finger" and a number, or if the wrist's name says
    wrist and a name of the chain says hand.
    """
    text = "".join(names).lower()
    hand = part_of(wrist) == "wrist" and any(part_of(name) == "hand" for name in names)
    return "index" in text or "middle" in text or hand or _number(names) is not None


def _number(names: Sequence[str]) -> int | None:
    """The number of a finger in its joints' names: 2 in "LeftFinger2Proximal", 0 in "Bip01 L Finger01"."""
    for name in names:
        if match := re.search(r"finger[ _.]*(\d)", name, re.IGNORECASE):
            return int(match[1])
    return None
