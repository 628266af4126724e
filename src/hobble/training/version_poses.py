"""Moves input poses between a clip and its hurt versions, so that a network learns what an injury changes."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.chunk_window import ChunkWindow, empty_buffers
from hobble.database.precision import widen
from hobble.database.reader import Database
from hobble.rows.compose import lower_joints, without_terrain
from hobble.training.even_spread import EvenSpread

SPLIT = "train"
TABLE_BYTES = 256 << 20  # memory for poses; if they need more, only every second (third, ...) row is kept
CANDIDATES = 8  # number of rows with the nearest phases, among which the most similar path is chosen
NEAR = 1 / 32  # largest difference in phase between two poses that are mixed, in cycles


class VersionPoses:
    """Moves the pose in rows of X towards that of another version of the same clip. Y is unchanged.

    Each link is hurt in few clips. A network that continues the walk that it sees takes the posture of these
    clips for a part of the injury, and a character that limps as at severity 10 goes on like that when the
    severity falls to 5. With these rows the network sees each clip's poses with and without the injury, and
    only the channels tell whether Y is hurt.

    The pose of a hurt row moves along the line to a pose of the healthy clip, and that of a healthy row along
    the line to a pose of a hurt version. Among the rows with nearly the same phase, the one whose path turns
    most alike is taken. The pose moves by -1 to 1 times the way to the other pose; a negative factor moves it
    away. The factors are spread evenly. They depend only on the row's place in the batch and on the number of
    the batch, so several processes get the same rows as one. Rows of clips without hurt versions are not
    changed.

    The factors have the mean 0. If all poses moved towards the other version, the network would learn that Y
    is always further from the other version than X is. Then the character exaggerates at run time.

    share: share of the rows that are moved; 0 changes nothing. batch: largest number of this process's rows
    in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, share: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        names, sources = database.clips, database.sources
        self.share = share if batch and sources else 0.0
        if not self.share:
            return
        layout = database.layout
        of_name = {name: i for i, name in enumerate(names)}
        hurt = np.array([name in sources for name in names])
        family = np.array([of_name.get(sources.get(name, name), -1) for name in names])
        family[~np.isin(family, family[hurt])] = -1
        # Rows are sorted by the key of their clip plus the phase. Clips without hurt versions have a negative
        # key.
        self.own = np.where(family < 0, -2.0, 2.0 * (family + len(names) * hurt))
        self.other = np.where(family < 0, -2.0, 2.0 * (family + len(names) * ~hurt))
        self.pose, self.way = (layout.x_joint_position, layout.x_joint_velocity), layout.x_direction
        key, poses, ways = _table(database, self.own)
        self.key = torch.from_numpy(key).to(device)
        self.poses, self.ways = torch.from_numpy(poses).to(device), torch.from_numpy(ways).to(device)
        self.spread = EvenSpread(batch, device, first)
        self.near = torch.arange(CANDIDATES, device=device) - CANDIDATES // 2
        self.batches = 0

    def begin(self) -> None:
        """Start again, so that a section does not depend on the previous one."""
        self.batches = 0

    def mix(self, x: Tensor, p: Tensor, clip: np.ndarray) -> None:
        """Move the poses of standardised inputs x (B, X) in place.

        p: (B,) phases, 0 to 1. clip: (B,) indices into the database's clips.
        """
        if not self.share or not len(x) or not len(self.key):
            return
        parts = self._parts(len(x))
        self.batches += 1
        moved = torch.nonzero(parts).flatten()
        wanted = torch.from_numpy(self.other[clip]).to(x.device)[moved] + p[moved].double()
        some = torch.searchsorted(self.key, wanted)[:, None] + self.near
        some = some.clamp(0, len(self.key) - 1)
        alike = ((self.key[some] - wanted[:, None]).abs() < NEAR) & (wanted >= 0)[:, None]
        away = torch.linalg.vector_norm(self.ways[some] - x[moved, self.way][:, None], dim=2)
        nearest, chosen = torch.where(alike, away, torch.inf).min(dim=1)
        part = torch.where(nearest < torch.inf, parts[moved], 0.0).to(x.dtype)
        other = self.poses[some.gather(1, chosen[:, None])[:, 0]]
        for block, wanted_pose in zip(self.pose, other.chunk(2, dim=1), strict=True):
            x[moved, block] = torch.lerp(x[moved, block], wanted_pose, part[:, None])

    def _parts(self, rows: int) -> Tensor:
        """(rows,) how far each pose moves: 0, or in `share` of the rows evenly spread from -1 to 1."""
        even = self.spread.numbers(rows, self.batches)
        return torch.where(even < self.share, 2 * even / self.share - 1, 0.0)


def _table(database: Database, own: Array) -> tuple[Array, Array, Array]:
    """Keys (n,), poses (n, D) and path directions (n, E) of the training rows of clips with hurt versions.

    own: (clips,) key of each clip; clips with a negative key are left out. The key of a row is that of its
    clip plus its phase. The rows are sorted by key.
    """
    manifest = database.manifest
    bare, into = without_terrain(database.layout), empty_buffers(manifest, SPLIT, 1)
    pose, way = (
        np.r_[tuple(bare[name] for name in names)]
        for names in (("joint_position", "joint_velocity"), ("direction",))
    )
    row_bytes = 4 * (len(pose) + len(way)) * manifest.rows(SPLIT)
    every = max(1, math.ceil(row_bytes / TABLE_BYTES))
    parts = [
        (np.empty(0), np.empty((0, len(pose)), np.float32), np.empty((0, len(way)), np.float32)),
        *(
            _of_chunk(database.load(SPLIT, [number], into), own, pose, way, database, every)
            for number in range(len(manifest.chunks[SPLIT]))
        ),
    ]
    key, poses, ways = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(key, kind="stable")
    return key[order], poses[order], ways[order]


def _of_chunk(
    window: ChunkWindow, own: Array, pose: np.ndarray, way: np.ndarray, database: Database, every: int
) -> tuple[Array, Array, Array]:
    """The same for the rows of one chunk, not sorted. Heights are above the first terrain fit of each row."""
    key = own[window.clip] + window.phase
    kept = np.flatnonzero(key >= 0)[::every]
    x = widen(window.x[kept]).astype(np.float32)
    lift = widen(window.fits[window.first[kept]]).astype(np.float32)[:, -1:]
    lower_joints(x, without_terrain(database.layout)["joint_position"], lift, _without_terrain_std(database))
    return key[kept], x[:, pose], x[:, way]


def _without_terrain_std(database: Database) -> Array:
    """(columns,) standard deviations of X without its terrain columns."""
    return np.delete(database.statistics.x_std, database.layout.x_terrain)
