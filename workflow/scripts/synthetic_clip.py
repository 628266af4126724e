"""Creates one clip of the embedded data set (BVH, footsteps, gait) from its recipe and a skeleton."""

from pathlib import Path

from hobble.core.untrusted import read_yaml
from hobble.synthetic.clip import write_clip
from hobble.synthetic.options import Synthetic
from hobble.workflow.job import job

with job(snakemake):
    source = Path(snakemake.input.skeleton)
    write_clip(
        snakemake.params.clip,
        {"name": source.stem, **read_yaml(source)},
        snakemake.params.frames,
        snakemake.params.recipe,
        Synthetic.model_validate(snakemake.params.options),
        bvh=snakemake.output.bvh,
        footsteps=snakemake.output.footsteps,
        gait=snakemake.output.gait,
    )
