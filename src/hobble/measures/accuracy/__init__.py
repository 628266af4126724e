"""Measures how well the network predicts the next frame, on training and held-out clips."""

from hobble.measures.joints import Joints
from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions


class Options(Joints, SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""


MEASURE = Measure(
    name="accuracy",
    package=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    cost=Cost(memory_each=12, seconds_each=0.2, minutes=10),
)
