"""The walking of captured clips, hurt or healthy, and for how long each link hurts in the training clips."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np

from hobble.channels.injury.crowd_severities import INJURY
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.evaluation.captured import captured, rotate_by_yaw
from hobble.evaluation.crowd import FPS
from hobble.gait.cycles import WalkCycles, joined, measure
from hobble.gait.people import people
from hobble.gait.profile import Profile, profile
from hobble.measures.clip_parts import ClipPart
from hobble.rows.clip_rows import ClipRows

VERSION = re.compile(r"_hurt[1-9](_mirror)?$")  # end of the name of a generated hurt version
MIRROR = "_mirror"
PERFORMER = re.compile(r"^([^_]+)_")  # "105" in "105_25"


@dataclass(frozen=True)
class CapturedWalk:
    """The walking of one captured clip whose severities do not change.

    hurt: link -> severity, of links that hurt. walk: its cycles. speed: mean, cm a frame.
    """

    clip: str
    hurt: Mapping[str, float]
    walk: WalkCycles = field(repr=False)
    speed: float

    @property
    def performer(self) -> str:
        """The part of the clip's name before the first underscore.

        A mirrored clip counts as another performer, because left and right are swapped.
        """
        found = PERFORMER.match(self.clip)
        name = found[1] if found else self.clip
        return name + (MIRROR if self.clip.endswith(MIRROR) else "")


@dataclass
class HurtSeconds:
    """Link -> seconds in which it hurts in the training clips.

    captured: in captured motion. generated: in hurt versions that were generated from healthy clips.
    """

    captured: dict[str, float] = field(default_factory=dict)
    generated: dict[str, float] = field(default_factory=dict)


def captured_walks(
    parts: Iterable[ClipPart], splits: Mapping[str, str], links: Sequence[str], skeleton: Skeleton
) -> tuple[list[CapturedWalk], HurtSeconds]:
    """The walks of all captured clips, and the seconds for which each link hurts in the training clips.

    parts: the parts of the clips to read, sorted by clip. If they are only a sample, the seconds are
    estimates. splits: clip -> "train" or "held_out".
    """
    found, hurt_seconds = [], HurtSeconds()
    for clip, some in groupby(parts, key=lambda one: one.clip):
        is_generated = VERSION.search(clip) is not None
        seen: list[ClipRows] = []
        for one in some:
            rows = one.load().rows
            if splits.get(clip) == "train":
                of_links = hurt_seconds.generated if is_generated else hurt_seconds.captured
                _add_seconds(of_links, links, rows.channels.get(INJURY), one.weight)
            if not is_generated:
                seen.append(rows)
        found += _walked(clip, seen, links, skeleton)
    return found, hurt_seconds


def _add_seconds(
    of_links: dict[str, float], links: Sequence[str], severity: Array | None, weight: float
) -> None:
    """Add the seconds for which each link hurts to `of_links`.

    severity: (R, links). weight: how many rows of the clip each row stands for.
    """
    for link, column in zip(links, () if severity is None else severity.T, strict=False):
        if column.any():
            of_links[link] = round(of_links.get(link, 0.0) + float(np.sum(column > 0)) * weight / FPS, 2)


def healthy_of(walk: CapturedWalk, walks: Sequence[CapturedWalk]) -> tuple[Profile, str]:
    """The healthy walk to compare a clip with, and whose it is.

    It is the performer's ("performer"). If the data set has none, it is that of all its healthy clips ("data
    set"), and if there are none, the mean walk of the people in `hobble.gait.people` ("people").
    """
    healthy = [one for one in walks if not one.hurt and len(one.walk)]
    own = [one for one in healthy if one.performer == walk.performer]
    for some, whose in ((own, "performer"), (healthy, "data set")):
        if some:
            return profile(joined(one.walk for one in some)), whose
    return people().normal(), "people"


def _walked(
    clip: str, seen: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> list[CapturedWalk]:
    """The walking of a clip, in a list. It is empty if severities change or no whole cycle is walked.

    seen: the clip's rows, or excerpts of them.
    """
    seen = [rows for rows in seen if len(rows)]
    if not seen:
        return []
    severity = np.concatenate([rows.channels.get(INJURY, np.zeros((len(rows), len(links)))) for rows in seen])
    if np.ptp(severity, axis=0).any():
        return []
    walks, speeds = [], []
    for rows in seen:
        turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
        for part in captured(rows):
            if part.gait.mean(axis=0).argmax() != 1:  # not a walk
                continue
            yaw = np.concatenate([[0.0], -np.cumsum(turn[part.rows])[:-1]])
            walks.append(measure(skeleton, _placed(part.local, part.root, yaw), FPS))
            speeds.append(np.hypot(part.velocity[:, 0], part.velocity[:, 1]).mean())
    walk = joined(walks) if walks else WalkCycles(FPS, (), ())
    if not len(walk):
        return []
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    return [CapturedWalk(clip, hurt, walk, float(np.mean(speeds)))]


def _placed(local: Array, root: Array, yaw: Array) -> Array:
    """(F, J, 3) positions in the world. local: (F, J, 3) seen from `root` (F, 3), turned by `yaw` (F,)."""
    out = local.copy()
    out[..., ::2] = rotate_by_yaw(local[..., ::2], yaw[:, None])
    return out + root[:, None]
