"""The clips that are measured: all of them, or a random sample of a large data set.

The sample consists of excerpts of clips (`hobble.rows.clip_rows`), so that no long clip is measured as a
whole. An excerpt is a range of consecutive rows; a clip has one row for each frame of its gait cycles. Half
of the measured rows are from each split (training or held-out clips), because a share in proportion would
contain few held-out rows. Each excerpt of a split is as likely to be drawn as any other, independently of the
clip that it belongs to. So the confidence interval holds although excerpts of one clip resemble each other
(Cochran, Sampling Techniques, 1977, chapter 6: ratio estimates). The interval says how far the mean of the
sample may be from the mean over all rows of these clips. It does not say how much other clips would differ.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.measures.measure import SPLITS, MeasureInputs, SampleOptions
from hobble.rows import clip_rows
from hobble.rows.clip_rows import Captured, ClipRows, Excerpt, RowsSummary

# A hurt version is a copy of a healthy clip that `hobble.hurt` made limp. Its name ends like this:
HURT_VERSION = re.compile(r"_hurt[1-9](_mirror)?$")
STANDARD_ERRORS = 1.96  # half the width of a 95 % confidence interval, in standard errors


@dataclass(frozen=True)
class Drawn:
    """The sample of one split: the excerpts `drawn` of `of` excerpts, which together have `rows` rows."""

    drawn: tuple[Excerpt, ...] = field(repr=False)
    of: int
    rows: int

    @property
    def weight(self) -> float:
        """The number of rows that each measured row represents."""
        return self.rows / max(sum(excerpt.rows for excerpt in self.drawn), 1)

    def confidence_half_width(self, values: Mapping[Excerpt, float]) -> float:
        """Half the width of the 95 % confidence interval of the mean over all rows of the split.

        values: excerpt in the sample -> mean of the measured quantity over its rows. 0 if all excerpts were
        drawn, or only one.
        """
        n = len(self.drawn)
        if n in (self.of, 0, 1):
            return 0.0
        rows = np.array([excerpt.rows for excerpt in self.drawn], float)
        means = np.array([values[excerpt] for excerpt in self.drawn])
        deviations = rows / rows.mean() * (means - np.average(means, weights=rows))
        return STANDARD_ERRORS * math.sqrt((1 - n / self.of) * (deviations**2).sum() / (n - 1) / n)


@dataclass(frozen=True)
class Sample:
    """The excerpts to measure. splits: split -> its sample. clips: number of all clips, not only these."""

    splits: Mapping[str, Drawn]
    clips: int

    def to_dict(self) -> dict[str, int]:
        """Plain data for a measurement's JSON."""
        drawn = [excerpt for of_split in self.splits.values() for excerpt in of_split.drawn]
        return {
            "excerpts": len(drawn),
            "of_excerpts": sum(of_split.of for of_split in self.splits.values()),
            "clips": len({excerpt.clip for excerpt in drawn}),
            "of": self.clips,
        }


def draw_sample(summaries: Iterable[RowsSummary], splits: Mapping[str, str], frames: int) -> Sample | None:
    """Draw a sample of about `frames` rows. None if all clips together have at most `frames` rows.

    summaries: one for each clip. splits: clip -> split, "train" or "held_out". The same clips give the same
    sample, and one more clip changes it only a little.
    """
    clips = [summary for summary in summaries if summary.rows]
    of_split: dict[str, list[Excerpt]] = {}
    for summary in clips:
        of_split.setdefault(splits[summary.clip], []).extend(summary.excerpts)
    rows = {split: sum(excerpt.rows for excerpt in excerpts) for split, excerpts in of_split.items()}
    if sum(rows.values()) <= frames:
        return None
    drawn = {}
    for split, excerpts in of_split.items():
        # Half of the rows, or more if the other split has less than half.
        wanted = max(frames / 2, frames - sum(count for other, count in rows.items() if other != split))
        order = sorted(excerpts, key=lambda excerpt: clip_rows.shuffle_key(f"{excerpt.clip} {excerpt.first}"))
        before = np.cumsum([0, *(excerpt.rows for excerpt in order)])[:-1]  # rows before each excerpt
        chosen = tuple(sorted(order[: max(2, int(np.searchsorted(before, wanted)))]))
        drawn[split] = Drawn(chosen, len(excerpts), rows[split])
    return Sample(drawn, len(clips))


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
            rows = clip_rows.load_clip_rows(self.path)
            return LoadedPart(rows, 0, len(rows))
        rows = clip_rows.load_excerpt(self.path, self.excerpt, before, after)
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


