"""Creates the JSON of one piece of a long measurement. The rule `measure` puts the pieces together."""

from hobble.core.files import write_json
from hobble.workflow.job import job, measure_inputs, measure_of

with job(snakemake):
    measure = measure_of(snakemake)
    options = measure.options.model_validate(snakemake.params.options)
    result = measure.runner().run_piece(measure_inputs(snakemake), options, snakemake.params.piece)
    write_json(snakemake.output.json, result)
