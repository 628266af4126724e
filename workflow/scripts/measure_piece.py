"""Creates the JSON of one piece of a long measurement. The rule `measure` puts the pieces together."""

from hobble.core.files import write_json
from hobble.workflow.job import job, measure_of

with job(snakemake):
    measure, options, inputs = measure_of(snakemake)
    write_json(snakemake.output.json, measure.runner().run_piece(inputs, options, snakemake.params.piece))
