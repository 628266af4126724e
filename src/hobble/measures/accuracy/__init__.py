"""Measures how well the network predicts the next frame, on training and held-out clips."""

from hobble.measures.joints import JointOptions
from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions


class Options(JointOptions, SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""


MEASURE = Measure(
    name="accuracy",
    package=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    # For each thousand frames: 12 MB and 0.2 s. At least 10 minutes.
    cost=Cost(mb_per_1000_frames=12, seconds_per_1000_frames=0.2, least_minutes=10),
)
