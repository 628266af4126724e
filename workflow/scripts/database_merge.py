"""Creates the database from the rows of all clips.

It is refused if a clip in training and a held-out clip show the same motion.
"""

from pathlib import Path

from hobble.core.clip import load_clip, load_clip_report
from hobble.database import Merging
from hobble.database.write import refuse_split_pairs, write_database
from hobble.motion.duplicates import clip_digest, duplicate_pairs
from hobble.workflow.job import Inputs, job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    database = Path(snakemake.output.database)
    # A digest holds what is compared of a clip: a few poses and the checksum of its file.
    files = Inputs(snakemake.input.batches)
    digests = [
        clip_digest(
            load_clip(files(f"motion/{clip}.npz")), load_clip_report(files(f"motion/{clip}.json"))["sha256"]
        )
        for clip in snakemake.params.compared
    ]
    refuse_split_pairs(
        f"data set {snakemake.params.dataset}", duplicate_pairs(digests), snakemake.params.splits
    )
    manifest = write_database(
        database,
        files.each("database/clips/{clip}.npz", snakemake.params.splits),
        snakemake.params.splits,
        channels=snakemake.params.channels,
        local_phases=snakemake.params.local_phases,
        sources=snakemake.params.sources,
        hurt_every=snakemake.params.hurt_every,
        every=options.every,
        joint_weight=options.joint_weight,
        dtype=options.dtype,
        seed=options.seed,
    )
    share = manifest.bytes / manifest.original_bytes
    rows = {split: manifest.row_count(split) for split in manifest.chunks}
    log.info(
        "%s rows, %d bytes: %.1f%% of the layout of Holden et al. (2017)", rows, manifest.bytes, 100 * share
    )
