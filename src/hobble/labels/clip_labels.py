"""The labels of one clip, their file, and their picture for a page."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, load_declared
from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, save_npz
from hobble.core.quat import Array
from hobble.core.smooth import mean, true_runs

# "bump" is what the label files of Holden et al. (2017) call "unknown"; nobody has published what it means.
GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
CONTACT_ROLES = ("left_heel", "left_toe", "right_heel", "right_toe")


@dataclass(frozen=True)
class Labels:
    """Labels of F frames at 60 Hz.

    contacts: (F, 4) bool, whether each joint of CONTACT_ROLES is on the ground. phase: (F,) position in the
    gait cycle, 0 to 1. phase_known: (F,) bool, False where the phase is only a guess, such as in standing.
    gait: (F, 6) shares of GAITS. footsteps: (N, 3) landings, see `hobble.labels.phase`. cycles: (C, 2) int,
    first and last frame (both included) of each gait cycle that is used.
    """

    contacts: np.ndarray = field(repr=False)
    phase: Array = field(repr=False)
    phase_known: np.ndarray = field(repr=False)
    gait: Array = field(repr=False)
    footsteps: Array = field(repr=False)
    cycles: np.ndarray = field(repr=False)

    def __len__(self) -> int:
        return len(self.phase)


@dataclass(frozen=True)
class LabelReport:
    """Says where the labels of a clip come from, and holds warnings.

    clip: its name. phase_source, gait_source: "file" (made by hand) or "automatic" (found from the motion).
    phase_zero, margins, between: the values of these options in the section `labels`. cycles_dropped: number
    of cycles that are not used. `load_report` of `hobble.core.declared` reads it from the JSON file beside
    the labels.
    """

    clip: str
    phase_source: str
    gait_source: str
    phase_zero: str
    margins: str
    cycles_dropped: int
    between: bool = False
    warnings: tuple[str, ...] = ()


# What a file of labels holds, for F frames, N footsteps and C cycles. A landing that is not known is NaN.
DECLARED = {
    "contacts": ArrayOf(("F", len(CONTACT_ROLES)), "b"),
    "phase": ArrayOf(("F",), low=0, high=1),
    "phase_known": ArrayOf(("F",), "b"),
    "gait": ArrayOf(("F", len(GAITS)), low=-1e-3, high=1.001),
    "footsteps": ArrayOf(("N", 3), low=-1e6, high=1e6, finite=False),
    "cycles": ArrayOf(("C", 2), "iu", low=0),
}


def save_labels(path: str | Path, labels: Labels) -> None:
    """Write the labels of a clip as an npz file, with an array for each field of `Labels`."""
    save_npz(path, **{f.name: getattr(labels, f.name) for f in fields(labels)})


def load_labels(path: str | Path) -> Labels:
    """Read a file that `save_labels` wrote."""
    data = load_declared(path, DECLARED)
    cycles, frames = data["cycles"], len(data["phase"])
    if np.any(cycles[:, 0] >= cycles[:, 1]) or cycles.max(initial=0) >= max(frames, 1):
        raise InputError(path, f"its cycles do not lie in its {frames} frames", fix=DELETE_IT)
    return Labels(**{name: data[name] for name in DECLARED})


POINTS = 400  # a curve has at most this many values


def label_curves(labels: Labels, clip: Clip) -> dict[str, Any]:
    """Contacts, landings, phase, gait and speed over time, under these keys, as short lists.

    `contacts`: for each joint of CONTACT_ROLES a list of intervals [from, to), in seconds, in which it is on
    the ground. `landings`: for "right" and "left" the times in seconds at which this foot lands. `phase`
    (None where unknown), `gait` (for each gait that occurs) and `speed` (m/s over the ground, averaged over a
    fifth of a second) are curves, lists of at most POINTS values. `seconds`: the times of these values.
    """
    frames, ground = len(labels), clip.root[:, [0, 2]]
    chosen = np.unique(np.linspace(0, max(frames - 1, 0), min(frames, POINTS)).round().astype(int))
    speed = np.zeros(frames)
    if frames > 1:
        speed = mean(np.linalg.norm(np.gradient(ground, axis=0), axis=1), 13) * clip.fps / 100
    contacts = {role: _intervals(labels.contacts[:, i], clip.fps) for i, role in enumerate(CONTACT_ROLES)}
    landings = (labels.footsteps[np.isfinite(labels.footsteps[:, i]), i] / clip.fps for i in (0, 1))
    phases = zip(_rounded(labels.phase[chosen]), labels.phase_known[chosen], strict=True)
    gaits = {name: labels.gait[chosen, i] for i, name in enumerate(GAITS) if labels.gait[:, i].any()}
    return {
        "seconds": _rounded(chosen / clip.fps),
        "contacts": contacts,
        "landings": dict(zip(("right", "left"), map(_rounded, landings), strict=True)),
        "phase": [value if known else None for value, known in phases],
        "gait": {name: _rounded(shares) for name, shares in gaits.items()},
        "speed": _rounded(speed[chosen]),
    }


def _intervals(flags: Array, fps: float) -> list[list[float]]:
    """[from, to) in seconds of each stretch of frames in which `flags` is true."""
    return [_rounded(pair / fps) for pair in true_runs(flags)]


def _rounded(values: Array) -> list[float]:
    return [round(float(v), 3) for v in values]
