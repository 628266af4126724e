"""Creates <measure>.json and its CSV tables from the inputs of the measurement."""

from hobble.core.files import write_json
from hobble.evaluation.csv_tables import write_tables
from hobble.workflow.job import job
from hobble.workflow.measure_job import inputs_of_job, measure_of

with job(snakemake) as log:
    measure = measure_of(snakemake)
    options = measure.options.model_validate(snakemake.params.options)
    found = measure.import_module("run").run(inputs_of_job(snakemake), options)
    write_json(snakemake.output.json, found.result)
    write_tables(snakemake.output.tables, found.tables)
    log.info("%s", found.log_line)
