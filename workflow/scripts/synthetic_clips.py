"""Creates a clip of a synthetic walker (BVH, footsteps, gait). A recipe says what the walker does."""

from pathlib import Path

from hobble.core.files import read_yaml
from hobble.synthetic.generate_clip import Synthetic, write_clip
from hobble.workflow.job import job

with job(snakemake):
    source, params = Path(snakemake.input.skeleton), snakemake.params
    write_clip(
        params.clip,
        {"name": source.stem, **read_yaml(source)},
        params.frames,
        params.recipe,
        Synthetic.model_validate(params.options),
        bvh=snakemake.output.bvh,
        footsteps=snakemake.output.footsteps,
        gait=snakemake.output.gait,
    )
