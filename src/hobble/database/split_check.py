"""Refuses a split that trains on a motion and also holds it out for tests.

The error on a motion that the network was trained on says nothing about new motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from hobble.core.errors import HobbleError

MOST_NAMED = 10  # a message names at most this many pairs of clips


def refuse_split_pairs(where: str, pairs: Iterable[tuple[str, str, str]], splits: Mapping[str, str]) -> None:
    """Raise HobbleError if, of two clips with the same motion, one is trained on and the other held out.

    where: the data set's name for messages. pairs: (clip, clip, in what they are alike, such as "the same
    file"). splits: clip -> "train" or "held_out". Pairs with a clip that is not in `splits` are ignored.
    """
    split_pairs, trained_clips = [], []
    for a, b, likeness in pairs:
        if {splits.get(a), splits.get(b)} == {"train", "held_out"}:
            held_out, trained = (a, b) if splits[a] == "held_out" else (b, a)
            split_pairs.append(f"{held_out} and {trained} are {likeness}")
            trained_clips.append(trained)
    if not split_pairs:
        return
    more = f" and {len(split_pairs) - MOST_NAMED} more pairs" if len(split_pairs) > MOST_NAMED else ""
    names = ", ".join(f'"{name}"' for name in dict.fromkeys(trained_clips))
    raise HobbleError(
        f"{where}: {'; '.join(split_pairs[:MOST_NAMED])}{more}. The first clip of each pair is held out and "
        "the second is trained on, so the network would learn a motion that is held out. Add the second ones "
        f"to held_out: [{names}], or take one clip of each pair out of the data set."
    )
