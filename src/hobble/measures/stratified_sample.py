"""A stratified sample of a large data set, with weights and confidence intervals.

The sample consists of excerpts of clips (`hobble.rows.excerpts`), so that no long clip is measured as a
whole. The excerpts are put into strata by split, gait, speed (the slow, middle and fast third of a gait) and
channel. Each split gets half of the measured rows, because there are few held-out clips. Within a split, each
stratum gets a share in proportion to its rows. The excerpts drawn from a stratum represent all of its rows
(Cochran, Sampling Techniques, 1977, chapters 5 and 6: stratified sampling, ratio estimates).

Each excerpt is drawn on its own, whichever clip it is from. So the confidence interval holds although
excerpts of one clip resemble each other. The interval says how far the mean of the sample may be from the
mean over all rows of these clips. It does not say how much other clips would differ.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.measures.results import SampleSize
from hobble.rows.excerpts import Excerpt, ExcerptKind
from hobble.rows.summary import RowsSummary

LEAST = 2  # at least this many excerpts are drawn from a stratum, because its variance needs two
SPEEDS = 3  # ranges of speed into which each gait is divided
STANDARD_ERRORS = 1.96  # half the width of a 95 % confidence interval, in standard errors


@dataclass(frozen=True)
class Stratum:
    """Similar excerpts.

    count: number of excerpts. rows: number of rows in all of them. drawn: the excerpts in the sample.
    """

    split: str
    count: int
    rows: int
    drawn: tuple[Excerpt, ...] = field(repr=False)

    @property
    def weight(self) -> float:
        """The number of rows that each measured row represents."""
        return self.rows / max(sum(one.rows for one in self.drawn), 1)


@dataclass(frozen=True)
class Sample:
    """The excerpts to measure, by stratum. clips: number of all clips."""

    strata: tuple[Stratum, ...]
    clips: int

    @property
    def weights(self) -> dict[Excerpt, float]:
        """Excerpt in the sample -> number of rows that each row represents. Sorted by clip and row."""
        return dict(sorted((one, stratum.weight) for stratum in self.strata for one in stratum.drawn))

    @property
    def clip_weights(self) -> dict[Excerpt, float]:
        """Excerpt in the sample -> number of clips that it represents."""
        return {
            one: one.rows / one.clip_rows * stratum.count / len(stratum.drawn)
            for stratum in self.strata
            for one in stratum.drawn
        }

    def half_width(self, split: str, values: Mapping[Excerpt, float]) -> float:
        """Half the width of the 95 % confidence interval of the mean over a split's rows.

        values: excerpt in the sample -> mean of the measured quantity over its rows.
        """
        strata = [stratum for stratum in self.strata if stratum.split == split and stratum.rows]
        total = sum(stratum.rows for stratum in strata)
        variance = sum((stratum.rows / total) ** 2 * _variance(stratum, values) for stratum in strata)
        return STANDARD_ERRORS * math.sqrt(variance)

    def to_dict(self) -> SampleSize:
        """Plain data for a measurement's JSON."""
        drawn = [one for stratum in self.strata for one in stratum.drawn]
        return {
            "excerpts": len(drawn),
            "of_excerpts": sum(stratum.count for stratum in self.strata),
            "clips": len({one.clip for one in drawn}),
            "of": self.clips,
            "strata": len(self.strata),
        }


def _variance(stratum: Stratum, values: Mapping[Excerpt, float]) -> float:
    """Variance of the mean over a stratum's rows, for a ratio estimate from the sampled excerpts."""
    n = len(stratum.drawn)
    if n == stratum.count or n < LEAST:
        return 0.0
    rows = np.array([one.rows for one in stratum.drawn], float)
    mean = np.array([values[one] for one in stratum.drawn])
    off = rows / rows.mean() * (mean - np.average(mean, weights=rows))
    return float((1 - n / stratum.count) * (off**2).sum() / (n - 1) / n)


def draw_sample(summaries: Iterable[RowsSummary], splits: Mapping[str, str], frames: int) -> Sample | None:
    """A sample of about `frames` rows; None if all clips together do not have more rows.

    splits: clip -> split. The same clips give the same sample, and one more clip changes it only a little.
    """
    clips = [one for one in summaries if one.rows]
    if sum(one.rows for one in clips) <= frames:
        return None
    every = {excerpt: kind for one in clips for excerpt, kind in one.excerpts.items()}
    of_split = dict.fromkeys(splits.values(), 0)
    for one in clips:
        of_split[splits[one.clip]] += one.rows
    strata = []
    for members in _strata(every, splits).values():
        split = splits[members[0].clip]
        rows = sum(one.rows for one in members)
        rows_to_draw = frames * _share(of_split, split, frames) * rows / of_split[split]
        strata.append(Stratum(split, len(members), rows, _drawn(members, rows_to_draw)))
    return Sample(tuple(strata), len(clips))


def _share(of_split: Mapping[str, int], split: str, frames: int) -> float:
    """Share of the measured rows for one split: half, or more if the other split has too few rows.

    of_split: split -> rows.
    """
    others = sum(rows for name, rows in of_split.items() if name != split)
    return max(0.5, 1 - others / frames) if others else 1.0


def _strata(
    every: Mapping[Excerpt, ExcerptKind], splits: Mapping[str, str]
) -> dict[tuple[Any, ...], list[Excerpt]]:
    """Stratum -> its excerpts."""
    by_gait: dict[str, list[float]] = {}
    for kind in every.values():
        by_gait.setdefault(kind.gait, []).append(kind.speed)
    edges = {g: np.quantile(s, np.arange(1, SPEEDS) / SPEEDS) for g, s in by_gait.items()}
    strata: dict[tuple[Any, ...], list[Excerpt]] = {}
    for one, kind in sorted(every.items(), key=lambda item: item[0]):
        speed = int(np.searchsorted(edges[kind.gait], kind.speed))
        strata.setdefault((splits[one.clip], kind.gait, speed, kind.channels), []).append(one)
    return strata


def shuffle_key(name: str) -> bytes:
    """A key for sorting names. The order looks random, but a new name does not reorder the others."""
    return hashlib.sha256(name.encode()).digest()


def _drawn(members: Sequence[Excerpt], rows: float) -> tuple[Excerpt, ...]:
    """Excerpts drawn at random from a stratum: at least LEAST, and as many as it takes to get `rows` rows."""
    out: list[Excerpt] = []
    rows_drawn = 0
    for one in sorted(members, key=_random_order):
        if len(out) >= LEAST and rows_drawn >= rows:
            break
        out.append(one)
        rows_drawn += one.rows
    return tuple(out)


def _random_order(one: Excerpt) -> bytes:
    return shuffle_key(one.clip if one.is_whole_clip else f"{one.clip} {one.first}")
