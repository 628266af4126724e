"""A stratified sample of the clips of a large data set, with weights and confidence intervals.

The clips are put into strata by split, gait, speed (the slow, middle and fast third of a gait) and channel.
Of each stratum some are drawn, in proportion to its rows; each split gets half of the rows that are to be
measured, since the held-out clips are few. A clip drawn counts for all rows of its stratum (Cochran,
Sampling Techniques, 1977, chapters 5 and 6: stratified sampling, ratio estimates).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.measures.results import SampleSize
from hobble.rows.facts import Facts

LEAST = 2  # clips drawn from a stratum, because the variance needs at least two
SPEEDS = 3  # strata of a gait by speed
SURE = 1.96  # standard errors on each side of a 95 % confidence interval


@dataclass(frozen=True)
class Stratum:
    """Similar clips. clips, rows: their number and total rows. drawn: clip in the sample -> its rows."""

    split: str
    clips: int
    rows: int
    drawn: Mapping[str, int] = field(repr=False)

    @property
    def weight(self) -> float:
        """The number of rows that each measured row represents."""
        return self.rows / max(sum(self.drawn.values()), 1)


@dataclass(frozen=True)
class Sample:
    """The clips to measure, by stratum. of: number of all clips."""

    strata: tuple[Stratum, ...]
    of: int

    @property
    def weights(self) -> dict[str, float]:
        """Clip in the sample -> number of rows that each of its rows represents, sorted by name."""
        return dict(sorted((name, stratum.weight) for stratum in self.strata for name in stratum.drawn))

    @property
    def clip_weights(self) -> dict[str, float]:
        """Clip in the sample -> number of clips that it represents."""
        return {name: s.clips / len(s.drawn) for s in self.strata for name in s.drawn}

    def half_width(self, split: str, values: Mapping[str, float]) -> float:
        """Half the width of the 95 % confidence interval of the mean over a split's rows.

        values: clip in the sample -> its mean.
        """
        strata = [stratum for stratum in self.strata if stratum.split == split and stratum.rows]
        total = sum(stratum.rows for stratum in strata)
        variance = sum((stratum.rows / total) ** 2 * _variance(stratum, values) for stratum in strata)
        return SURE * math.sqrt(variance)

    def to_dict(self) -> SampleSize:
        """Plain data for a measurement's JSON."""
        drawn = sum(len(stratum.drawn) for stratum in self.strata)
        return {"clips": drawn, "of": self.of, "strata": len(self.strata)}


def _variance(stratum: Stratum, values: Mapping[str, float]) -> float:
    """Variance of the mean over a stratum's rows, for a ratio estimate from the sampled clips."""
    n = len(stratum.drawn)
    if n == stratum.clips or n < LEAST:
        return 0.0
    rows = np.array(list(stratum.drawn.values()), float)
    mean = np.array([values[name] for name in stratum.drawn])
    off = rows / rows.mean() * (mean - np.average(mean, weights=rows))
    return float((1 - n / stratum.clips) * (off**2).sum() / (n - 1) / n)


def drawn(facts: Iterable[Facts], splits: Mapping[str, str], frames: int) -> Sample | None:
    """A sample of clips with about `frames` rows; None if all clips together have no more.

    The same clips give the same sample, and one more clip changes it only a little.
    """
    clips = [one for one in facts if one.rows]
    if sum(one.rows for one in clips) <= frames:
        return None
    strata = []
    for members in _kinds(clips, splits).values():
        split = splits[members[0].clip]
        rows = sum(one.rows for one in members)
        of_split = sum(one.rows for one in clips if splits[one.clip] == split)
        wanted = frames * _share(clips, splits, split, frames) * rows / of_split
        strata.append(Stratum(split, len(members), rows, _first(members, wanted)))
    return Sample(tuple(strata), len(clips))


def _share(clips: Sequence[Facts], splits: Mapping[str, str], split: str, frames: int) -> float:
    """Share of the measured rows for one split: half, or more if the other split has too few rows."""
    rows = dict.fromkeys(splits.values(), 0)
    for one in clips:
        rows[splits[one.clip]] += one.rows
    others = sum(n for name, n in rows.items() if name != split)
    return max(0.5, 1 - others / frames) if others else 1.0


def _kinds(clips: Iterable[Facts], splits: Mapping[str, str]) -> dict[tuple[Any, ...], list[Facts]]:
    """Stratum -> its clips."""
    by_gait: dict[str, list[float]] = {}
    for one in clips:
        by_gait.setdefault(one.gait, []).append(one.speed)
    edges = {g: np.quantile(s, np.arange(1, SPEEDS) / SPEEDS) for g, s in by_gait.items()}
    kinds: dict[tuple[Any, ...], list[Facts]] = {}
    for one in sorted(clips, key=lambda one: one.clip):
        speed = int(np.searchsorted(edges[one.gait], one.speed))
        kinds.setdefault((splits[one.clip], one.gait, speed, one.channels), []).append(one)
    return kinds


def shuffle_key(name: str) -> bytes:
    """Sort names by this for an order that looks random, is always the same, and stays if one is added."""
    return hashlib.sha256(name.encode()).digest()


def _first(members: Sequence[Facts], rows: float) -> dict[str, int]:
    """A random choice of `LEAST` clips of a stratum, and more until they have `rows` rows."""
    out: dict[str, int] = {}
    for one in sorted(members, key=lambda one: shuffle_key(one.clip)):
        if len(out) >= LEAST and sum(out.values()) >= rows:
            break
        out[one.clip] = one.rows
    return out
