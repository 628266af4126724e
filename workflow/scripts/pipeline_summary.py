"""Creates results/<configuration>/pipeline.json: the time, memory and disk space that each stage took."""

from hobble.core.files import write_json
from hobble.report.provenance import summarise_pipeline
from hobble.workflow.job import job

with job(snakemake):
    params = snakemake.params
    write_json(snakemake.output.json, summarise_pipeline(params.configuration, params.stages))
