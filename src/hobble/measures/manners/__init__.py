"""Measures whether moods and diagnoses can be recognised in generated walks, and how they change the walk.

The recogniser is trained on captured clips. Every channel is measured whose values describe how a whole clip
walks (`Channel.manner`); such a value is called a manner.
"""

from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="manners",
    package=__name__,
    inputs=("weights", "clips", "summaries"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    people=True,
    cost=Cost(memory_each=36, seconds_each=0.4, minutes=30),
)
