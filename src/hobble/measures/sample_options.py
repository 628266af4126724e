"""The option that limits a measurement to a sample of the clips' frames: `measures.stratified_sample`."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import Section


class SampleOptions(Section):
    """An option of all measurements of clips."""

    sample_frames: int = Field(
        500_000,
        gt=0,
        description="most frames to measure; a larger data set is sampled by gait, speed, channel and split",
    )
