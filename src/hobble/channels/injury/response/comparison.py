"""Compares the response to injury of several configurations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hobble.core.files import Json
from hobble.measures.compare import ComparisonAddition, ConfigurationResults

NAME = "injury"  # the measurement
COMPARED_KEYS = ("applies", "reason", "summary")  # of injury.json


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """Whether the character of each configuration can be hurt, and means over the links hurt in training.

    published: not used; every module `comparison` has a function with these arguments.
    """
    return ComparisonAddition(entries=[_entry(m) for m in all_measured])


def _entry(results: ConfigurationResults) -> dict[str, Any]:
    found = results.results_of(NAME)
    return {"configuration": results.name, **{key: found[key] for key in COMPARED_KEYS if key in found}}
