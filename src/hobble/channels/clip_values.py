"""Makes, checks, saves and loads the values of one channel in each frame of a clip.

Below, F is the number of frames of the clip, and C the number of columns of the channel.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import ClipSource, channel
from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, load_declared
from hobble.core.errors import InputError
from hobble.core.files import save_npz, write_json
from hobble.core.quat import Array


def read_clip_values(
    name: str, clip: Clip, source: ClipSource, motion: Mapping[str, Any]
) -> tuple[Array, list[str]]:
    """Values (F, C) float32 of channel `name` for a clip, and warnings.

    motion: the report on how the clip was made from its BVH file. Raises InputError if the values cannot be
    read, are not finite or are outside the channel's range.
    """
    definition = channel(name)
    values, warnings = definition.read(clip, source, motion)
    labels = definition.columns(clip.skeleton)
    if values.shape != (len(clip), len(labels)):
        expected = (len(clip), len(labels))
        problem = (
            f"channel {name} has values of shape {values.shape} instead of {expected}, (frames, columns)"
        )
        raise InputError(clip.name, problem)
    wrong = ~((values >= 0) & (values <= definition.highest))
    if wrong.any():
        frame, column = (int(i) for i in np.argwhere(wrong)[0])
        value = f"{definition.value_word} {values[frame, column]:g} of {labels[column]}"
        problem = f"{value} is not between 0 and {definition.highest:g}"
        raise InputError(clip.name, problem, frame=frame)
    return values, warnings


def save_values(path: str | Path, values: Array, labels: Sequence[str]) -> None:
    """Write values (F, C) and the labels of their columns as one npz file."""
    save_npz(path, values=values, labels=np.array(list(labels), dtype=np.str_))


def load_values(path: str | Path) -> tuple[Array, tuple[str, ...]]:
    """Read a file of `save_values`. Returns the values (F, C) and the labels of their columns."""
    data = load_declared(path, {"values": ArrayOf(("F", "C"), low=0), "labels": ArrayOf(("C",), "U")})
    return data["values"], tuple(str(label) for label in data["labels"])


def write_report(
    path: str | Path, name: str, clip: Clip, values: Array, labels: Sequence[str], warnings: Sequence[str]
) -> None:
    """Write a clip's report as JSON, with `Channel.summary`, the channel's highest value and the warnings."""
    definition = channel(name)
    summary = definition.summary(values, labels, clip.fps)
    report = {"clip": clip.name, "channel": name, "title": definition.title, "values": summary}
    write_json(path, {**report, "highest": definition.highest, "warnings": list(warnings)})
