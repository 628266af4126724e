"""Measures whether a recogniser of captured clips sees moods and diagnoses, and how they change the walk.

It measures every channel whose values are a manner of walking (`Channel.manner`).
"""

from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="manners",
    package=__name__,
    inputs=("weights", "clips", "facts"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    people=True,
    cost=Cost(memory_each=36, seconds_each=0.4, minutes=30),
)
