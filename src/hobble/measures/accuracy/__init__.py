"""One-step accuracy of every clip, training and held-out."""

from hobble.measures.joints import Joints
from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions


class Options(Joints, SampleOptions):
    """Its keys of the section `evaluation`."""


MEASURE = Measure(
    name="accuracy",
    package=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    cost=Cost(memory_each=12, seconds_each=0.2, minutes=10),
)
