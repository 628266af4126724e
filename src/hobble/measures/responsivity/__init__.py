"""Laps of the waypoint track in each phase mode: milliseconds a frame, and how well it is followed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hobble.core.section import PhaseMode, Positive, Section
from hobble.measures.measure import Cost, Measure
from hobble.runtime.options import Runtime


class Options(Section):
    """Its keys of the section `evaluation`."""

    laps: Positive = Field(19, description="in the runtime's own phase mode")
    laps_beside: Positive = Field(
        3, description="at most, in each other mode: from the second on, a lap repeats the one before"
    )
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="a lap that takes longer is ended there"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes that laps are run in, beside the runtime's own",
    )


MEASURE = Measure(
    name="responsivity",
    package=__name__,
    inputs=("weights",),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_mb=134, minutes=60),
)
