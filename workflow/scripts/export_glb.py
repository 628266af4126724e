"""Creates results/<configuration>/export/character.glb: the body with bones and animations."""

from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.runtime.generated import export_glb
from hobble.workflow.job import job

with job(snakemake) as log:
    network = load_network(snakemake.input.weights)
    runtime = Runtime.model_validate(snakemake.params.runtime)
    export_glb(snakemake.output.glb, network, runtime)
    log.info("wrote %s", snakemake.output.glb)
