"""Decides what hurts, and when, in the hurt versions of a data set. All links take turns, those
with large effects more often.
"""

from __future__ import annotations

import math
import zlib

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.hurt.body_parts import part_of_link
from hobble.hurt.options import Hurt

# Part -> how often each of its links is in the deck (see `severities`). Links of other parts are in it once.
OFTEN = {"hip": 3, "thigh": 3, "shank": 3, "foot": 3, "back": 2, "upper arm": 2, "forearm": 2}
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples, modulo 1, spread evenly
FURTHER_LINKS = 0.25  # share of the stretches in which further links hurt as well, if `at_once` allows it
# Share of the stretches in which an arm hurts as well, if `at_once` leaves room. People swing their arms in
# very different ways. If few of them have a hurt arm, a network takes the swing of these few for an effect of
# the injury. An injury of an arm hardly changes the legs, so both can be learnt from the same stretch.
ARM_TOO = 0.6
ARMS = ("upper arm", "forearm")
# A clip is divided into equal stretches of about `seconds`. If whole stretches leave a rest of at least this
# share of `seconds`, there is one stretch more.
LEAST_REST = 0.4


def severities(skeleton: Skeleton, frames: int, fps: float, options: Hurt, clip: str, turn: int) -> Array:
    """(frames, L) severities of a hurt version.

    clip: name of the version. turn: number of the version among all versions of the data set, from 0.

    In each stretch of about `seconds`, one link hurts, at one severity in the first half and another in the
    second half. All versions draw from one deck of links and severities. `turn` decides where a version
    starts in the deck, so that the deck is used evenly for any number and length of versions. `clip` and the
    option `seed` decide what else hurts. Raises HobbleError for an unknown link.
    """
    rng = np.random.default_rng([options.seed, zlib.crc32(clip.encode())])
    deck = _deck(skeleton, options)
    arms = [card for card in deck if part_of_link(skeleton, skeleton.links[card[0]]).name in ARMS]
    out = np.zeros((frames, len(skeleton.links)), np.float32)
    first = int(math.modf((turn + 1) * GOLDEN)[0] * len(deck))
    begin = 0
    for i, length in enumerate(_stretches(frames, options.seconds * fps)):
        hurt = [deck[(first + i) % len(deck)]]
        if options.at_once > 1 and rng.random() < FURTHER_LINKS:
            hurt += [deck[j] for j in rng.permutation(len(deck))[: rng.integers(1, options.at_once)]]
        if arms and len(hurt) < options.at_once and rng.random() < ARM_TOO:
            hurt += [arms[rng.integers(len(arms))]]
        for link, first_half, second_half in hurt[::-1]:
            half = begin + length // 2
            out[begin:half, link] = first_half
            out[half : begin + length, link] = second_half
        begin += length
    return out


def _deck(skeleton: Skeleton, options: Hurt) -> list[tuple[int, float, float]]:
    """The deck of the data set: (column of a link, severity in the first half, severity in the second).

    Links with large effects occur more often. One of the two severities is the highest, from which a network
    learns most. The other alternates between the rest.
    """
    names = list(skeleton.link_names)
    if unknown := [link for link in options.links if link not in names]:
        raise HobbleError(f"hurt.links: skeleton {skeleton.name} has no link {', '.join(unknown)}")
    links = [names.index(link) for link in options.links] if options.links else list(range(len(names)))
    rng = np.random.default_rng(options.seed)
    entries: list[tuple[float, int, tuple[float, float]]] = []
    for i in links:
        often = OFTEN.get(part_of_link(skeleton, skeleton.links[i]).name, 1)
        values = sorted(options.severities, reverse=True)
        others = [values[j] for j in 1 + rng.permutation(len(values) - 1)] or values
        start = rng.random()
        for n in range(often):
            both = (values[0], others[n % len(others)])
            # Entries of one link are far apart, so that no clip has only that link.
            entries.append((math.modf(start + n / often)[0], i, both if n % 2 == 0 else both[::-1]))
    return [(i, *both) for _, i, both in sorted(entries)]


def _stretches(frames: int, length: float) -> list[int]:
    """Lengths of stretches, about `length` frames each. Their sum is `frames`."""
    count = max(1, math.floor(frames / length + 1 - LEAST_REST))
    edges = np.round(np.linspace(0, frames, count + 1)).astype(int)
    return [int(n) for n in np.diff(edges)]
