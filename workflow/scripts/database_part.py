"""Puts a stretch of the shuffled rows in order, standardises it and writes its chunks."""

from pathlib import Path

from hobble.database.options import Merging
from hobble.database.parts import write_part
from hobble.workflow.job import job

with job(snakemake):
    options = Merging.model_validate(snakemake.params.options)
    write_part(
        Path(snakemake.output.part),
        [Path(shard) for shard in snakemake.input.shards],
        snakemake.params.number,
        parts=snakemake.params.parts,
        joint_weight=options.joint_weight,
        dtype=options.dtype,
    )
