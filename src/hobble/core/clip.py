"""The motion of one skeleton over time, in memory and as an npz file."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
from pydantic import ConfigDict, Field
from typing_extensions import TypedDict

from hobble.core.declared import ArrayOf, load_declared, load_report
from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, save_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, forward_kinematics, skeleton_from_data

FARTHEST = 1e7  # cm (100 km): farther from the origin, floats are imprecise


@dataclass(frozen=True)
class Clip:
    """A motion: F frames of a skeleton with J joints, in centimetres, right-handed, Y up, +Z forward.

    fps: frames per second. rotations: (F, J, 4) local unit quaternions, w first. root: (F, 3) positions of
    the root joint. translations: (F, J, 3) positions of the joints relative to their parents, or None if all
    joints but the root keep their offsets.
    """

    name: str
    skeleton: Skeleton
    fps: float
    rotations: Array = field(repr=False)
    root: Array = field(repr=False)
    translations: Array | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.rotations)

    @cached_property
    def _world(self) -> tuple[Array, Array]:
        """World rotations and positions of all joints, computed at the first use."""
        return forward_kinematics(self.skeleton, self.rotations, self.root, self.translations)

    @property
    def global_rotations(self) -> Array:
        """(F, J, 4) world rotations."""
        return self._world[0]

    @property
    def positions(self) -> Array:
        """(F, J, 3) world positions in centimetres."""
        return self._world[1]

    def at_roles(self) -> dict[str, Array]:
        """Role, such as "left_knee" -> (F, 3) world positions of its joint."""
        return {role: self.positions[:, self.skeleton.role(role)] for role in self.skeleton.roles}

    def part(self, frames: slice | np.ndarray) -> Clip:
        """The clip with only some of its frames. frames: a slice or indices."""
        moved = None if self.translations is None else self.translations[frames]
        return replace(self, rotations=self.rotations[frames], root=self.root[frames], translations=moved)


# What a clip's file holds, for F frames of J joints.
DECLARED = {
    "name": ArrayOf((), "U"),
    "skeleton": ArrayOf((), "U"),
    "fps": ArrayOf((), "iuf", 1, 10_000),
    "rotations": ArrayOf(("F", "J", 4), low=-1.01, high=1.01),
    "root": ArrayOf(("F", 3), low=-FARTHEST, high=FARTHEST),
    "translations": ArrayOf(("F", "J", 3), low=-FARTHEST, high=FARTHEST, optional=True),
}


class ClipReport(TypedDict):
    """What later jobs read of the report of a clip. It has further entries.

    facing: in the first frame, degrees. source_frames, source_fps: of the clip's file. source_start: its
    first frame that is used, from 0. cycle_frames: after so many frames the clip repeats.
    """

    __pydantic_config__ = ConfigDict(extra="allow")  # type: ignore[misc]

    clip: str
    sha256: str
    facing: Annotated[float, Field(allow_inf_nan=False)]
    source_frames: Annotated[int, Field(ge=1)]
    source_fps: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    source_start: Annotated[int, Field(ge=0)]
    cycle_frames: Annotated[int, Field(ge=1)]


def load_clip_report(path: str | Path) -> dict[str, Any]:
    """The report of a clip, as `hobble.motion.make.make_clip` makes it."""
    return cast(dict[str, Any], load_report(path, "the report of a clip", ClipReport))


def save_clip(path: str | Path, clip: Clip) -> None:
    """Write a clip with its skeleton as one npz file. Rotations and translations are stored as float32."""
    extra = {} if clip.translations is None else {"translations": clip.translations.astype(np.float32)}
    save_npz(
        path,
        name=np.array(clip.name),
        skeleton=np.array(json.dumps(clip.skeleton.to_dict())),
        fps=np.array(clip.fps),
        rotations=clip.rotations.astype(np.float32),
        root=clip.root,
        **extra,
    )


def load_clip(path: str | Path) -> Clip:
    """Read what `save_clip` wrote. Rotations are float64 and have unit length again."""
    data = load_declared(path, DECLARED)
    rotations = data["rotations"].astype(float)
    lengths = np.linalg.norm(rotations, axis=-1, keepdims=True)
    skeleton = skeleton_from_data(path, str(data["skeleton"]), fix=DELETE_IT)
    if rotations.shape[1] != len(skeleton.joints) or lengths.min(initial=1.0) < 0.5:
        raise InputError(path, "its rotations are not those of its joints", fix=DELETE_IT)
    rotations /= lengths
    translations = data.get("translations")
    return Clip(
        str(data["name"]),
        skeleton,
        float(data["fps"]),
        rotations,
        data["root"],
        None if translations is None else translations.astype(float),
    )
