"""The terrain of one clip: heights at the trajectory's sample points under each cycle, for each of its fits."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.motion.root import RootFrames, root_frames
from hobble.terrain.feet import Feet, feet_of
from hobble.terrain.ground import Ground, fit_cycle
from hobble.terrain.patches import Patches
from hobble.terrain.picture import Picture, picture_cycles, picture_of

log = logging.getLogger("hobble.terrain")


@dataclass(frozen=True)
class ClipFits:
    """The fits of C cycles, R rows in all; row r has fits[r] = K fits, whose heights lie together.

    frame, cycle, fits: (R,). heights: (sum of fits, 36): to the left, centre, to the right of 12 samples, cm in
    the clip's world. patch, error: (C, 10); -1 and 0 on flat ground. foot_error: (C, 10, 2) mean and largest distance of a foot in
    contact from its ground. foot_below: (C, 10) how far the lowest foot is below the ground, contact or
    not, 0 where none is. heel_height, toe_height: of the joints above their soles.
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
    pictures: tuple[Picture, ...] = field(default=(), repr=False)


def clip_fits(
    clip: Clip,
    labels: Mapping[str, Array],
    patches: Patches,
    ground: str,
    options: Mapping[str, Any],
    database: Mapping[str, Any],
) -> ClipFits:
    """Fit the ground under every cycle of a clip.

    labels: `contacts` (F, 4) and `cycles` (C, 2). ground: "flat", "rocky", "jumpy" or "beam". options, database:
    those sections of the data set. Raises InputError where the labels do not belong to the clip.
    """
    cycles, contacts = np.asarray(labels["cycles"], int), np.asarray(labels["contacts"], bool)
    window, step = database["window"], database["step"]
    _check(clip, cycles, contacts, window)
    if len(patches) < options["fits"]:
        raise InputError(
            "terrain.patches",
            f"{len(patches)} patches are fewer than the {options['fits']} fits of a cycle",
        )
    counted = np.zeros(len(clip), bool)
    for start, end in cycles:
        counted[start - window : end + window] = True
    names = ("heel_height", "toe_height", "sole", "deepest")
    feet = feet_of(
        clip, contacts, np.flatnonzero(counted), ground == "flat", **{n: options[n] for n in names}
    )
    root = root_frames(clip, database["facing_sigma"])
    offsets = np.arange(-window, window, step)
    if ground == "flat":
        return _flat(cycles, feet, offsets, options["fits"], window)
    return _fitted(clip, cycles, feet, root, offsets, patches, ground, options, database)


def _fitted(
    clip: Clip,
    cycles: np.ndarray,
    feet: Feet,
    root: RootFrames,
    offsets: np.ndarray,
    patches: Patches,
    kind: str,
    options: Mapping[str, Any],
    database: Mapping[str, Any],
) -> ClipFits:
    window, fits = database["window"], options["fits"]
    samples = sample_points(root, database["terrain_side"])
    left = samples[0] - samples[1]
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    heights, errors, chosen, accuracy, below, pictures = [], [], [], [], [], []
    shown = picture_cycles(len(cycles))
    for c, (start, end) in enumerate(cycles):
        around = slice(start - window, end + window)
        soles, contacts = feet.soles[around], feet.contacts[around]
        if not contacts.any():
            log.warning("%s: no foot stands in frames %d to %d; the lowest count", clip.name, start, end)
            contacts = soles[..., 1] <= np.quantile(soles[..., 1], 0.05)
        ground = fit_cycle(
            patches,
            soles,
            contacts,
            root.position[around],
            left[around],
            kind,
            fits=fits,
            smoothing=options["smoothing"],
            deepest=options["deepest"],
        )
        heights.append(_heights(ground, samples, start, end, offsets))
        distance = ground.at(soles[..., [0, 2]].reshape(-1, 2)) - soles[..., 1].ravel()
        accuracy.append(_foot_error(distance[:, contacts.ravel()]))
        below.append(np.maximum(distance.max(axis=1), 0))
        chosen.append(ground.chosen)
        errors.append(ground.error)
        if c in shown:
            pictures.append(picture_of(clip, c, ground, feet, around))
    frame, cycle = _rows(cycles)
    samples_in_row = 3 * len(offsets)
    return ClipFits(
        frame,
        cycle,
        np.full(len(frame), fits, np.int32),
        np.concatenate([np.zeros((0, samples_in_row)), *heights]).astype(np.float32),
        np.array(chosen, np.int32).reshape(-1, fits),
        np.array(errors, np.float32).reshape(-1, fits),
        np.array(accuracy, np.float32).reshape(-1, fits, 2),
        np.array(below, np.float32).reshape(-1, fits),
        feet.heel_height,
        feet.toe_height,
        tuple(pictures),
    )


