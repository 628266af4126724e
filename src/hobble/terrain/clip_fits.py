"""Fits the ground under each gait cycle of a clip, and looks up its heights along the trajectory.

A fit is a patch of ground that suits the footsteps of a cycle, corrected so that it meets the feet. A cycle
gets several fits, or one if its ground is flat.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, load_declared
from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, Arrays, save_npz
from hobble.core.quat import Array
from hobble.motion.root import RootFrames, extend_root, root_frames
from hobble.terrain import FitOptions, HeightSampling
from hobble.terrain.cycle_ground import (
    CycleGround,
    Feet,
    Mask,
    find_soles,
    fit_cycle,
    flat_ground,
    is_above_other_joint,
)
from hobble.terrain.heightmaps import MAX_HEIGHT
from hobble.terrain.patches import Patches

log = logging.getLogger("hobble.terrain")


@dataclass(frozen=True)
class ClipFits:
    """The terrain fits of a clip with C cycles and R rows. A row is a frame of a cycle.

    frame, cycle, fits: (R,) the row's frame, the number of its cycle, and how many fits it has.
    heights: (sum of `fits`, 36) heights of the ground, cm, in the clip's world. There is a line for each fit
    of each row. The lines of a row are consecutive. A line has 12 points to the left of the path, then 12 on
    the path, then 12 to its right.
    patch, error: (C, K) index of each fit's patch, and the fit's error, cm²; -1 and 0 on flat ground. K is
    the option `fits`. On flat ground the only fit of a cycle is repeated K times.
    foot_error: (C, K, 2) mean and largest distance of a foot in contact from the ground, cm.
    foot_below: (C, K) how far the lowest foot, in contact or not, is below the ground, cm; at least 0.
    heel_height, toe_height: height of these joints above their soles, cm.
    """

    frame: np.ndarray = field(repr=False)
    cycle: np.ndarray = field(repr=False)
    fits: np.ndarray = field(repr=False)
    heights: Array = field(repr=False)
    patch: np.ndarray = field(repr=False)
    error: Array = field(repr=False)
    foot_error: Array = field(repr=False)
    foot_below: Array = field(repr=False)
    heel_height: float
    toe_height: float


def clip_fits(
    clip: Clip,
    labels: Mapping[str, Array],
    patches: Patches,
    ground: str,
    options: FitOptions,
    sampling: HeightSampling,
) -> ClipFits:
    """Fit the ground under every cycle of a clip.

    labels: `contacts` (F, 4) bool, and `cycles` (C, 2), the first and last frame of each cycle. ground:
    "flat", "rocky", "jumpy" or "beam".
    """
    cycles, contacts = np.asarray(labels["cycles"], int), np.asarray(labels["contacts"], bool)
    window = sampling.window
    root = extend_root(root_frames(clip, sampling.facing_sigma), window)
    samples = sample_points(root, sampling.terrain_side)
    # The frames that the ground is fitted to: those of a cycle, and `window` frames before and after it.
    spans = [slice(max(start - window, 0), min(end + window + 1, len(clip))) for start, end in cycles]
    feet = _standing_feet(clip, contacts, spans, ground == "flat", options)
    offsets = np.arange(-window, window, sampling.step)
    heights: list[Array] = [np.zeros((0, 3 * len(offsets)))]
    fitted = []
    for (start, end), around in zip(cycles, spans, strict=True):
        soles, standing = feet.soles[around], feet.contacts[around]
        if ground == "flat":
            fit = flat_ground(soles, standing, options)
        else:
            beside = samples[:, window:-window][:, around]  # `samples` go on before and after the clip
            fit = fit_cycle(patches, soles, standing, beside, ground, options)
        heights.append(heights_under(fit, samples, start + window, end + window, offsets))
        fitted.append((fit, soles, standing))
    frame, cycle = cycle_frames(cycles)
    return ClipFits(
        frame=frame,
        cycle=cycle,
        fits=np.array([len(fit.chosen) for fit, _, _ in fitted], np.int32)[cycle],
        heights=np.concatenate(heights).astype(np.float32),
        **_fit_statistics(fitted, options.fits),
        heel_height=feet.heel_height,
        toe_height=feet.toe_height,
    )


def _standing_feet(
    clip: Clip, contacts: Mask, spans: Sequence[slice], flat: bool, options: FitOptions
) -> Feet:
    """The soles of a clip, and which of them stand on the ground.

    On flat ground, a joint in contact does not count as standing if the other joint of its foot is in
    contact, too, and more than `options.held_up` cm lower. spans: the frames of each cycle with those around
    it. If no joint is in contact in them, the lowest 5 % of the sole positions count as standing.
    """
    counted = np.zeros(len(clip), bool)
    for around in spans:
        counted[around] = True
    feet = find_soles(clip, contacts, np.flatnonzero(counted), flat, options)
    contacts = feet.contacts.copy()
    if flat and options.held_up is not None:
        contacts &= ~is_above_other_joint(feet, options.held_up)
    for around in spans:
        if not contacts[around].any():
            text = "%s: no contact in frames %d to %d; the lowest positions of the feet count as contacts"
            log.warning(text, clip.name, around.start, around.stop)
            height = feet.soles[around][..., 1]
            contacts[around] = height <= np.quantile(height, 0.05)
    return replace(feet, contacts=contacts)


def _fit_statistics(fitted: Sequence[tuple[CycleGround, Array, Mask]], fits: int) -> dict[str, Any]:
    """The fields patch, error, foot_error and foot_below of `ClipFits`.

    fitted: for each cycle, its ground, and the soles and contacts in its frames and window. fits: number of
    fits of a cycle. The only fit of a cycle on flat ground is repeated this many times.
    """
    patch, error = np.zeros((len(fitted), fits), np.int32), np.zeros((len(fitted), fits), np.float32)
    foot_error, foot_below = np.zeros((*error.shape, 2), np.float32), np.zeros_like(error)
    for c, (ground, soles, contacts) in enumerate(fitted):
        above = ground.height_above_soles(soles)
        distance = np.abs(above[:, contacts])
        patch[c], error[c] = ground.chosen, ground.error
        foot_error[c] = np.stack([distance.mean(axis=1), distance.max(axis=1)], axis=-1)
        foot_below[c] = np.maximum(above.max(axis=(1, 2)), 0)
    return {"patch": patch, "error": error, "foot_error": foot_error, "foot_below": foot_below}


def sample_points(root: RootFrames, side: float) -> Array:
    """(3, F, 2) x and z of the points `side` cm to the left of the root, at the root, and to its right."""
    left = root.direction[:, [2, 0]] * np.array([1.0, -1.0])
    return np.stack([root.position + side * left, root.position, root.position - side * left])


def heights_under(ground: CycleGround, samples: Array, start: int, end: int, offsets: np.ndarray) -> Array:
    """CycleGround heights (rows * fits, 3 * len(offsets)), cm, for the rows of one cycle, as in `ClipFits`.

    Neighbouring rows share points. Each point is looked up only once.

    samples: (3, F, 2) from `sample_points`. start, end: first and last frame of the cycle, as indices into
    axis 1 of `samples`. offsets: frames of the points of a row, relative to the row's frame.
    """
    first, last = start + offsets[0], end + offsets[-1]
    points = samples[:, first : last + 1]
    heights = ground.heights_at(points.reshape(-1, 2)).reshape(-1, 3, points.shape[1])
    point_of_row = np.arange(start, end + 1)[:, None] + offsets - first
    return np.moveaxis(heights[:, :, point_of_row], 2, 0).reshape(-1, 3 * len(offsets))


def cycle_frames(cycles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The frame of the clip (R,) and the number of the cycle (R,) of each row, int32.

    cycles: (C, 2) first and last frame of each cycle. Both belong to the cycle. So a frame in which one cycle
    ends and the next begins has two rows.

    >>> [each.tolist() for each in cycle_frames(np.array([[60, 62], [62, 63]]))]
    [[60, 61, 62, 62, 63], [0, 0, 0, 1, 1]]
    """
    lengths = cycles[:, 1] - cycles[:, 0] + 1
    cycle = np.repeat(np.arange(len(cycles)), lengths)
    frame_in_cycle = np.arange(len(cycle)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    frame = np.repeat(cycles[:, 0], lengths) + frame_in_cycle
    return frame.astype(np.int32), cycle.astype(np.int32)


def save_fits(path: str | Path, fits: ClipFits) -> None:
    """Write the fits as one npz file."""
    save_npz(path, **{f.name: np.asarray(getattr(fits, f.name)) for f in fields(fits)})


# What a file of fits holds for C cycles with K fits and R rows.
DECLARED = {
    **{name: ArrayOf(("R",), "iu", 0) for name in ("frame", "cycle")},
    "fits": ArrayOf(("R",), "iu", 1),
    "heights": ArrayOf(("lines", "columns"), low=-MAX_HEIGHT, high=MAX_HEIGHT),
    "patch": ArrayOf(("C", "K"), "iu", -1),
    "error": ArrayOf(("C", "K"), low=0),
    "foot_error": ArrayOf(("C", "K", 2), low=0),
    "foot_below": ArrayOf(("C", "K"), low=0),
    **{name: ArrayOf((), "f") for name in ("heel_height", "toe_height")},
}


def load_fits(path: str | Path) -> Arrays:
    """The arrays that `save_fits` wrote. Raises InputError if one is not as it should be."""
    data = load_declared(path, DECLARED)
    cycles, fits = data["patch"].shape
    if data["fits"].sum() != len(data["heights"]) or data["cycle"].max(initial=-1) >= cycles or not fits:
        raise InputError(path, "its heights are not those of its cycles", fix=DELETE_IT)
    return data