def clip_parts(clips: Mapping[str, str | Path], sample: Sample | None) -> Iterator[ClipPart]:
    """The parts to measure, sorted by clip and row.

    clips: name -> file of rows. sample: the excerpts to measure; None for all clips.
    """
    if sample is None:
        for name in sorted(clips):
            yield ClipPart(name, Path(clips[name]))
        return
    weights = {e: of_split.weight for of_split in sample.splits.values() for e in of_split.drawn}
    for excerpt, weight in sorted(weights.items()):
        yield ClipPart(excerpt.clip, Path(clips[excerpt.clip]), weight, excerpt)


def captured_motion(clips: Mapping[str, str | Path], sample: Sample | None) -> Iterator[Captured]:
    """Stretches of consecutive frames of all clips, or of a sample's excerpts, loaded one after another.

    clips: name -> file of rows. sample: the excerpts to read; None for all clips.
    """
    for part in clip_parts(clips, sample):
        yield from clip_rows.captured_stretches(part.load().rows)


def errors_of_sums(sums: Array) -> dict[str, Any]:
    """Plain data from sums over frames: 1, and means over the joints of the relative error, its square, and
    the position error (cm). More sums may follow. Without frames, errors are None.
    """
    frames = sums[0]
    mean, squared, cm = sums[1:4] / max(frames, 1.0)
    values = {"mean": mean, "sd": np.sqrt(max(0.0, squared - mean**2)), "position_error_cm": cm}
    return {"frames": round(frames), **{k: float(v) if frames else None for k, v in values.items()}}


def summed_up(
    sums: Mapping[ClipPart, Array],
    splits: Mapping[str, str],
    sample: Sample | None,
    values: Callable[[Array], Json],
    intervals: Mapping[str, int],
) -> dict[str, Any]:
    """What is measured of each clip (key `clips`) and over all clips of each split.

    sums: part of a clip -> (n,) sums over its frames, see `errors_of_sums`. values: makes plain data of sums.
    intervals: key -> index of a sum. If there is a sample, the mean of this sum has the half width of a 95 %
    confidence interval under this key of `interval`.
    """
    of_clip: dict[str, Array] = {}
    for part, own in sums.items():
        of_clip[part.clip] = of_clip.get(part.clip, 0.0) + own
    nothing = np.zeros_like(next(iter(sums.values()), np.zeros(4)))
    clips = [{"clip": clip, "split": splits[clip], **values(own)} for clip, own in of_clip.items()]
    result: dict[str, Any] = {"clips": clips}
    for split in SPLITS:
        total = sum((own for clip, own in of_clip.items() if splits[clip] == split), nothing)
        result[split] = dict(values(total))
        if sample and (drawn := sample.splits.get(split)) and total[0]:
            # An excerpt in which nothing could be measured counts with the mean of the split.
            known = {part.excerpt: own if own[0] else total for part, own in sums.items()}
            result[split]["interval"] = {
                key: drawn.confidence_half_width({e: known[e][at] / known[e][0] for e in drawn.drawn})
                for key, at in intervals.items()
            }
    return result


def sample_to_measure(inputs: MeasureInputs, options: SampleOptions) -> Sample | None:
    """Draw the sample to measure; None if the data set is so small that all clips are measured."""
    return draw_sample(map(clip_rows.load_summary, inputs.summaries), inputs.splits, options.sample_frames)


def with_sample(result: Json, sample: Sample | None) -> Json:
    """The result, with a key `sample` (the size of the sample) if only a sample was measured."""
    return result if sample is None else {**result, "sample": sample.to_dict()}
