"""What a measurement adds to compare.json, the comparison of configurations, and the types of its rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from hobble.evaluation.series import difference_in_sds
from hobble.measures.inputs import Json, Row


@dataclass(frozen=True)
class ComparisonAddition:
    """What one measurement adds to compare.json.

    entries: the results of each configuration, under the measurement's name. about: configuration -> entries
    to add to its description. differences: rows such as `DifferenceOf`. against_published: rows from
    `published_row`. milliseconds: what was measured with a clock, key -> rows. `difference` and
    `against_published` are such keys, and a measurement may have others.
    """

    entries: Sequence[Json] = field(default=(), repr=False)
    about: Mapping[str, Json] = field(default_factory=dict, repr=False)
    differences: Sequence[Row] = field(default=(), repr=False)
    against_published: Sequence[Row] = field(default=(), repr=False)
    milliseconds: Mapping[str, Sequence[Row]] = field(default_factory=dict, repr=False)


class Difference(TypedDict):
    """Means and standard deviations (sd) of two series a and b, and their difference. See `compare_series`.

    mean_a, sd_a, mean_b, sd_b: over single frames. sd_of_means_a, sd_of_means_b: standard deviation of the
    means of single clips or laps.
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
    """The difference of two configurations, named `a` and `b`.

    over: what was compared: a split, a clip or a phase mode (how the network looks up the phase).
    """

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
    other_figure: str | None


def compare_series(a: Json, b: Json) -> Difference:
    """Means and standard deviations of two series, and their difference by eq. 3.2 of Segerstedt 2021.

    a, b: have `mean` and `sd` over single frames, and may have `means`, the mean of each clip or lap.
    `difference` is |mean_a - mean_b| in units of the average sd. `difference_of_means` is the same for the
    means and the sd of `means`, as in the publication. It is None if a or b has fewer than two means.
    """
    means_of_both = [np.asarray(series.get("means", ()), float) for series in (a, b)]
    sds = [float(values.std()) if len(values) > 1 else None for values in means_of_both]
    difference_of_means = None
    if sds[0] is not None and sds[1] is not None:
        mean_a, mean_b = (float(values.mean()) for values in means_of_both)
        difference_of_means = difference_in_sds(mean_a, sds[0], mean_b, sds[1])
    return {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference_in_sds(a["mean"], a["sd"], b["mean"], b["sd"]),
        "sd_of_means_a": sds[0],
        "sd_of_means_b": sds[1],
        "difference_of_means": difference_of_means,
    }


def published_row(measure: str, row: Json, theirs: float, ours: float | None, unit: str = "") -> PublishedRow:
    """A published number (`theirs`) next to ours, which is None if it was not measured.

    measure: what was measured, in words. row: the entry of published.yaml. It has `configuration` and
    `source`. It may have `table`, the number of the table that printed the value, and `other_figure`, a text
    with a different value from the same publication.
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
