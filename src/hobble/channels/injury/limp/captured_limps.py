"""The walks in captured clips, hurt or healthy, and for how long each link hurts in the training clips.

A link is a pair of neighbouring joints. It has one severity.
"""

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
from hobble.gait.cycles import WalkCycles, join_walks, measure
from hobble.gait.people import people
from hobble.gait.profile import Profile, profile
from hobble.measures.clip_parts import ClipPart
from hobble.rows.clip_rows import ClipRows

# End of the name of a hurt version of a healthy clip, which is generated.
HURT_VERSION = re.compile(r"_hurt[1-9](_mirror)?$")
MIRROR = "_mirror"  # end of the name of a mirrored clip
PERFORMER = re.compile(r"^([^_]+)_")  # in a clip's name: "105" in "105_25"


@dataclass(frozen=True)
class CapturedWalk:
    """The walk in one captured clip whose severities do not change.

    clip: its name. hurt: link -> severity, for the links that hurt. walk: the gait cycles. speed: mean speed,
    cm a frame.
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
    """For how many seconds of the training clips each link hurts.

    captured: link -> seconds of captured motion. generated: link -> seconds of hurt versions, which were
    generated from healthy clips.
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
    walks, hurt_seconds = [], HurtSeconds()
    for clip, parts_of_clip in groupby(parts, key=lambda part: part.clip):
        is_generated = HURT_VERSION.search(clip) is not None
        rows_of_clip: list[ClipRows] = []
        for part in parts_of_clip:
            rows = part.load().rows
            if splits.get(clip) == "train":
                of_links = hurt_seconds.generated if is_generated else hurt_seconds.captured
                _add_seconds(of_links, links, rows.channels.get(INJURY), part.weight)
            if not is_generated:
                rows_of_clip.append(rows)
        walks += _walk_of_clip(clip, rows_of_clip, links, skeleton)
    return walks, hurt_seconds


def _add_seconds(
    of_links: dict[str, float], links: Sequence[str], severity: Array | None, weight: float
) -> None:
    """Add the seconds for which each link hurts to `of_links`.

    severity: (R, links) of R rows; None if the clip has no severities. weight: how many rows of the clip each
    of these rows stands for.
    """
    for link, column in zip(links, () if severity is None else severity.T, strict=False):
        if column.any():
            of_links[link] = round(of_links.get(link, 0.0) + float(np.sum(column > 0)) * weight / FPS, 2)


def healthy_of(walk: CapturedWalk, walks: Sequence[CapturedWalk]) -> tuple[Profile, str]:
    """The healthy walk to compare a clip with, and whose walk it is.

    The performer's healthy clips are used ("performer"). If there are none, all healthy clips of the data set
    are used ("data set"). If there are none either, it is the mean normal walk in `hobble.gait.people`
    ("people").
    """
    healthy = [one for one in walks if not one.hurt and len(one.walk)]
    of_performer = [one for one in healthy if one.performer == walk.performer]
    for chosen, whose in ((of_performer, "performer"), (healthy, "data set")):
        if chosen:
            return profile(join_walks(one.walk for one in chosen)), whose
    return people().normal(), "people"


def _walk_of_clip(
    clip: str, rows_of_clip: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> list[CapturedWalk]:
    """The walk of a clip as a list of one; empty if severities change or no whole cycle is walked.

    rows_of_clip: all rows of the clip in one item, or an item for each excerpt.
    """
    rows_of_clip = [rows for rows in rows_of_clip if len(rows)]
    if not rows_of_clip:
        return []
    severity = np.concatenate(
        [rows.channels.get(INJURY, np.zeros((len(rows), len(links)))) for rows in rows_of_clip]
    )
    if np.ptp(severity, axis=0).any():
        return []
    walks, speeds = [], []
    for rows in rows_of_clip:
        turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
        for stretch in captured(rows):
            if stretch.gait.mean(axis=0).argmax() != 1:  # gait 1 is walking
                continue
            yaw = np.concatenate([[0.0], -np.cumsum(turn[stretch.rows])[:-1]])
            walks.append(measure(skeleton, _in_world(stretch.local, stretch.root, yaw), FPS))
            speeds.append(np.hypot(stretch.velocity[:, 0], stretch.velocity[:, 1]).mean())
    walk = join_walks(walks) if walks else WalkCycles(FPS, (), ())
    if not len(walk):
        return []
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    return [CapturedWalk(clip, hurt, walk, float(np.mean(speeds)))]


def _in_world(local: Array, root: Array, yaw: Array) -> Array:
    """(F, J, 3) positions in the world, from `local` (F, J, 3) in root coordinates.

    root: (F, 3) position of the root. yaw: (F,) its rotation about the vertical, radians.
    """
    out = local.copy()
    out[..., ::2] = rotate_by_yaw(local[..., ::2], yaw[:, None])
    return out + root[:, None]
