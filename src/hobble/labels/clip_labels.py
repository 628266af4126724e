"""The labels of one clip, and their file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import load_npz, save_npz
from hobble.core.quat import Array

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
CONTACT_ROLES = ("left_heel", "left_toe", "right_heel", "right_toe")


@dataclass(frozen=True)
class Labels:
    """Labels of F frames at 60 Hz.

    contacts: (F, 4) bool, in the order of CONTACT_ROLES. phase: (F,) in 0..1. phase_known: (F,) bool. gait:
    (F, 6) shares in the order of GAITS. footsteps: (N, 3) landings, see `hobble.labels.phase`. cycles: (C, 2)
    int, first and last frame, inclusive, of each cycle that is used.
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
    """Where the labels of a clip come from, and warnings.

    clip: its name. phase_source, gait_source: "file" or "automatic". phase_zero, margins: the options of the
    section `labels` with these names. cycles_dropped: number of cycles that are not used.
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
        """Read the report from the JSON beside the labels. The other keys of this JSON are ignored."""
        values = {f.name: data[f.name] for f in fields(cls)}
        return cls(**{**values, "warnings": tuple(values["warnings"])})


def save_labels(path: str | Path, labels: Labels) -> None:
    """Write labels as one npz file."""
    save_npz(path, **{f.name: getattr(labels, f.name) for f in fields(labels)})


def load_labels(path: str | Path) -> Labels:
    """Read a file that `save_labels` wrote."""
    data = load_npz(path)
    return Labels(**{f.name: data[f.name] for f in fields(Labels)})
