"""Creates the terrain under the cycles of clips from their motion, their labels and the patches."""

import functools

from hobble.core.clip import load_clip
from hobble.core.files import load_npz
from hobble.terrain.clip_fits import clip_fits, save_fits
from hobble.terrain.options import FitOptions, HeightSampling
from hobble.terrain.patches import load_patches
from hobble.workflow.batch_job import make_each

patches = functools.cache(load_patches)


def make(piece, log):
    """Fit the ground under a clip."""
    fits = clip_fits(
        load_clip(piece.input["clip"]),
        load_npz(piece.input["labels"]),
        patches(piece.input["patches"]),
        piece.params["ground"],
        FitOptions.model_validate(piece.params["options"]),
        HeightSampling.model_validate(piece.params["sampling"]),
    )
    save_fits(piece.output["fits"], fits)
    log.info("%d rows in %d cycles, %d fits", len(fits.frame), len(fits.patch), len(fits.heights))


make_each(snakemake, make)
