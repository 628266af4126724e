"""Finds a job's measurement and its inputs, for the scripts of the rules `measure` and `measure_piece`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from hobble.measures.inputs import MeasureInputs
from hobble.measures.measure import Measure
from hobble.runtime.options import Runtime

LISTS = ("clips", "summaries", "pieces")  # inputs of several files


def measure_of(job: Any) -> Measure:
    """The job's measurement. It is imported by name, so that a new measurement does not re-run the others."""
    return importlib.import_module(job.params.package).MEASURE


def inputs_of_job(job: Any) -> MeasureInputs:
    """The inputs of a job of the rules `measure` and `measure_piece`."""
    many = {name: [Path(file) for file in job.input.get(name, ())] for name in LISTS}
    return MeasureInputs(
        job.params.configuration,
        {need: Path(file) for need, file in job.input.items() if need not in LISTS},
        {path.stem: path for path in many["clips"]},
        job.params.splits,
        job.params.people,
        many["summaries"],
        Runtime.model_validate(job.params.runtime),
        {path.stem: path for path in many["pieces"]},
    )
