"""The keys of a configuration's `runtime` section."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, PositiveFloat, Section


class Runtime(Section):
    """The character."""

    mode: PhaseMode = Field(
        "cubic",
        description="how a phase gets its weights: cubic is exact, linear has 10 tables, constant 50",
    )
    rates: dict[str, PositiveFloat] = Field(
        {}, description="channel: largest change of its values per second; default: the channel's own rate"
    )
    scales: dict[str, PositiveFloat] = Field({}, description="channel: divisor of its values")
    foot_locking: bool = True
    limits: bool = Field(True, description="limit the target speed to what the injured body can do")
    steering: Annotated[float, Field(ge=0)] = Field(
        2.0,
        description="gain of the correction of a velocity that is not reached; 0 is the original runtime",
    )
