"""Finds a job's measurement and its inputs, for the scripts of the rules `measure` and `measure_piece`.

A job of the rule `measure_piece` does one piece of a long measurement.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from hobble.measures.measure import Measure, MeasureInputs
from hobble.runtime.options import Runtime

LIST_INPUTS = ("clips", "summaries", "pieces")  # names of the inputs that may have several files


def measure_of(job: Any) -> Measure:
    """The job's measurement. job: the object that Snakemake gives to scripts.

    Only this measurement's module is imported. A job runs again if code that its script imports changes. So
    if the script imported all measurements, each new one would make all others run again.
    """
    return importlib.import_module(job.params.module).MEASURE


def inputs_of_job(job: Any) -> MeasureInputs:
    """The inputs of the job's measurement. job: the object that Snakemake gives to scripts."""
    lists = {name: [Path(file) for file in job.input.get(name, ())] for name in LIST_INPUTS}
    return MeasureInputs(
        job.params.configuration,
        {name: Path(file) for name, file in job.input.items() if name not in LIST_INPUTS},
        {path.stem: path for path in lists["clips"]},
        job.params.splits,
        job.params.people,
        lists["summaries"],
        Runtime.model_validate(job.params.runtime),
        {path.stem: path for path in lists["pieces"]},
    )
