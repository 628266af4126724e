"""Sentences about the response to injury, for the top of the report.

A link is the piece of the body between two neighbouring joints. It can be hurt with a severity of 0 to 10.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hobble.core.files import Json
from hobble.report.parts import Hint, format_number


def injury_hints(found: Json) -> Iterator[Hint]:
    """Whether and how much each hurt link changes the walk, and whether the walk recovers.

    found: the content of injury.json. Only links that were hurt in training are judged. Their changes are
    compared with the drift of a healthy walk, which is how much it changes although nothing hurts.
    """
    responses = [r for r in found.get("responses") or () if r["gait"] == "walk"]
    trained = [r for r in responses if r.get("trained", True)]
    if not trained:
        return
    drift, drift_at_end = (_drift(responses, key) for key in ("from_healthy_cm", "after_healing_cm"))
    if drift > 2:
        yield Hint(
            "warn",
            f"Even a healthy walk changes, by {format_number(drift)} cm per joint.",
            "So the effect of severity is hard to measure. Train for longer, or measure for longer.",
        )
    unchanged = [r["link"] for r in trained if (r.get("from_healthy_cm") or 0) < max(0.5, 2 * drift)]
    if unchanged:
        yield Hint(
            "note",
            f"{len(unchanged)} of {_plural(len(trained), 'link')} hardly "
            f"{'changes' if len(unchanged) == 1 else 'change'} the walk at severity 10",
            "(by less than half a centimetre per joint, or by less than twice the change of a healthy walk): "
            f"{', '.join(unchanged[:4])}{' …' if len(unchanged) > 4 else ''}. Add clips in which they hurt.",
        )
    not_healed = [
        r["link"]
        for r in trained
        if r["link"] not in unchanged and (r.get("after_healing_cm") or 0) > max(2, 2 * drift_at_end)
    ]
    if not_healed:
        yield Hint(
            "note",
            f"The walk does not recover after these links have healed: {', '.join(not_healed[:4])}"
            f"{' …' if len(not_healed) > 4 else ''}.",
            "The character keeps limping although nothing hurts any more.",
        )
    if not unchanged:
        changes = [r["from_healthy_cm"] for r in trained]
        yield Hint(
            "good",
            f"{len(trained)} of {_plural(len(responses), 'link')} {'was' if len(trained) == 1 else 'were'} "
            "hurt in training.",
            f"At severity 10, {'it' if len(trained) == 1 else 'each of them'} changes the walk by "
            f"{_span(min(changes), max(changes))} cm per joint. A link is the piece of the body between two "
            "neighbouring joints.",
        )


def _span(low: float, high: float) -> str:
    """Two numbers as a range, or one number if they are equal.

    >>> _span(3.472, 7.018), _span(2.0, 2.0)
    ('3.47 to 7.02', '2.00')
    """
    return format_number(low) if low == high else f"{format_number(low)} to {format_number(high)}"


def _drift(responses: Sequence[Mapping[str, Any]], key: str) -> float:
    """The drift of a healthy walk: the mean of `key` over links that were never hurt in training.

    These links have no effect, so a walk that changes with their severity only drifts. 0 if there are no such
    links. responses: from injury.json. key: one of their keys, with values in cm.
    """
    values = [r[key] for r in responses if not r.get("trained", True) and r.get(key) is not None]
    return float(np.mean(values)) if values else 0.0


def _plural(count: int, word: str) -> str:
    """A count and its noun, in the plural unless the count is 1.

    >>> _plural(1, "link"), _plural(2, "link")
    ('1 link', '2 links')
    """
    return f"{count} {word}{'' if count == 1 else 's'}"
