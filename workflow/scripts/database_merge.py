"""Creates the database and its statistics from the rows of all clips, or from its shards."""

from pathlib import Path

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.database.merge import merge_shards, write_database
from hobble.database.options import Merging
from hobble.database.split_check import refuse_split_pairs
from hobble.motion.duplicates import digest, load_digests, same_pairs
from hobble.workflow.job import job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    database, shards = Path(snakemake.output.database), [Path(s) for s in snakemake.input.get("shards", [])]
    files = zip(snakemake.input.compared, snakemake.input.reports, strict=True)
    digests = [digest(load_clip(clip), read_json(report)["sha256"]) for clip, report in files]
    digests += [one for shard in shards for one in load_digests(shard / "likenesses.npz")]
    refuse_split_pairs(f"data set {snakemake.params.dataset}", same_pairs(digests), snakemake.params.splits)
    if shards:
        manifest = merge_shards(database, shards, joint_weight=options.joint_weight, dtype=options.dtype)
    else:
        manifest = write_database(
            database,
            {Path(file).stem: file for file in snakemake.input.clips},
            snakemake.params.splits,
            channels=snakemake.params.channels,
            sources=snakemake.params.sources,
            every=snakemake.params.every,
            joint_weight=options.joint_weight,
            dtype=options.dtype,
            seed=options.seed,
        )
    part = manifest.bytes / manifest.original_bytes
    rows = {split: manifest.row_count(split) for split in manifest.chunks}
    log.info("%s rows, %d bytes: %.1f%% of the original layout", rows, manifest.bytes, 100 * part)
