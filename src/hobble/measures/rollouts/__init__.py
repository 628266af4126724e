"""Measures the errors of roll-outs. In a roll-out, the network continues from its own poses."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from hobble.core.section import Positive
from hobble.measures.joints import JointOptions
from hobble.measures.measure import Cost, Measure
from hobble.measures.sample_options import SampleOptions


def _require_lengths(lengths: tuple[int, ...]) -> tuple[int, ...]:
    """Returns `lengths`. Raises ValueError if it is empty."""
    if not lengths:
        raise ValueError("must name at least one number of frames")
    return lengths


class Options(JointOptions, SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""

    rollouts: Annotated[tuple[Positive, ...], AfterValidator(_require_lengths)] = Field(
        (1, 10, 60, 300), description="lengths of roll-outs, in frames"
    )


MEASURE = Measure(
    name="rollouts",
    package=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    runtime=("mode",),
    cost=Cost(memory_mb=120, mb_per_1000_frames=27, seconds_per_1000_frames=0.6, least_minutes=30),
)
