"""The option that limits a measurement to a sample of excerpts (`hobble.measures.stratified_sample`)."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import Section


class SampleOptions(Section):
    """The option of all measurements of clips."""

    sample_frames: int = Field(
        500_000,
        gt=0,
        description="if the clips have more frames, a sample of about this many frames is measured, drawn by "
        "gait, speed, channel and split",
    )
