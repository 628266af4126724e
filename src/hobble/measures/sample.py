"""The clips that are measured: all of them, or a stratified sample of a large data set.

The sample consists of excerpts of clips (`hobble.rows.clip_rows`), so that no long clip is measured as a
whole. An excerpt is a range of consecutive rows; a clip has one row for each frame of its gait cycles.

The excerpts are put into groups of similar excerpts, the strata. A stratum has one split (training or
held-out clips), one gait, one range of speed (the slow, middle or fast third of the gait's excerpts) and one
set of channels. Half of the measured rows are from each split, because a share in proportion would contain
few held-out rows. Within a split, each stratum gets a share in proportion to its rows. The excerpts drawn
from a stratum represent all of its rows (Cochran, Sampling Techniques, 1977, chapters 5 and 6: stratified
sampling, ratio estimates).

Each excerpt is drawn independently of the clip that it belongs to. So the confidence interval holds although
excerpts of one clip resemble each other. The interval says how far the mean of the sample may be from the
mean over all rows of these clips. It does not say how much other clips would differ.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import Json
from hobble.measures.measure import MeasureInputs, SampleOptions
from hobble.rows.clip_rows import (
    Captured,
    ClipRows,
    Excerpt,
    ExcerptKind,
    RowsSummary,
    captured_stretches,
    load_clip_rows,
    load_excerpt,
    load_summary,
    shuffle_key,
)

LEAST_EXCERPTS = 2  # drawn from a stratum, because its variance needs two
SPEED_RANGES = 3  # ranges of speed into which the excerpts of each gait are divided
# A hurt version is a copy of a healthy clip that `hobble.hurt` made limp. Its name ends like this:
HURT_VERSION = re.compile(r"_hurt[1-9](_mirror)?$")
STANDARD_ERRORS = 1.96  # half the width of a 95 % confidence interval, in standard errors


@dataclass(frozen=True)
class Stratum:
    """Similar excerpts, some of which are drawn for the sample.

    split: "train" or "held_out". excerpt_count: number of all its excerpts. rows: number of rows in all its
    excerpts. drawn: the excerpts in the sample.
    """

    split: str
    excerpt_count: int
    rows: int
    drawn: tuple[Excerpt, ...] = field(repr=False)

    @property
    def weight(self) -> float:
        """The number of rows that each measured row represents."""
        return self.rows / max(sum(excerpt.rows for excerpt in self.drawn), 1)


@dataclass(frozen=True)
class Sample:
    """The excerpts to measure.

    strata: all strata, each with its drawn excerpts. clip_count: number of all clips, not only the sampled
    ones.
    """

    strata: tuple[Stratum, ...]
    clip_count: int

    @property
    def weights(self) -> dict[Excerpt, float]:
        """Excerpt in the sample -> number of rows that each of its rows represents.

        The keys are sorted by clip and first row.
        """
        return dict(sorted((excerpt, stratum.weight) for stratum in self.strata for excerpt in stratum.drawn))

    @property
    def clip_weights(self) -> dict[Excerpt, float]:
        """Excerpt in the sample -> number of clips that it represents, which may be below 1."""
        return {
            excerpt: excerpt.rows / excerpt.clip_rows * stratum.excerpt_count / len(stratum.drawn)
            for stratum in self.strata
            for excerpt in stratum.drawn
        }

    def confidence_half_width(self, split: str, values: Mapping[Excerpt, float]) -> float:
        """Half the width of the 95 % confidence interval of the mean over all rows of a split.

        values: excerpt in the sample -> mean of the measured quantity over its rows.
        """
        strata = [stratum for stratum in self.strata if stratum.split == split and stratum.rows]
        rows = sum(stratum.rows for stratum in strata)
        variance = sum((stratum.rows / rows) ** 2 * _variance(stratum, values) for stratum in strata)
        return STANDARD_ERRORS * math.sqrt(variance)

    def to_dict(self) -> dict[str, int]:
        """Plain data for a measurement's JSON."""
        drawn = [excerpt for stratum in self.strata for excerpt in stratum.drawn]
        return {
            "excerpts": len(drawn),
            "of_excerpts": sum(stratum.excerpt_count for stratum in self.strata),
            "clips": len({excerpt.clip for excerpt in drawn}),
            "of": self.clip_count,
            "strata": len(self.strata),
        }


def _variance(stratum: Stratum, values: Mapping[Excerpt, float]) -> float:
    """Variance of the estimated mean over a stratum's rows. values: as in `Sample.confidence_half_width`.

    The estimate is the mean of the drawn excerpts, weighted by their rows (a ratio estimate). The variance is
    0 if all excerpts are drawn.
    """
    n = len(stratum.drawn)
    if n == stratum.excerpt_count or n < LEAST_EXCERPTS:
        return 0.0
    rows = np.array([excerpt.rows for excerpt in stratum.drawn], float)
    means = np.array([values[excerpt] for excerpt in stratum.drawn])
    deviations = rows / rows.mean() * (means - np.average(means, weights=rows))
    return float((1 - n / stratum.excerpt_count) * (deviations**2).sum() / (n - 1) / n)


