"""Creates the shuffled, chunked database and its statistics from the rows of all clips."""

from pathlib import Path

from hobble.database.merge import write_database
from hobble.database.options import Merging
from hobble.workflow.job import job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    manifest = write_database(
        snakemake.output.database,
        {Path(file).stem: file for file in snakemake.input.clips},
        snakemake.params.splits,
        channels=snakemake.params.channels,
        sources=snakemake.params.sources,
        joint_weight=options.joint_weight,
        dtype=options.dtype,
        seed=options.seed,
    )
    part = manifest.bytes / manifest.original_bytes
    rows = {split: manifest.rows(split) for split in manifest.chunks}
    log.info("%s rows, %d bytes: %.1f%% of the original layout", rows, manifest.bytes, 100 * part)
