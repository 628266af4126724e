"""Creates the terrain under the cycles of one clip from its motion, its labels and the patches."""

from hobble.core.clip import load_clip
from hobble.core.files import load_npz
from hobble.terrain.clip_fits import clip_fits, save_fits
from hobble.terrain.options import Fitting, Sampling
from hobble.terrain.patches import load_patches
from hobble.workflow.job import job

with job(snakemake) as log:
    fits = clip_fits(
        load_clip(snakemake.input.clip),
        load_npz(snakemake.input.labels),
        load_patches(snakemake.input.patches),
        snakemake.params.ground,
        Fitting.model_validate(snakemake.params.options),
        Sampling.model_validate(snakemake.params.sampling),
    )
    save_fits(snakemake.output.fits, fits)
    log.info("%d rows in %d cycles, %d fits", len(fits.frame), len(fits.patch), len(fits.heights))
