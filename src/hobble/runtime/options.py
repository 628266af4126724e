"""The keys of a configuration's `runtime` section."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, PositiveFloat, Section


class Runtime(Section):
    """The character."""

    mode: PhaseMode = Field("cubic", description="how phase is looked up")
    severity_rate: PositiveFloat = Field(10.0, description="largest change of a severity in a second")
    severity_scale: PositiveFloat = Field(1.0, description="severities are divided by this")
    foot_locking: bool = True
    steering: Annotated[float, Field(ge=0)] = Field(
        2.0, description="how hard a velocity that is not reached is asked for; 0 is the original runtime"
    )
