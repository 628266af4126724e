"""The keys of a data set's `synthetic` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.core.section import Section

WRITES = ("_footsteps.txt", "_gait.txt")  # suffixes of the label files that are written for each clip


class Synthetic(Section):
    """Synthetic clips: their length, their frame rate and their seed."""

    frames: Annotated[int, Field(ge=600, le=1_000_000_000)] = Field(
        20_000, description="frames at 60 Hz of all clips together"
    )
    fps: Literal[60, 120] = Field(120, description="frames a second of the files")
    seed: int = Field(1, description="seed of all random choices")
