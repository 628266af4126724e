"""Creates the shuffled database in chunks, and its statistics, from the rows of all clips."""

from pathlib import Path

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.database.merge import write_database
from hobble.database.options import Merging
from hobble.database.sides import refuse_both_sides
from hobble.motion.same import likeness, same_pairs
from hobble.workflow.job import job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    files = zip(snakemake.input.compared, snakemake.input.reports, strict=True)
    like = [likeness(load_clip(clip), read_json(report)["sha256"]) for clip, report in files]
    refuse_both_sides(f"data set {snakemake.params.dataset}", same_pairs(like), snakemake.params.splits)
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
