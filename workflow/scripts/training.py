"""Creates a configuration's network weights, training history and last checkpoint from its database."""

from pathlib import Path

from hobble.models import network_options
from hobble.training.options import Training
from hobble.training.run import run
from hobble.workflow.job import job

with job(snakemake):
    run(
        Path(snakemake.input.database),
        configuration=snakemake.params.configuration,
        network=network_options(snakemake.params.network),
        training=Training.model_validate(snakemake.params.training),
        checkpoints=Path(snakemake.params.checkpoints),
        threads=snakemake.threads,
        start=Path(snakemake.input.checkpoint[0]) if snakemake.input.checkpoint else None,
        code=snakemake.params.get("code"),
        weights=Path(snakemake.output.weights),
        history=Path(snakemake.output.history),
        checkpoint=Path(snakemake.output.checkpoint),
        terrain_side=snakemake.params.terrain_side,
    )
