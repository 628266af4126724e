"""Creates results/<configuration>/stimuli/: loops of the character for each channel, as WebP and BVH."""

from hobble.models.load import load_network
from hobble.report.stimuli import film_warnings, write_stimuli
from hobble.runtime import Runtime
from hobble.workflow.job import job

with job(snakemake) as log:
    loops = write_stimuli(
        load_network(snakemake.input.weights),
        snakemake.output.folder,
        Runtime.model_validate(snakemake.params.runtime),
    )
    told = [loop for loop in loops if loop["values"]]
    for warning in film_warnings((each["name"], each["from_plain_cm"], each["untrained"]) for each in told):
        log.warning("%s", warning)
    log.info("wrote %d loops to %s", len(loops), snakemake.output.folder)
