"""The keys of a data set's `synthetic` section."""

from typing import Annotated, Literal

from pydantic import Field

from hobble.core.section import Section

WRITTEN_LABEL_SUFFIXES = ("_footsteps.txt", "_gait.txt")  # endings of the label files that each clip gets


class Synthetic(Section):
    """Synthetic clips: their length, their frame rate and their seed."""

    frames: Annotated[int, Field(ge=600, le=1_000_000_000)] = Field(
        20_000, description="length of all clips together, in frames at 60 Hz"
    )
    fps: Literal[60, 120] = Field(120, description="frame rate of the files, frames a second")
    seed: int = Field(1, description="seed of all random choices")
