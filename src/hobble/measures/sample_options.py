"""The option that limits a measurement to a sample of excerpts (`hobble.measures.stratified_sample`)."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import Section


class SampleOptions(Section):
    """The configuration key that all measurements of clips have."""

    sample_frames: int = Field(
        500_000,
        gt=0,
        description="about how many frames are measured at most; if the clips have more, a sample of "
        "excerpts is drawn, so that each split, gait, speed and channel is in it",
    )
