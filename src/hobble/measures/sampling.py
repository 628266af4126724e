"""From how many frames on a measurement is of some clips only; which ones, `hobble.measures.sample` says."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import Section


class Sampling(Section):
    """A key that measurements of every clip share."""

    sample_frames: int = Field(
        5_000_000,
        gt=0,
        description="frames measured, where the data set has more: of clips drawn by gait, speed, channel "
        "and split",
    )
