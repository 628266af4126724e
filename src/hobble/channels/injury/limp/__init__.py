"""Measures the limp that each hurt link causes.

The size of the limp is compared with people's limps. Two recognisers say whether they find the limp.
"""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import PositiveFloat
from hobble.measures.measure import Cost, Measure, SampleOptions
from hobble.runtime.options import Runtime


class Options(SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""

    limp_seconds: PositiveFloat = Field(8.0, description="length of each walk whose limp is measured")


MEASURE = Measure(
    name="limp",
    module=__name__,
    channel="injury",
    inputs=("weights", "clips", "summaries"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_mb=600, mb_per_1000_frames=14, seconds_per_1000_frames=0.1, least_minutes=20),
)
