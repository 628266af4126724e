"""Creates patches of ground, cut from random places of a data set's heightmaps."""

from hobble.terrain import PatchOptions
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.patches import draw_patches, save_patches
from hobble.workflow.job import job

with job(snakemake) as log:
    options = PatchOptions.model_validate(snakemake.params.options)
    maps = heightmaps(options.heightmaps, snakemake.input.get("files", []), cell=options.cell)
    patches = draw_patches(
        maps,
        count=options.patches,
        cell=options.cell,
        size=options.size,
        highest=options.highest,
        seed=options.seed,
    )
    save_patches(snakemake.output.patches, patches)
    log.info("%d patches of %d heightmaps", len(patches), len(maps))
