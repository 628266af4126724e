"""The list of all measurements. See `hobble.measures.measure` for what a measurement is."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Iterator

from hobble import channels
from hobble.measures import accuracy, manners, responsivity, rollouts
from hobble.measures.measure import Measure


def channel_measures() -> Iterator[Measure]:
    """The measurements that channels add: those listed in `hobble.channels.<name>.measures`, if it exists."""
    for name in channels.CHANNEL_NAMES:
        module = f"hobble.channels.{name}.measures"
        if importlib.util.find_spec(module) is not None:
            yield from importlib.import_module(module).MEASURES


MEASURES: tuple[Measure, ...] = (
    accuracy.MEASURE,
    rollouts.MEASURE,
    responsivity.MEASURE,
    manners.MEASURE,
    *channel_measures(),
)


def measure_named(name: str) -> Measure:
    """The measurement with this name. Raises StopIteration if there is none."""
    return next(entry for entry in MEASURES if entry.name == name)


def names_of_modules(part: str) -> list[str]:
    """Full names of the modules called `part` in the packages of measurements.

    For "page" they include "hobble.measures.accuracy.page". A package without such a module is left out.
    """
    return [entry.module_name(part) for entry in MEASURES if entry.has_module(part)]
