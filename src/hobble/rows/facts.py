"""A summary of the rows of a clip, so that clips can be chosen without reading their rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import read_json, write_json
from hobble.rows.clip_rows import DELETE_IT, ClipRows
from hobble.rows.compose import body_layout
from hobble.rows.layout import GAITS


@dataclass(frozen=True)
class Facts:
    """rows: their number. gait: the one with the largest share. speed: of the root, mean over the rows, cm a
    frame. channels: names of those with a value above 0 in some row."""

    clip: str
    rows: int
    gait: str
    speed: float
    channels: tuple[str, ...]


def facts(rows: ClipRows) -> Facts:
    """The summary of the rows of one clip."""
    layout = rows.layout
    channels = tuple(name for name, values in rows.channels.items() if np.any(values != 0))
    if not len(rows):
        return Facts(rows.clip, 0, GAITS[0], 0.0, channels)
    shares = rows.x[:, body_layout(layout).x_gait].reshape(len(rows), len(GAITS), layout.samples)
    gait = GAITS[int(shares[:, :, layout.samples // 2].mean(axis=0).argmax())]
    speed = np.hypot(*rows.y[:, layout.y_root_velocity].astype(float).T).mean()
    return Facts(rows.clip, len(rows), gait, float(speed), channels)


def save_facts(path: str | Path, found: Facts) -> None:
    """Write a summary as JSON."""
    write_json(Path(path), asdict(found))


def load_facts(path: str | Path) -> Facts:
    """Read a summary. Raises InputError if the file holds something else."""
    values: Mapping[str, Any] = read_json(Path(path))
    try:
        return Facts(**{**values, "channels": tuple(values["channels"])})
    except (KeyError, TypeError) as error:
        raise InputError(path, f"not the facts of a clip ({error})", fix=DELETE_IT) from error
