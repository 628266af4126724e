"""The parts of clips that a measurement reads: all clips, or only a sample of a large data set.

A sample consists of excerpts, which are stretches of clips (`hobble.measures.stratified_sample`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hobble.evaluation.captured import Captured, captured_stretches
from hobble.measures.inputs import Json, MeasureInputs
from hobble.measures.sample_options import SampleOptions
from hobble.measures.stratified_sample import Sample, draw_sample
from hobble.rows.clip_rows import ClipRows, load_clip_rows
from hobble.rows.excerpts import LONGEST, Excerpt, load_excerpt
from hobble.rows.summary import load_summary


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


def sample_sentence(found: Mapping[str, Any]) -> str:
    """A sentence that says which part of the clips was read; empty if all clips were read.

    found: a measurement's JSON.
    """
    words = sample_in_words(found)
    return f" Only a part of the clips was read: {words}." if words else ""


def sample_in_words(found: Mapping[str, Any]) -> str:
    """The size of the sample in words, as a part of a sentence; empty if all clips were measured.

    found: a measurement's JSON.
    """
    sample = found.get("sample")
    if not sample:
        return ""
    return (
        f"{sample['excerpts']:,} of {sample['of_excerpts']:,} excerpts of at most {LONGEST // 60} s, from "
        f"{sample['clips']:,} of {sample['of']:,} clips, drawn by gait, speed, channel and split"
    )
