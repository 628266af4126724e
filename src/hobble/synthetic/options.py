"""The keys of a data set's `synthetic` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.core.section import Section

WRITES = ("_footsteps.txt", "_gait.txt")  # beside each clip


class Synthetic(Section):
    """The embedded data set: its size and its seed."""

    frames: Annotated[int, Field(ge=600, le=1_000_000_000)] = Field(
        20_000, description="frames at 60 Hz of all clips together"
    )
    fps: Literal[60, 120] = Field(120, description="frames a second of the files")
    seed: int = 1
