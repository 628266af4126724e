"""Creates the results of one measurement: <measure>.json and CSV tables."""

from hobble.core.files import write_json, write_tables
from hobble.workflow.job import job, measure_of

with job(snakemake) as log:
    measure, options, inputs = measure_of(snakemake)
    outcome = measure.runner().run(inputs, options)
    write_json(snakemake.output.json, outcome.result)
    write_tables(snakemake.output.tables, outcome.tables)
    log.info("%s", outcome.log_line)
