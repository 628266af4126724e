"""Finds duplicate clips: the same file, or the same motion with another name or heading, or mirrored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import load_npz, save_npz
from hobble.core.quat import Array
from hobble.motion.root import facing_directions

# cm: two clips show the same motion if their joints are on average less than this apart. The release of
# Holden et al. (2017) contains two mirrored clips, which are 1.2 and 1.3 cm from the mirror images of their
# originals. Two different walks or runs of one person are at least 2.6 cm apart.
SAME_MOTION = 1.7
LONGER = 0.02  # clips are compared only if one is longer than the other by at most this share
POSES = 12  # number of poses of each clip that are compared
MIRROR = np.array([-1.0, 1.0, 1.0])  # a position times this is mirrored in the plane x = 0


@dataclass(frozen=True)
class ClipDigest:
    """The data of one clip by which it is compared with others.

    sha256: checksum of the file. seconds: length of the clip. poses: (POSES, J, 3) cm, the positions of the
    joints at times spread evenly over the clip, relative to the point of the ground below the hips at the
    same time. They are turned so that the first pose faces +Z. mirrored: `poses` with left and right
    exchanged, or None if the rig cannot be mirrored.
    """

    name: str
    sha256: str
    seconds: float
    poses: Array = field(repr=False)
    mirrored: Array | None = field(default=None, repr=False)


def clip_digest(clip: Clip, sha256: str) -> ClipDigest:
    """The data by which a clip is compared with others. sha256: checksum of its file."""
    sampled = np.linspace(0, len(clip) - 1, POSES).round().astype(int)
    moved = None if clip.translations is None else clip.translations[sampled]
    sample = replace(clip, rotations=clip.rotations[sampled], root=clip.root[sampled], translations=moved)
    poses = sample.positions - sample.positions[:, :1] * [1.0, 0.0, 1.0]
    ahead = facing_directions(clip.skeleton, sample.positions[:1], 0.0)[0]
    # Turn about the vertical axis, so that the facing direction (x, z) becomes (0, 1).
    x, z = ahead[[0, 2]] / max(float(np.hypot(ahead[0], ahead[2])), 1e-9)
    poses = poses @ np.array([[z, 0.0, x], [0.0, 1.0, 0.0], [-x, 0.0, z]])
    try:
        mirrored = poses[:, clip.skeleton.mirror_joints] * MIRROR
    except HobbleError:  # the names of the rig's joints do not show which joint is whose counterpart
        mirrored = None
    return ClipDigest(clip.name, sha256, len(clip) / clip.fps, poses, mirrored)


def save_digests(path: Path, clips: Sequence[ClipDigest]) -> None:
    """Write the data of all clips to one npz file. Its keys are like "3.poses", for the fourth clip."""
    arrays = {
        f"{number}.{name}": np.array(value)
        for number, clip in enumerate(clips)
        for name, value in vars(clip).items()
        if value is not None
    }
    save_npz(path, count=np.array(len(clips)), **arrays)


def load_digests(path: Path) -> list[ClipDigest]:
    """The inverse of `save_digests`."""
    data = load_npz(path)
    return [
        ClipDigest(
            str(data[f"{number}.name"]),
            str(data[f"{number}.sha256"]),
            float(data[f"{number}.seconds"]),
            data[f"{number}.poses"],
            data.get(f"{number}.mirrored"),
        )
        for number in range(int(data["count"]))
    ]


def duplicate_pairs(clips: Sequence[ClipDigest]) -> list[tuple[str, str, str]]:
    """Pairs of duplicates.

    Each pair is given as the names of the two clips and what they have in common: "the same file", "the same
    motion" or "mirrors of each other".
    """
    out = []
    by_length = sorted(clips, key=lambda clip: clip.seconds)
    for i, a in enumerate(by_length):
        for b in by_length[i + 1 :]:
            if b.seconds - a.seconds > LONGER * a.seconds:
                break  # all further clips are even longer
            if reason := _why_equal(a, b):
                out.append((min(a.name, b.name), max(a.name, b.name), reason))
    return sorted(out)


def _why_equal(a: ClipDigest, b: ClipDigest) -> str:
    """What two clips have in common, in the words of `duplicate_pairs`, or "" if they are no duplicates."""
    if a.sha256 == b.sha256:
        return "the same file"
    if a.poses.shape != b.poses.shape:
        return ""
    if np.linalg.norm(a.poses - b.poses, axis=-1).mean() < SAME_MOTION:
        return "the same motion"
    if a.mirrored is not None and np.linalg.norm(a.mirrored - b.poses, axis=-1).mean() < SAME_MOTION:
        return "mirrors of each other"
    return ""
