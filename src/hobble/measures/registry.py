"""The measurements there are, in the order in which they are run and shown."""

from __future__ import annotations

from hobble.channels.injury import recognition, response
from hobble.measures import accuracy, responsivity, rollouts
from hobble.measures.measure import Measure

MEASURES: tuple[Measure, ...] = (
    accuracy.MEASURE,
    rollouts.MEASURE,
    responsivity.MEASURE,
    response.MEASURE,
    recognition.MEASURE,
)


def measure(name: str) -> Measure:
    """The measurement `name`."""
    return next(one for one in MEASURES if one.name == name)


def modules(part: str) -> list[str]:
    """Full names of the modules `part` of all measurements that have one."""
    return [one.module(part) for one in MEASURES if one.has(part)]
