"""Measures whether a recogniser of captured clips sees moods, and how much they change the walk."""

from hobble.measures.measure import Cost, Measure
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="mood",
    package=__name__,
    inputs=("weights", "clips"),
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_each=18, seconds_each=0.2, minutes=30),
)
