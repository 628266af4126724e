"""Measures whether moods and diagnoses can be recognised in generated walks, and how they change the walk.

The recogniser is trained on captured clips. A mood or diagnosis is called a manner: a way of walking that
holds for a whole clip. A channel is a group of inputs of the network, such as moods, with a column for each
mood. The measurement covers all channels whose columns are manners (`Channel.manner`).
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
    # For each thousand frames: 36 MB and 0.4 s. At least 30 minutes.
    cost=Cost(mb_per_1000_frames=36, seconds_per_1000_frames=0.4, least_minutes=30),
)
