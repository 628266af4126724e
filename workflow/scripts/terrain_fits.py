"""Finds the patches of ground that fit best under each gait cycle of clips."""

import functools

from hobble.core.clip import load_clip
from hobble.labels.clip_labels import load_labels
from hobble.terrain import FitOptions, HeightSampling
from hobble.terrain.clip_fits import clip_fits, save_fits
from hobble.terrain.patches import load_patches
from hobble.workflow.job import make_each

read_patches = functools.cache(load_patches)  # all clips of the job use the same file


def make_fits(piece, log):
    """Write the patches of ground that fit under a clip.

    piece: the clip or mirror with its params and files, a `Piece`.
    """
    fits = clip_fits(
        load_clip(piece.input["clip"]),
        vars(load_labels(piece.input["labels"])),
        read_patches(piece.input["patches"]),
        piece.params["ground"],
        FitOptions.model_validate(piece.params["options"]),
        HeightSampling.model_validate(piece.params["sampling"]),
    )
    save_fits(piece.output["fits"], fits)
    log.info("%d rows in %d cycles, %d fits", len(fits.frame), len(fits.patch), len(fits.heights))


make_each(
    snakemake,
    make_fits,
    reads={"clip": "motion/{clip}.npz", "labels": "labels/{clip}.npz"},
    writes={"fits": "terrain/clips/{clip}.npz"},
)
