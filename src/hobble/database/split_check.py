"""Refuses a split that trains on a motion and also holds it out: the held-out error would mean nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from hobble.core.errors import HobbleError

MOST_NAMED = 10  # a message names at most this many pairs of clips


def refuse_both_sides(where: str, pairs: Iterable[tuple[str, str, str]], splits: Mapping[str, str]) -> None:
    """Raise HobbleError with every pair of clips where one is in training and the other is held out.

    where: the data set's name for messages. pairs: (clip, clip, how they are alike, such as "the same file").
    splits: clip -> "train" or "held_out"; other clips are ignored.
    """
    alike, not_held_out = [], []
    for a, b, what in pairs:
        if {splits.get(a), splits.get(b)} == {"train", "held_out"}:
            held, trained = (a, b) if splits[a] == "held_out" else (b, a)
            alike.append(f"{held} and {trained} are {what}")
            not_held_out.append(trained)
    if not alike:
        return
    more = f" and {len(alike) - MOST_NAMED} more pairs" if len(alike) > MOST_NAMED else ""
    names = ", ".join(f'"{name}"' for name in dict.fromkeys(not_held_out))
    raise HobbleError(
        f"{where}: {'; '.join(alike[:MOST_NAMED])}{more}: the first of each pair is held out and the second "
        f"is trained on, so the network would learn what is held out. Add to held_out: [{names}], or take "
        "one of each pair out of the data set."
    )
