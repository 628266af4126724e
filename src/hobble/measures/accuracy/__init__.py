"""One-step accuracy of every clip, training and held-out."""

from hobble.measures.joints import Joints
from hobble.measures.measure import Cost, Measure

MEASURE = Measure(
    name="accuracy",
    package=__name__,
    inputs=("weights", "clips", "skeleton"),
    options=Joints,
    cost=Cost(memory_each=12, seconds_each=0.2, minutes=10),
)
