"""Creates a shard of a database, which holds the rows of some of its clips.

The shard also holds the digests of its clips. By these digests, the rule `database_merge` finds clips
with the same motion.
"""

from pathlib import Path

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.database.options import Merging
from hobble.database.write import write_shard
from hobble.motion.look import clip_digest, save_digests
from hobble.workflow.job import Inputs, job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    shard = Path(snakemake.output.shard)
    files = Inputs(snakemake.input.batches)
    clips = files.each("database/clips/{clip}.npz", snakemake.params.splits)
    write_shard(
        shard,
        clips,
        snakemake.params.splits,
        channels=snakemake.params.channels,
        sources=snakemake.params.sources,
        every=snakemake.params.every,
        joint_weight=options.joint_weight,
        dtype=options.dtype,
        seed=options.seed,
    )
    digests = [
        clip_digest(load_clip(files(f"motion/{clip}.npz")), read_json(files(f"motion/{clip}.json"))["sha256"])
        for clip in snakemake.params.compared
    ]
    save_digests(shard / "likenesses.npz", digests)
    log.info("%d clips", len(clips))
