"""How large the limp of each link is, beside people's and captured limps, and whether one would name it."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import PositiveFloat, Section
from hobble.measures.measure import Cost, Measure
from hobble.runtime.options import Runtime


class Options(Section):
    """Its keys of the section `evaluation`."""

    limp_seconds: PositiveFloat = Field(8.0, description="of each walk that is measured for its limp")


MEASURE = Measure(
    name="limp",
    package=__name__,
    inputs=("weights", "clips"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_mb=600, memory_each=14, seconds_each=0.1, minutes=20),
)
