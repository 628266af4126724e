"""Compares the response to injury of several configurations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hobble.evaluation.comparison_rows import SideBySide
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.inputs import Json

NAME = "injury"  # the measurement
KEPT = ("applies", "reason", "summary")  # keys of injury.json that are compared


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> SideBySide:
    """For each configuration: whether its character can be hurt, and the means over its links."""
    return SideBySide(entries=[_entry(m) for m in all_measured])


def _entry(measured: ConfigurationResults) -> dict[str, Any]:
    found = measured.found(NAME)
    return {"configuration": measured.name, **{key: found[key] for key in KEPT if key in found}}
