"""Measures the walks in captured clips, and for how many seconds each link hurts in the training clips.

A link is a pair of neighbouring joints. A severity from 0 to 10 says how much a link hurts.
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
from hobble.gait.cycles import WalkCycles, join_walks, measure_cycles
from hobble.gait.profile import Profile, healthy_profile, profile_of_walk
from hobble.measures.sample import ClipPart
from hobble.measures.walks import FPS
from hobble.rows.captured import captured_stretches, rotate_by_yaw
from hobble.rows.clip_rows import ClipRows

# A hurt version is a copy of a healthy clip that `hobble.hurt` made limp. Its name ends like this:
HURT_VERSION = re.compile(r"_hurt[1-9](_mirror)?$")
MIRROR = "_mirror"  # end of the name of a mirrored clip
PERFORMER = re.compile(r"^([^_]+)_")  # the performer in a clip's name, such as "105" in "105_25"


@dataclass(frozen=True)
class CapturedWalk:
    """The walk in one captured clip. The severities are the same in all its frames.

    clip: name of the clip. severity_by_link: those of the links that hurt. walk: the gait cycles. speed: mean
    speed, cm a frame.
    """

    clip: str
    severity_by_link: Mapping[str, float]
    walk: WalkCycles = field(repr=False)
    speed: float

    @property
    def performer(self) -> str:
        """Who walks: the part of the clip's name before the first underscore.

        Mirrored clips count as clips of another performer, because their left and right are swapped.
        """
        found = PERFORMER.match(self.clip)
        name = found[1] if found else self.clip
        return name + (MIRROR if self.clip.endswith(MIRROR) else "")


@dataclass
class HurtSeconds:
    """For how many seconds of the training clips each link hurts.

    captured: link -> seconds in captured clips. generated: link -> seconds in hurt versions.
    """

    captured: dict[str, float] = field(default_factory=dict)
    generated: dict[str, float] = field(default_factory=dict)


def captured_walks(
    parts: Iterable[ClipPart], splits: Mapping[str, str], links: Sequence[str], skeleton: Skeleton
) -> tuple[list[CapturedWalk], HurtSeconds]:
    """The walks of all captured clips, and the seconds for which each link hurts in the training clips.

    parts: the parts of the clips to read, sorted by clip. If they are only a sample of the clips, the seconds
    are estimates. splits: clip -> "train" or "held_out". links: names of the links.
    """
    walks, hurt_seconds = [], HurtSeconds()
    for clip, parts_of_clip in groupby(parts, key=lambda part: part.clip):
        is_generated = HURT_VERSION.search(clip) is not None
        rows_of_clip: list[ClipRows] = []
        for part in parts_of_clip:
            rows = part.load().rows
            if splits.get(clip) == "train":
                seconds_of_links = hurt_seconds.generated if is_generated else hurt_seconds.captured
                _add_seconds(seconds_of_links, links, rows.channels.get(INJURY), part.weight)
            if not is_generated:
                rows_of_clip.append(rows)
        walks += _walk_of_clip(clip, rows_of_clip, links, skeleton)
    return walks, hurt_seconds


def _add_seconds(
    seconds_of_links: dict[str, float], links: Sequence[str], severity: Array | None, weight: float
) -> None:
    """Add to `seconds_of_links` for how many seconds each link hurts in R rows of a clip.

    severity: (R, L) of the L links; None if the clip has no severities. weight: how many rows of the clip
    each of these rows stands for.
    """
    for link, column in zip(links, () if severity is None else severity.T, strict=False):
        if column.any():
            seconds = float(np.sum(column > 0)) * weight / FPS
            seconds_of_links[link] = round(seconds_of_links.get(link, 0.0) + seconds, 2)


def healthy_reference(captured_walk: CapturedWalk, walks: Sequence[CapturedWalk]) -> tuple[Profile, str]:
    """The healthy walk to compare a captured walk with, and whose walk it is.

    "performer": it is measured over the performer's healthy clips. "data set": if the performer has no
    healthy clip, it is measured over all healthy clips. "people": if there is no healthy clip at all, it is
    the mean normal walk of people in `hobble.gait.profile`. walks: all captured walks.
    """
    healthy = [other for other in walks if not other.severity_by_link and len(other.walk)]
    of_performer = [other for other in healthy if other.performer == captured_walk.performer]
    for chosen, whose in ((of_performer, "performer"), (healthy, "data set")):
        if chosen:
            return profile_of_walk(join_walks(other.walk for other in chosen)), whose
    return healthy_profile([]), "people"


def _walk_of_clip(
    clip: str, rows_of_clip: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> list[CapturedWalk]:
    """The walk of a clip, as a list of one item.

    The list is empty if the severities change in the clip, or if nobody walks a whole cycle in it.
    rows_of_clip: all rows of the clip as one item, or an item for each of the clip's excerpts.
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
        for stretch in captured_stretches(rows):
            if stretch.gait.mean(axis=0).argmax() != 1:  # gait 1 is walking
                continue
            # `turn` is the change of yaw in each frame, negated.
            yaw = np.concatenate([[0.0], -np.cumsum(turn[stretch.rows])[:-1]])
            walks.append(measure_cycles(skeleton, _in_world(stretch.local, stretch.root, yaw), FPS))
            speeds.append(np.hypot(stretch.velocity[:, 0], stretch.velocity[:, 1]).mean())
    walk = join_walks(walks) if walks else WalkCycles(FPS, (), ())
    if not len(walk):
        return []
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    return [CapturedWalk(clip, hurt, walk, float(np.mean(speeds)))]


def _in_world(local: Array, root: Array, yaw: Array) -> Array:
    """Joint positions (F, J, 3) in the world, cm.

    local: (F, J, 3) joint positions in root coordinates. root: (F, 3) position of the root. yaw: (F,)
    rotation of the root about the vertical, radians.
    """
    out = local.copy()
    out[..., ::2] = rotate_by_yaw(local[..., ::2], yaw[:, None])
    return out + root[:, None]