def draw_sample(summaries: Iterable[RowsSummary], splits: Mapping[str, str], frames: int) -> Sample | None:
    """Draw a sample of about `frames` rows. None if all clips together have at most `frames` rows.

    summaries: one for each clip. splits: clip -> split, "train" or "held_out". The same clips give the same
    sample, and one more clip changes it only a little.
    """
    clips = [summary for summary in summaries if summary.rows]
    if sum(summary.rows for summary in clips) <= frames:
        return None
    kinds = {excerpt: kind for summary in clips for excerpt, kind in summary.excerpts.items()}
    rows_of_split = dict.fromkeys(splits.values(), 0)
    for summary in clips:
        rows_of_split[splits[summary.clip]] += summary.rows
    strata = []
    for members in _group_into_strata(kinds, splits):
        split = splits[members[0].clip]
        rows = sum(excerpt.rows for excerpt in members)
        rows_to_draw = frames * _share_of_split(rows_of_split, split, frames) * rows / rows_of_split[split]
        strata.append(Stratum(split, len(members), rows, _draw_excerpts(members, rows_to_draw)))
    return Sample(tuple(strata), len(clips))


def _share_of_split(rows_of_split: Mapping[str, int], split: str, frames: int) -> float:
    """Share of the measured rows for one split: half, or more if the other split has less than half.

    rows_of_split: split -> number of rows. frames: number of rows to measure in both splits.
    """
    others = sum(rows for name, rows in rows_of_split.items() if name != split)
    return max(0.5, 1 - others / frames) if others else 1.0


def _group_into_strata(
    kinds: Mapping[Excerpt, ExcerptKind], splits: Mapping[str, str]
) -> list[list[Excerpt]]:
    """The excerpts of each stratum."""
    speeds_of_gait: dict[str, list[float]] = {}
    for kind in kinds.values():
        speeds_of_gait.setdefault(kind.gait, []).append(kind.speed)
    quantiles = np.arange(1, SPEED_RANGES) / SPEED_RANGES
    edges = {gait: np.quantile(speeds, quantiles) for gait, speeds in speeds_of_gait.items()}
    strata: dict[tuple[Any, ...], list[Excerpt]] = {}
    for excerpt, kind in sorted(kinds.items(), key=lambda item: item[0]):
        speed_range = int(np.searchsorted(edges[kind.gait], kind.speed))
        key = (splits[excerpt.clip], kind.gait, speed_range, kind.channels)
        strata.setdefault(key, []).append(excerpt)
    return list(strata.values())


def _draw_excerpts(members: Sequence[Excerpt], rows: float) -> tuple[Excerpt, ...]:
    """Draw excerpts of a stratum, in an order that looks random, until they have `rows` rows.

    At least LEAST_EXCERPTS are drawn, or all if there are fewer.
    """
    drawn: list[Excerpt] = []
    rows_drawn = 0
    for excerpt in sorted(members, key=_excerpt_shuffle_key):
        if len(drawn) >= LEAST_EXCERPTS and rows_drawn >= rows:
            break
        drawn.append(excerpt)
        rows_drawn += excerpt.rows
    return tuple(drawn)


def _excerpt_shuffle_key(excerpt: Excerpt) -> bytes:
    return shuffle_key(excerpt.clip if excerpt.is_whole_clip else f"{excerpt.clip} {excerpt.first}")


@dataclass(frozen=True)
class ClipPart:
    """Rows of a clip that are measured.

    clip: its name. path: its file of rows. weight: number of rows of the data set that each measured row
    represents. excerpt: the rows to measure; None for all rows of the clip.
    """

    clip: str
    path: Path
    weight: float = 1.0
    excerpt: Excerpt | None = None

    def load(self, before: int = 0, after: int = 0) -> LoadedPart:
        """Read the rows, and up to `before` rows before an excerpt and `after` rows after it."""
        if self.excerpt is None:
            rows = load_clip_rows(self.path)
            return LoadedPart(rows, 0, len(rows))
        rows = load_excerpt(self.path, self.excerpt, before, after)
        first = min(before, self.excerpt.first)
        return LoadedPart(rows, first, first + self.excerpt.rows)


@dataclass(frozen=True)
class LoadedPart:
    """Rows read from a clip's file.

    The rows from `first` up to `stop`, which is not included, are measured. The others lie around them.
    """

    rows: ClipRows = field(repr=False)
    first: int
    stop: int

    @property
    def first_and_last_frame(self) -> list[int]:
        """The first and the last frame to measure, as frames of the clip. There must be a row to measure."""
        return [int(self.rows.frame[at]) for at in (self.first, self.stop - 1)]


def clip_parts(clips: Mapping[str, str | Path], sample: Sample | None) -> Iterator[ClipPart]:
    """The parts to measure, sorted by clip and row.

    clips: name -> file of rows. sample: the excerpts to measure; None for all clips.
    """
    if sample is None:
        for name in sorted(clips):
            yield ClipPart(name, Path(clips[name]))
    else:
        for excerpt, weight in sample.weights.items():
            yield ClipPart(excerpt.clip, Path(clips[excerpt.clip]), weight, excerpt)


def captured_motion(clips: Mapping[str, str | Path], sample: Sample | None) -> Iterator[Captured]:
    """Stretches of consecutive frames of all clips, or of a sample's excerpts, loaded one after another.

    clips: name -> file of rows. sample: the excerpts to read; None for all clips.
    """
    for part in clip_parts(clips, sample):
        yield from captured_stretches(part.load().rows)


def sample_to_measure(inputs: MeasureInputs, options: SampleOptions) -> Sample | None:
    """Draw the sample to measure; None if the data set is so small that all clips are measured."""
    return draw_sample(map(load_summary, inputs.summaries), inputs.splits, options.sample_frames)


def with_sample(result: Json, sample: Sample | None) -> Json:
    """The result, with a key `sample` (the size of the sample) if only a sample was measured."""
    return result if sample is None else {**result, "sample": sample.to_dict()}
