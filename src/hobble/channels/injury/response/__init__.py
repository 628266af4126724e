"""Measures how the gait changes as the severity of each link rises from 0 to 10 and falls again."""

from __future__ import annotations

from pydantic import Field

from hobble.core.section import PositiveFloat
from hobble.measures.measure import Cost, Measure, SampleOptions
from hobble.runtime.options import Runtime


class Options(SampleOptions):
    """The keys of this measurement in the section `evaluation`."""

    # 3 s are enough. With 4 s, the mean effects on pose and speed differ by only 1 % (configuration `limp`).
    seconds: PositiveFloat = Field(3.0, description="seconds that a figure walks at each severity")


MEASURE = Measure(
    name="injury",
    module=__name__,
    channel="injury",
    # The network, the rows of the clips, and summaries of these rows.
    inputs=("weights", "clips", "summaries"),
    options=Options,
    runtime=tuple(Runtime.model_fields),  # it depends on all keys of the section `runtime`
    # What its job requests on a cluster: MB for each 1,000 frames of the longest clip, seconds for each 1,000
    # frames of all clips together, but at least `least_minutes`.
    cost=Cost(mb_per_1000_frames=14, seconds_per_1000_frames=0.2, least_minutes=60),
)
