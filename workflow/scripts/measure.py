"""Creates the results of one measurement: <measure>.json and CSV tables."""

from hobble.core.files import write_json, write_tables
from hobble.workflow.job import job, measure_inputs, measure_of

with job(snakemake) as log:
    measure = measure_of(snakemake)
    options = measure.options.model_validate(snakemake.params.options)
    outcome = measure.runner().run(measure_inputs(snakemake), options)
    write_json(snakemake.output.json, outcome.result)
    write_tables(snakemake.output.tables, outcome.tables)
    log.info("%s", outcome.log_line)