def _flat(cycles: np.ndarray, feet: Feet, offsets: np.ndarray, fits: int, window: int) -> ClipFits:
    """Flat ground lies at zero: one fit, that counts as often as the others' ten."""
    accuracy, below = np.zeros((len(cycles), fits, 2)), np.zeros((len(cycles), fits))
    for c, (start, end) in enumerate(cycles):
        around = slice(start - window, end + window)
        height, contacts = feet.soles[around][..., 1], feet.contacts[around]
        if contacts.any():
            accuracy[c] = _foot_error(-height[contacts][None])
        below[c] = max(-height.min(), 0)
    frame, cycle = _rows(cycles)
    return ClipFits(
        frame,
        cycle,
        np.ones(len(frame), np.int32),
        np.zeros((len(frame), 3 * len(offsets)), np.float32),
        np.full((len(cycles), fits), -1, np.int32),
        np.zeros((len(cycles), fits), np.float32),
        accuracy.astype(np.float32),
        below.astype(np.float32),
        feet.heel_height,
        feet.toe_height,
    )


def sample_points(root: RootFrames, side: float) -> Array:
    """(3, F, 2) x and z of the points `side` cm to the left of the root, at it, and to the right of it."""
    left = root.direction[:, [2, 0]] * np.array([1.0, -1.0])
    return np.stack([root.position + side * left, root.position, root.position - side * left])


def _heights(ground: Ground, samples: Array, start: int, end: int, offsets: np.ndarray) -> Array:
    """(rows of the cycle times fits, 3 times samples); every point of the path is looked at once."""
    first, last = start + offsets[0], end + offsets[-1]
    points = samples[:, first : last + 1]
    heights = ground.at(points.reshape(-1, 2)).reshape(-1, 3, points.shape[1])
    at = np.arange(start, end + 1)[:, None] + offsets - first
    return np.moveaxis(heights[:, :, at], 2, 0).reshape(-1, 3 * len(offsets))


def _foot_error(distance: Array) -> Array:
    """Mean and largest distance (K, 2) of (K, N) signed distances."""
    size = np.abs(distance)
    return np.stack([size.mean(axis=1), size.max(axis=1)], axis=-1)


def _rows(cycles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    frames = [np.arange(start, end + 1) for start, end in cycles]
    numbers = [np.full(len(f), c) for c, f in enumerate(frames)]
    nothing = np.zeros(0, int)
    return (
        np.concatenate([nothing, *frames]).astype(np.int32),
        np.concatenate([nothing, *numbers]).astype(np.int32),
    )


def _check(clip: Clip, cycles: np.ndarray, contacts: Array, window: int) -> None:
    if contacts.shape != (len(clip), 4):
        raise InputError(
            clip.name,
            f"labels have contacts of shape {contacts.shape} for {len(clip)} frames",
            fix="Make both again from the same clip.",
        )
    for start, end in cycles:
        if not window <= start < end < len(clip) - window:
            raise InputError(
                clip.name,
                f"the cycle of frames {start} to {end} has no {window} frames to each side",
                frame=int(start),
            )


def save_fits(path: str | Path, fits: ClipFits) -> None:
    """Write the fits as one npz; what a picture needs is stacked under names that begin with `picture_`."""
    arrays = {f.name: np.asarray(getattr(fits, f.name)) for f in fields(fits) if f.name != "pictures"}
    for k, picture in enumerate(fits.pictures):
        arrays |= {f"picture{k}_{f.name}": np.asarray(getattr(picture, f.name)) for f in fields(picture)}
    save_npz(path, **arrays, pictures=np.array(len(fits.pictures)))
