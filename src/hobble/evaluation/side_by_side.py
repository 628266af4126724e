"""What a measurement says of several configurations, and the pieces that it is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hobble.evaluation.series import difference
from hobble.measures.given import Json, Row


@dataclass(frozen=True)
class SideBySide:
    """What one measurement adds to compare.json.

    entries: the list under its own name. about: configuration -> what sets it apart. differences: rows of
    `pair`. beside: rows of `beside`, published figures with ours. milliseconds: likewise `difference`,
    `beside` and whatever else a clock decides.
    """

    entries: Sequence[Json] = field(default=(), repr=False)
    about: Mapping[str, Json] = field(default_factory=dict, repr=False)
    differences: Sequence[Row] = field(default=(), repr=False)
    beside: Sequence[Row] = field(default=(), repr=False)
    milliseconds: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)


def pair(a: Json, b: Json) -> dict[str, Any]:
    """Mean and standard deviation of two series, and eq. 3.2 of Segerstedt 2021 of them."""
    return {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference(a["mean"], a["sd"], b["mean"], b["sd"]),
    }


def beside(measure: str, row: Json, theirs: float, ours: float | None, unit: str = "") -> dict[str, Any]:
    """A published figure (of `row`: configuration and source), and ours where it was measured."""
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
    }
