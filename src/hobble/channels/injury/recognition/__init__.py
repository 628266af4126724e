"""Measures whether a classifier that learns from captured clips recognises hurt parts in generated walks."""

from hobble.measures.measure import Cost, Measure, SampleOptions
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="recognition",
    module=__name__,
    channel="injury",
    inputs=("weights", "clips", "summaries", "published"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(mb_per_1000_frames=18, seconds_per_1000_frames=0.2, least_minutes=30),
)
