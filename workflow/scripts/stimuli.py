"""Creates results/<configuration>/stimuli/: loops of the character for each channel, as WebP and BVH."""

from hobble.models.load import load_network
from hobble.report.stimuli import loop_warnings, write_stimuli
from hobble.runtime.options import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    loops = write_stimuli(
        load_network(snakemake.input.weights),
        snakemake.output.folder,
        Runtime.model_validate(snakemake.params.runtime),
    )
    for warning in loop_warnings(loops):
        log.warning("%s", warning)
    log.info("wrote %d loops to %s", len(loops), snakemake.output.folder)
