"""Creates the results of one measurement: <measure>.json and CSV tables.

Only this measurement's module is imported. A job runs again if code that its script imports changes. So if it
imported all measurements, each new one would make all others run again.
"""

import importlib
from pathlib import Path

from hobble.core.files import write_json, write_tables
from hobble.measures.measure import MeasureInputs
from hobble.runtime import Runtime
from hobble.workflow.job import Inputs, job

with job(snakemake) as log:
    params, files = snakemake.params.measured, dict(snakemake.input.items())
    measure = importlib.import_module(params["module"]).MEASURE
    find = Inputs(files.pop("batches", ()))
    inputs = MeasureInputs(
        params["configuration"],
        {name: Path(file) for name, file in files.items()},
        {clip: Path(find(f"database/clips/{clip}.npz")) for clip in params["splits"]},
        params["splits"],
        params["people"],
        [Path(find(f"database/clips/{clip}.json")) for clip in params["summaries"]],
        Runtime.model_validate(params["runtime"]),
    )
    outcome = measure.runner().run(inputs, measure.options.model_validate(params["options"]))
    write_json(snakemake.output.json, outcome.result)
    write_tables(snakemake.output.tables, outcome.tables)
    log.info("%s", outcome.log_line)
