"""Finds the joint that shows where a hand points: the base of a finger."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.motion.names import part_of
from hobble.motion.tree import above

AWAY = (0.1, 0.7)  # range of the distance from the wrist to the base of a finger, in forearm lengths


def pointing_fingers(skeleton: Skeleton, wrists: Mapping[str, int]) -> dict[str, int]:
    """Side -> the base of the hand's longest finger. Sides without a finger are left out.

    A thumb does not count, nor a chain longer than the forearm: that is an object held in the hand. Fingers
    that `_points` knows by their names come before all others.
    """
    lengths = np.linalg.norm(skeleton.offsets, axis=-1)
    fingers = {}
    for side, wrist in wrists.items():
        forearm, best = float(lengths[wrist]), 0.0
        chains = _chains(skeleton.parents, wrist)
        numbers = {_number([skeleton.joints[j] for j in chain]) for chain in chains} - {None}
        # The lowest number is the thumb's.
        thumb = min((n for n in numbers if n is not None), default=None) if len(numbers) > 1 else None
        for chain in chains:
            names = [skeleton.joints[j] for j in chain]
            number = _number(names)
            if "thumb" in "".join(names).lower() or (number is not None and number == thumb):
                continue
            length = float(lengths[chain].sum())
            ways = np.linalg.norm(np.cumsum(skeleton.offsets[chain], axis=0), axis=-1)
            far = [
                j for j, way in zip(chain, ways, strict=True) if AWAY[0] * forearm < way < AWAY[1] * forearm
            ]
            named = forearm if _points(names, skeleton.joints[wrist]) else 0.0
            if far and length < forearm and length + named > best:
                best, fingers[side] = length + named, far[0]
    return fingers


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

    They do if a name says index, middle or finger with a number, or if the wrist joint is named a wrist and a
    joint below it is named a hand.
    """
    text = "".join(names).lower()
    hand = part_of(wrist) == "wrist" and any(part_of(name) == "hand" for name in names)
    return "index" in text or "middle" in text or hand or _number(names) is not None


def _number(names: Sequence[str]) -> int | None:
    """The number of a finger, as 2 of "LeftFinger2Proximal" and 0 of "Bip01 L Finger01"."""
    for name in names:
        if match := re.search(r"finger[ _.]*(\d)", name, re.IGNORECASE):
            return int(match[1])
    return None
