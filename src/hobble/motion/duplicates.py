"""Finds clips with the same motion: under another name, trimmed, shifted, turned, resampled or mirrored."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.motion.edit import resample
from hobble.motion.root import facing_directions

RATE = 30.0  # poses a second that are compared
LIMBS = (f"{side}_{part}" for part in ("wrist", "knee", "heel") for side in ("left", "right"))
JOINTS = ("hips", "head", *LIMBS)
# cm: two clips show the same motion if these joints are on average less than this apart. In the release of
# Holden et al. (2017), mirrored clips are 1.2 cm from the mirror images of their originals. Different walks
# and runs of one person in `cmu` are at least 1.9 cm apart in the seconds in which they are most alike.
SAME_MOTION = 1.5
SEARCH = 3.0  # cm: poses that are nearer (root mean square) suggest that two clips show the same moment
KEY = 15  # every so many poses, similar poses are searched in other clips
MOVES = 5.0  # cm a key: while a figure moves less, its poses are no keys, since all who stand are alike
# Two clips must have the same motion for LEAST seconds and for at least half of the shorter clip. Less than
# COMPLETE of the longer clip is said to be a part.
LEAST, COMPLETE = 1.0, 0.98


@dataclass(frozen=True)
class ClipDigest:
    """The data of one clip by which it is compared with others.

    sha256: checksum of the file. poses: (N, 8, 3) cm, the positions of JOINTS at RATE, relative to the point
    of the ground below the hips and turned to face +Z, each pose for itself. mirrored: the same with left and
    right exchanged, or None if the rig cannot be mirrored.
    """

    name: str
    sha256: str
    poses: Array = field(repr=False)
    mirrored: Array | None = field(default=None, repr=False)


def clip_digest(clip: Clip, sha256: str) -> ClipDigest:
    """The data by which a clip is compared with others. sha256: checksum of its file."""
    sample = resample(clip, RATE)
    poses = sample.positions[:, [clip.skeleton.role(role) for role in JOINTS]]
    poses = poses - poses[:, :1] * [1.0, 0.0, 1.0]
    ahead = facing_directions(clip.skeleton, sample.positions, 0.0)
    x, z = ahead[:, :1], ahead[:, 2:]
    across, along = poses[..., 0] * z - poses[..., 2] * x, poses[..., 0] * x + poses[..., 2] * z
    poses = np.stack([across, poses[..., 1], along], axis=-1).astype(np.float32)
    try:
        _ = clip.skeleton.mirror_joints
        mirrored = poses[:, [0, 1, 3, 2, 5, 4, 7, 6]] * np.array([-1, 1, 1], np.float32)
    except HobbleError:  # the names of the rig's joints do not show which joint is whose counterpart
        mirrored = None
    return ClipDigest(clip.name, sha256, poses, mirrored)


def duplicate_pairs(clips: Sequence[ClipDigest]) -> list[tuple[str, str, str]]:
    """Pairs of duplicates.

    Each pair is given as the names of the two clips and what they have in common: "the same file", "the same
    motion", "mirrors of each other", or one of the latter two "for 2.5 s".
    """
    found: dict[tuple[int, int], tuple[float, str]] = {}  # the longest motion that two clips have in common
    for what, mirrored in (("the same motion", False), ("mirrors of each other", True)):
        for pair, seconds in _same_motions(clips, mirrored).items():
            longest = max(len(clips[number].poses) for number in pair) / RATE
            part = "" if seconds >= COMPLETE * longest else f" for {seconds:.1f} s"
            found[pair] = max(found.get(pair, (0.0, "")), (seconds, what + part))
    by_file: dict[str, int] = {}
    for number, clip in enumerate(clips):
        first = by_file.setdefault(clip.sha256, number)
        if first != number:
            found[first, number] = 0.0, "the same file"
    out = []
    for (a, b), (_, what) in found.items():
        one, other = sorted((clips[a].name, clips[b].name))
        out.append((one, other, what))
    return sorted(out)


def _same_motions(clips: Sequence[ClipDigest], mirrored: bool) -> dict[tuple[int, int], float]:
    """Pairs of clips (numbers, the lower first) -> for how many seconds they show the same motion.

    mirrored: whether the first clip of each pair is mirrored.
    """
    from scipy.spatial import cKDTree  # imported here because other jobs do not need it

    if len(clips) < 2:
        return {}
    flat = [clip.poses.reshape(len(clip.poses), -1) for clip in clips]
    owner = np.repeat(np.arange(len(clips)), [len(poses) for poses in flat])
    start = np.concatenate([[0], np.cumsum([len(poses) for poses in flat])])
    tree, radius = cKDTree(np.concatenate(flat)), SEARCH * np.sqrt(len(JOINTS))
    out = {}
    for a, clip in enumerate(clips):
        poses = clip.mirrored if mirrored else clip.poses
        if poses is None:
            continue
        near = tree.query_ball_point((keys := _key_poses(poses))[1], radius) if len(poses) else []
        found = np.fromiter(chain.from_iterable(near), int)
        at = np.repeat(keys[0], [len(each) for each in near])
        # How far a pose of this clip is from the start of another clip, counted in poses.
        lags = found - start[owner[found]] - at
        pairs, votes = np.unique(
            np.stack([owner[found], lags])[:, owner[found] > a], axis=1, return_counts=True
        )
        for b in np.unique(pairs[0]):
            likeliest = pairs[1, pairs[0] == b][np.argmax(votes[pairs[0] == b])]
            if seconds := _seconds_alike(poses, clips[b].poses, int(likeliest)):
                out[a, int(b)] = seconds
    return out


def _key_poses(poses: Array) -> tuple[Array, Array]:
    """Numbers (K,) of every KEY-th pose in which the figure moves, and the poses (K, 24)."""
    numbers = np.arange(0, len(poses), KEY)
    moved = np.linalg.norm(poses[np.minimum(numbers + KEY // 2, len(poses) - 1)] - poses[numbers], axis=-1)
    numbers = numbers[moved.mean(axis=-1) > MOVES * 0.5]
    return numbers, poses[numbers].reshape(len(numbers), poses.shape[1] * 3)


def _seconds_alike(one: Array, other: Array, lag: int) -> float:
    """For how many seconds two motions are the same; 0 if they are not. lag: of `other`, within one pose."""
    for shift in (lag, lag - 1, lag + 1):
        first, stop = max(0, -shift), min(len(one), len(other) - shift)
        if stop - first >= max(LEAST * RATE, 0.5 * min(len(one), len(other))):
            apart = np.linalg.norm(one[first:stop] - other[first + shift : stop + shift], axis=-1).mean()
            if apart < SAME_MOTION:
                return (stop - first) / RATE
    return 0.0
