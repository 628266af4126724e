"""What a measurement adds to the comparison of configurations, and the types of its rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from hobble.evaluation.series import difference
from hobble.measures.inputs import Json, Row


@dataclass(frozen=True)
class SideBySide:
    """What one measurement adds to compare.json.

    entries: the list under the measurement's name. about: configuration -> what to add to its description.
    differences: rows such as `DifferenceOf`. against_published: rows from `published_row`. milliseconds: rows
    of what was measured with a clock, under the keys `difference`, `against_published` and others.
    """

    entries: Sequence[Json] = field(default=(), repr=False)
    about: Mapping[str, Json] = field(default_factory=dict, repr=False)
    differences: Sequence[Row] = field(default=(), repr=False)
    against_published: Sequence[Row] = field(default=(), repr=False)
    milliseconds: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)


class Difference(TypedDict):
    """Means and standard deviations (sd) of two series a and b, and their difference. See `pair`.

    sd_of_means: deviation of the means of single clips or laps.
    """

    mean_a: float
    sd_a: float
    mean_b: float
    sd_b: float
    difference: float | None
    sd_of_means_a: float | None
    sd_of_means_b: float | None
    difference_of_means: float | None


class DifferenceOf(Difference):
    """The difference of configurations `a` and `b`. over: the split, clip or phase mode that was compared."""

    a: str
    b: str
    over: str


class PublishedRow(TypedDict):
    """A published number next to ours. See `published_row`."""

    measure: str
    configuration: str
    unit: str
    published: float
    ours: float | None
    source: str
    table: str | None
    other_figure: float | None


def pair(a: Json, b: Json) -> Difference:
    """Means and standard deviations of two series, and their difference by eq. 3.2 of Segerstedt 2021.

    a, b: `mean` and `sd` over single frames, and possibly `means`, the mean of each clip or lap. `difference`
    divides by the deviations over single frames. `difference_of_means` divides by the deviations of `means`,
    as the published difference does. It is None if a or b has fewer than two means.
    """
    means = [np.asarray(series.get("means", ()), float) for series in (a, b)]
    sds = [float(values.std()) if len(values) > 1 else None for values in means]
    of_means = None
    if sds[0] is not None and sds[1] is not None:
        mean_a, mean_b = (float(values.mean()) for values in means)
        of_means = difference(mean_a, sds[0], mean_b, sds[1])
    return {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference(a["mean"], a["sd"], b["mean"], b["sd"]),
        "sd_of_means_a": sds[0],
        "sd_of_means_b": sds[1],
        "difference_of_means": of_means,
    }


def published_row(measure: str, row: Json, theirs: float, ours: float | None, unit: str = "") -> PublishedRow:
    """A published number (`theirs`) next to ours, which is None if it was not measured.

    row: the entry of published.yaml. It has `configuration` and `source`. It may have `table`, the number of
    the table that printed the value, and `other_figure`, a different value in the same publication.
    """
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
        "table": row.get("table"),
        "other_figure": row.get("other_figure"),
    }
