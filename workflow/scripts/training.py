"""Creates a configuration's network weights, training history and last checkpoint from its database."""

from pathlib import Path

from hobble.training.run import run
from hobble.workflow.job import job

with job(snakemake):
    run(
        Path(snakemake.input.database),
        configuration=snakemake.params.configuration,
        network=snakemake.params.network,
        training=snakemake.params.training,
        checkpoints=Path(snakemake.params.checkpoints),
        threads=snakemake.threads,
        start=Path(snakemake.input.checkpoint[0]) if snakemake.input.checkpoint else None,
        code=snakemake.params.get("code"),
        weights=Path(snakemake.output.weights),
        history=Path(snakemake.output.history),
        checkpoint=Path(snakemake.output.checkpoint),
    )
