"""The labels of one clip, and their file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, save_npz
from hobble.core.quat import Array

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
    phase_zero, margins: the values of these options in the section `labels`. cycles_dropped: number of cycles
    that are not used.
    """

    clip: str
    phase_source: str
    gait_source: str
    phase_zero: str
    margins: str
    cycles_dropped: int
    warnings: tuple[str, ...] = ()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> LabelReport:
        """Make the report from the content of the JSON file beside the labels. Further keys are ignored."""
        values = {f.name: data[f.name] for f in fields(cls)}
        return cls(**{**values, "warnings": tuple(values["warnings"])})


def save_labels(path: str | Path, labels: Labels) -> None:
    """Write the labels of a clip as an npz file, with an array for each field of `Labels`."""
    save_npz(path, **{f.name: getattr(labels, f.name) for f in fields(labels)})


def load_labels(path: str | Path) -> Labels:
    """Read a file that `save_labels` wrote."""
    data = load_npz(path)
    return Labels(**{f.name: data[f.name] for f in fields(Labels)})
