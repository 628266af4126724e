"""What a measurement says of several configurations, and the pieces that it is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
    """Mean and standard deviation of two series, and eq. 3.2 of Segerstedt 2021 of them.

    `difference` divides by the deviations of single frames. `difference_of_means`, as published, by those of
    the means of clips or laps, where a and b have them as `means`; None where they do not.
    """
    out = {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference(a["mean"], a["sd"], b["mean"], b["sd"]),
    }
    means = [np.asarray(one.get("means", ()), float) for one in (a, b)]
    sds = [float(some.std()) if len(some) > 1 else None for some in means]
    out |= {"sd_of_means_a": sds[0], "sd_of_means_b": sds[1], "difference_of_means": None}
    if sds[0] is not None and sds[1] is not None:
        one, other = (float(some.mean()) for some in means)
        out["difference_of_means"] = difference(one, sds[0], other, sds[1])
    return out


def published_row(
    measure: str, row: Json, theirs: float, ours: float | None, unit: str = ""
) -> dict[str, Any]:
    """A published figure, and ours where it was measured.

    row: its `configuration` and `source`; the `table` that it was printed in, and the other figure that the
    same publication gives `elsewhere`, where there are any.
    """
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
        "table": row.get("table"),
        "elsewhere": row.get("elsewhere"),
    }
