"""Creates results/<configuration>/export/character.glb: the body, its skeleton and the scripted motion."""

from hobble.models.load import load_network
from hobble.runtime.export import export_glb
from hobble.workflow.job import job

with job(snakemake) as log:
    export_glb(snakemake.output.glb, load_network(snakemake.input.weights), snakemake.input.scenarios)
    log.info("wrote %s", snakemake.output.glb)
