"""Captured clips that limp: their cycles and injuries, and whether the motion was generated."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.channels.injury.crowd_severities import INJURY
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.captured import captured, rotate_by_yaw
from hobble.evaluation.crowd import FPS
from hobble.gait.cycles import WalkCycles, joined, measure
from hobble.gait.people import people
from hobble.gait.profile import Profile, profile
from hobble.rows.clip_rows import ClipRows, load_clip_rows

VERSION = re.compile(r"_hurt[1-9](_mirror)?$")  # end of the name of a generated hurt version
MIRROR = "_mirror"
PERFORMER = re.compile(r"^([^_]+)_")  # "105" in "105_25"


@dataclass(frozen=True)
class Limp:
    """The walking of one clip. hurt: link -> severity, if they are constant. speed: cm a frame."""

    clip: str
    hurt: Mapping[str, float]
    walk: WalkCycles = field(repr=False)
    speed: float

    @property
    def performer(self) -> str:
        """The part of the clip's name before the first underscore.

        A mirrored clip has a performer of its own.
        """
        found = PERFORMER.match(self.clip)
        name = found[1] if found else self.clip
        return name + (MIRROR if self.clip.endswith(MIRROR) else "")


@dataclass
class HurtSeconds:
    """Seconds in which each link hurts in training, in captured motion and in generated hurt versions."""

    captured: dict[str, float] = field(default_factory=dict)
    made: dict[str, float] = field(default_factory=dict)


def limps(
    files: Iterable[Path], splits: Mapping[str, str], links: Sequence[str], skeleton: Skeleton
) -> tuple[list[Limp], HurtSeconds]:
    """The walks of all captured clips, and the seconds for which each link hurts in the training clips."""
    found, hurt_seconds = [], HurtSeconds()
    for file in sorted(files, key=lambda file: Path(file).stem):
        rows = load_clip_rows(file)
        severity = rows.channels.get(INJURY, np.zeros((len(rows), 0)))
        is_made = VERSION.search(rows.clip) is not None
        if splits.get(rows.clip) == "train":
            kept = hurt_seconds.made if is_made else hurt_seconds.captured
            for link, column in zip(links, severity.T, strict=False):
                if column.any():
                    kept[link] = round(kept.get(link, 0.0) + float(np.sum(column > 0)) / FPS, 2)
        if not is_made:
            found += _walked(rows, links, skeleton)
    return found, hurt_seconds


def healthy_of(limp: Limp, every: Sequence[Limp]) -> tuple[Profile, str]:
    """The healthy walk to compare a clip with, and whose it is: the performer's, else the data set's, else
    people's.
    """
    well = [one for one in every if not one.hurt and len(one.walk)]
    own = [one for one in well if one.performer == limp.performer]
    for some, whose in ((own, "performer"), (well, "data set")):
        if some:
            return profile(joined(one.walk for one in some)), whose
    return people().normal(), "people"


def _walked(rows: ClipRows, links: Sequence[str], skeleton: Skeleton) -> list[Limp]:
    """The walking of a clip with constant severities; an empty list if there is no whole cycle of it."""
    severity = rows.channels.get(INJURY, np.zeros((len(rows), len(links))))
    if not len(rows) or np.ptp(severity, axis=0).any():
        return []
    walks, speeds = [], []
    turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
    for part in captured(rows):
        if part.gait.mean(axis=0).argmax() != 1:
            continue
        yaw = np.concatenate([[0.0], -np.cumsum(turn[part.rows])[:-1]])
        walks.append(measure(skeleton, _placed(part.local, part.root, yaw), FPS))
        speeds.append(np.hypot(part.velocity[:, 0], part.velocity[:, 1]).mean())
    walk = joined(walks) if walks else WalkCycles(FPS, (), ())
    if not len(walk):
        return []
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    return [Limp(rows.clip, hurt, walk, float(np.mean(speeds)))]


def _placed(local: Array, root: Array, yaw: Array) -> Array:
    """(F, J, 3) positions in the world. local: in a root frame at `root` (F, 3) that faces `yaw` (F,)."""
    out = local.copy()
    out[..., ::2] = rotate_by_yaw(local[..., ::2], yaw[:, None])
    return out + root[:, None]
