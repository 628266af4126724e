"""The parts of clips that a measurement reads: whole clips, or the excerpts of a sample."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hobble.evaluation.captured import Captured, captured
from hobble.measures.inputs import Json, MeasureInputs
from hobble.measures.sample_options import SampleOptions
from hobble.measures.stratified_sample import Sample, draw_sample
from hobble.rows.clip_rows import ClipRows, load_clip_rows
from hobble.rows.excerpts import LONGEST, Excerpt, load_excerpt
from hobble.rows.summary import load_summary


@dataclass(frozen=True)
class ClipPart:
    """Rows of a clip: all of them, or those of `excerpt`. Each row stands for `weight` rows."""

    clip: str
    path: Path
    weight: float = 1.0
    excerpt: Excerpt | None = None

    def load(self, before: int = 0, after: int = 0) -> LoadedPart:
        """Read the rows, with up to `before` rows of the clip before an excerpt and `after` behind it."""
        if self.excerpt is None:
            rows = load_clip_rows(self.path)
            return LoadedPart(rows, 0, len(rows))
        rows = load_excerpt(self.path, self.excerpt, before, after)
        first = min(before, self.excerpt.first)
        return LoadedPart(rows, first, first + self.excerpt.rows)


@dataclass(frozen=True)
class LoadedPart:
    """Rows read from a clip's file. Those to measure are rows[first:stop]; the others lie around them."""

    rows: ClipRows = field(repr=False)
    first: int
    stop: int

    @property
    def frames(self) -> list[int]:
        """The frames of the first and the last row to measure, of which there must be at least one."""
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
    """The unbroken stretches of all clips, or of a sample's excerpts. They are loaded one after another."""
    for part in clip_parts(clips, sample):
        yield from captured(part.load().rows)


def sample_of(inputs: MeasureInputs, options: SampleOptions) -> Sample | None:
    """The excerpts to measure; None for all clips."""
    return draw_sample(map(load_summary, inputs.summaries), inputs.splits, options.sample_frames)


def with_sample(result: Json, sample: Sample | None) -> Json:
    """The result, with a key `sample` (the size of the sample) if only a sample was measured."""
    return result if sample is None else {**result, "sample": sample.to_dict()}


def captured_sampled(found: Mapping[str, Any]) -> str:
    """A sentence on which part of the captured motion was read; empty if all of it was.

    found: a measurement's JSON.
    """
    words = sampled_words(found)
    return f" Only a part of the clips was read: {words}." if words else ""


def sampled_words(found: Mapping[str, Any]) -> str:
    """Which part of the clips was measured, in words; empty if all of them were.

    found: a measurement's JSON.
    """
    sample = found.get("sample")
    if not sample:
        return ""
    return (
        f"{sample['excerpts']:,} of {sample['of_excerpts']:,} excerpts of at most {LONGEST // 60} s, from "
        f"{sample['clips']:,} of {sample['of']:,} clips, drawn by gait, speed, channel and split"
    )
