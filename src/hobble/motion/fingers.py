"""Finds the joint that shows where a hand points: the base of a finger."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.names import part_of
from hobble.motion.tree import path_to_root

AWAY = (0.1, 0.7)  # range of the distance from the wrist to the base of a finger, in forearm lengths
# Forearm lengths. A finger that is shorter than the longest finger by less than this counts as equally long.
EQUAL = 0.03


def pointing_fingers(skeleton: Skeleton, wrists: Mapping[str, int]) -> dict[str, int]:
    """Side -> index of the joint at the base of the hand's longest finger. Hands without one are left out.

    wrists: side -> index of the wrist's joint. A thumb does not count. A chain longer than the forearm does
    not count either, because it is an object in the hand. Fingers whose names say that they point where the
    hand does (like the index finger) are preferred. If several fingers are about as long as the longest, the
    middle one of these is taken.
    """
    lengths = np.linalg.norm(skeleton.offsets, axis=-1)
    fingers = {}
    for side, wrist in wrists.items():
        forearm = float(lengths[wrist])
        found = _possible_fingers(skeleton, wrist, forearm)
        if not found:
            continue
        longest = max(length for length, _, _ in found)
        places = {base: place for length, base, place in found if length > longest - EQUAL * forearm}
        middle = np.mean(list(places.values()), axis=0)
        fingers[side] = min(places, key=lambda base: float(np.linalg.norm(places[base] - middle)))
    return fingers


def _possible_fingers(skeleton: Skeleton, wrist: int, forearm: float) -> list[tuple[float, int, Array]]:
    """For each chain that can be a finger: its length, its base, and where the base lies.

    The base is the index of a joint. Its place is a (3,) position relative to the wrist. If the names say
    that a finger points where the hand does (`_points_like_hand`), the length of the forearm is added to the
    finger's, so that all other fingers are shorter. forearm: length of the forearm.
    """
    found = []
    chains = _chains(skeleton.parents, wrist)
    numbers = {_finger_number([skeleton.joints[j] for j in chain]) for chain in chains} - {None}
    # The lowest number is the thumb's. A single number does not show whether its finger is the thumb.
    thumb = min((n for n in numbers if n is not None), default=None) if len(numbers) > 1 else None
    for chain in chains:
        names = [skeleton.joints[j] for j in chain]
        number = _finger_number(names)
        if "thumb" in "".join(names).lower() or (number is not None and number == thumb):
            continue
        length = float(np.linalg.norm(skeleton.offsets[chain], axis=-1).sum())
        places = np.cumsum(skeleton.offsets[chain], axis=0)
        distances = np.linalg.norm(places, axis=-1)
        in_range = np.flatnonzero((distances > AWAY[0] * forearm) & (distances < AWAY[1] * forearm))
        preference = forearm if _points_like_hand(names, skeleton.joints[wrist]) else 0.0
        if len(in_range) and length < forearm:
            found.append((length + preference, chain[in_range[0]], places[in_range[0]]))
    return found


def _chains(parents: Sequence[int], wrist: int) -> list[list[int]]:
    """For each joint below the wrist, the chain of joints from the wrist's child to that joint."""
    out = []
    for end in range(len(parents)):
        chain = path_to_root(parents, end)
        if wrist in chain[1:]:
            out.append(chain[: chain.index(wrist)][::-1])
    return out


def _points_like_hand(names: Sequence[str], wrist: str) -> bool:
    """Whether the names of a chain's joints say that the chain points where the hand does.

    They do if a name contains "index" or "middle", or "finger" and a number, or if the wrist's name says
    wrist and a name of the chain says hand. wrist: name of the wrist's joint.
    """
    text = "".join(names).lower()
    has_hand = part_of(wrist) == "wrist" and any(part_of(name) == "hand" for name in names)
    return "index" in text or "middle" in text or has_hand or _finger_number(names) is not None


def _finger_number(names: Sequence[str]) -> int | None:
    """The number of a finger in its joints' names: 2 in "LeftFinger2Proximal", 0 in "Bip01 L Finger01".

    None if no name contains "finger" and a number.
    """
    for name in names:
        if match := re.search(r"finger[ _.]*(\d)", name, re.IGNORECASE):
            return int(match[1])
    return None
