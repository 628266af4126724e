"""Creates results/<configuration>/stimuli/: loops of the character for each channel, as WebP and BVH."""

from hobble.models.load import load_network
from hobble.report.stimuli import doubts, write_stimuli
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    loops = write_stimuli(
        load_network(snakemake.input.weights),
        snakemake.output.folder,
        Runtime.model_validate(snakemake.params.runtime),
    )
    for doubt in doubts(loops):
        log.warning("%s", doubt)
    log.info("wrote %d loops to %s", len(loops), snakemake.output.folder)
