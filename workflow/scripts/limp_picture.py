"""Creates results/<configuration>/limp.webp: a loop of the healthy and the hurt walk side by side."""

from hobble.measures.films import write_limp_picture
from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    size = write_limp_picture(
        load_network(snakemake.input.weights),
        snakemake.output.picture,
        Runtime.model_validate(snakemake.params.runtime),
    )
    log.info("%d bytes", size)
