"""Creates <measure>.json and its CSV tables from the inputs of the measurement."""

import importlib
from pathlib import Path

from hobble.core.files import write_json
from hobble.evaluation.csv_tables import write_tables
from hobble.measures.given import Given
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    # Imported by name, so that adding another measurement does not re-run this one.
    measure = importlib.import_module(snakemake.params.package).MEASURE
    files = {need: Path(file) for need, file in snakemake.input.items() if need not in ("clips", "facts")}
    given = Given(
        snakemake.params.configuration,
        files,
        {Path(file).stem: Path(file) for file in snakemake.input.get("clips", ())},
        snakemake.params.splits,
        snakemake.params.people,
        [Path(file) for file in snakemake.input.get("facts", ())],
        Runtime.model_validate(snakemake.params.runtime),
    )
    found = measure.part("run").run(given, measure.options.model_validate(snakemake.params.options))
    write_json(snakemake.output.json, found.result)
    write_tables(snakemake.output.tables, found.tables)
    log.info("%s", found.says)
