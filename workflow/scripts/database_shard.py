"""Scatters the rows of some clips over the parts of the database, and notes what the merge needs of them."""

from pathlib import Path

from hobble.core.clip import load_clip
from hobble.core.files import read_json
from hobble.database.options import Merging
from hobble.database.parts import write_shard
from hobble.motion.duplicates import likeness, save_likenesses
from hobble.workflow.datasets import shard_of
from hobble.workflow.job import job

with job(snakemake) as log:
    options = Merging.model_validate(snakemake.params.options)
    clips = {Path(file).stem: Path(file) for file in snakemake.input.clips}
    own = shard_of(list(clips), snakemake.params.number, snakemake.params.parts)
    write_shard(
        Path(snakemake.output.shard),
        clips,
        own,
        snakemake.params.splits,
        parts=snakemake.params.parts,
        channels=snakemake.params.channels,
        sources=snakemake.params.sources,
        dtype=options.dtype,
        seed=options.seed,
    )
    files = zip(snakemake.input.compared, snakemake.input.reports, strict=True)
    like = [likeness(load_clip(clip), read_json(report)["sha256"]) for clip, report in files]
    save_likenesses(Path(snakemake.output.shard, "likenesses.npz"), like)
    log.info("%d of %d clips", len(own), len(clips))
