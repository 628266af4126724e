"""The list of measurements, in the order in which they run and are shown."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Iterator

from hobble import channels
from hobble.measures import accuracy, manners, responsivity, rollouts
from hobble.measures.measure import Measure


def of_channels() -> Iterator[Measure]:
    """The measurements of each channel that has a module `measures`."""
    for name in channels.NAMES:
        module = f"hobble.channels.{name}.measures"
        if importlib.util.find_spec(module) is not None:
            yield from importlib.import_module(module).MEASURES


MEASURES: tuple[Measure, ...] = (
    accuracy.MEASURE,
    rollouts.MEASURE,
    responsivity.MEASURE,
    manners.MEASURE,
    *of_channels(),
)


def measure(name: str) -> Measure:
    """The measurement `name`."""
    return next(one for one in MEASURES if one.name == name)


def modules(part: str) -> list[str]:
    """Full name of the module `part`, such as `page`, of each measurement that has it."""
    return [one.module(part) for one in MEASURES if one.has(part)]
