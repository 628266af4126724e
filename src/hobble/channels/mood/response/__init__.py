"""Whether a mood can be seen: a recogniser of captured clips names it, and how much it changes the walk."""

from hobble.measures.measure import Cost, Measure
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="mood",
    package=__name__,
    inputs=("weights", "clips"),
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_each=18, seconds_each=0.2, minutes=30),
)
