"""The keys of a configuration's `runtime` section."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, PositiveFloat, Section


class Runtime(Section):
    """The character."""

    mode: PhaseMode = Field("cubic", description="how phase is looked up")
    rates: dict[str, PositiveFloat] = Field(
        {}, description="channel: largest change of its values in a second, instead of the channel's own"
    )
    scales: dict[str, PositiveFloat] = Field({}, description="channel: what its values are divided by")
    foot_locking: bool = True
    limits: bool = Field(True, description="whether a hurt body is asked for no more than it can do")
    steering: Annotated[float, Field(ge=0)] = Field(
        2.0, description="how hard a velocity that is not reached is asked for; 0 is the original runtime"
    )
