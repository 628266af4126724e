"""Generates the motion of each scripted scenario (npz and BVH) with a trained network."""

from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.runtime.generated import generate_scenarios
from hobble.workflow.job import job

with job(snakemake) as log:
    generate_scenarios(
        load_network(snakemake.input.weights),
        snakemake.output.scenarios,
        snakemake.output.bvh,
        Runtime.model_validate(snakemake.params.runtime),
    )
    log.info("wrote %s and %s", snakemake.output.scenarios, snakemake.output.bvh)
