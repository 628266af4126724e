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

    Each link is hurt in few clips. A network can take the posture of these clips for a part of the injury,
    and continue the walk that it sees: a character that limps as at severity 10 then limps just as much after
    the severity has fallen to 5. With these rows the network sees each clip's poses with and without the
    injury, and only the channels tell whether Y is hurt.

    The pose of a hurt row moves along the line to a pose of the healthy clip, and that of a healthy row along
    the line to a pose of a hurt version. The other pose is that of the row whose path turns most like that of
    the moved row, among rows with nearly the same phase. The pose moves by -1 to 1 times the way to the other
    pose; a negative factor moves it away. These factors are spread evenly. They depend only on the row's
    place in the batch and on the number of the batch, so several processes get the same rows as one would.
    Rows of clips without hurt versions are not changed.

    The factors have the mean 0. If all poses of X moved towards the other version, Y, which does not move,
    would always be further from that version than X. The network would learn to step away from it in each
    frame, so the character would exaggerate its limp at run time.

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
        # Rows are sorted by the key of their clip plus the phase. Keys of clips are 2 apart, so that rows of
        # different keys are never near. Clips without hurt versions have a negative key.
        self.own_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * hurt))
        self.other_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * ~hurt))
        self.pose, self.direction = (layout.x_joint_position, layout.x_joint_velocity), layout.x_direction
        key, poses, directions = _table(database, self.own_key)
        self.key = torch.from_numpy(key).to(device)
        self.poses, self.directions = (torch.from_numpy(array).to(device) for array in (poses, directions))
        self.spread = EvenSpread(batch, device, first)
        self.offsets = torch.arange(CANDIDATES, device=device) - CANDIDATES // 2
        self.batches = 0

    def begin(self) -> None:
        """Start again, so that a section of the training does not depend on the previous one."""
        self.batches = 0

    def mix(self, x: Tensor, p: Tensor, clip: np.ndarray) -> None:
        """Move the poses of standardised inputs x (B, X) in place.

        p: (B,) phases, 0 to 1. clip: (B,) indices into the database's clips.
        """
        if not self.share or not len(x) or not len(self.key):
            return
        factors = self._factors(len(x))
        self.batches += 1
        moved = torch.nonzero(factors).flatten()
        key = torch.from_numpy(self.other_key[clip]).to(x.device)[moved] + p[moved].double()
        candidates = torch.searchsorted(self.key, key)[:, None] + self.offsets
        candidates = candidates.clamp(0, len(self.key) - 1)
        near = ((self.key[candidates] - key[:, None]).abs() < NEAR) & (key >= 0)[:, None]
        apart = torch.linalg.vector_norm(
            self.directions[candidates] - x[moved, self.direction][:, None], dim=2
        )
        least, chosen = torch.where(near, apart, torch.inf).min(dim=1)
        factor = torch.where(least < torch.inf, factors[moved], 0.0).to(x.dtype)
        other = self.poses[candidates.gather(1, chosen[:, None])[:, 0]]
        for block, other_block in zip(self.pose, other.chunk(2, dim=1), strict=True):
            x[moved, block] = torch.lerp(x[moved, block], other_block, factor[:, None])

    def _factors(self, rows: int) -> Tensor:
        """(rows,) the factor of each row: in `share` of the rows spread evenly from -1 to 1, else 0."""
        even = self.spread.numbers(rows, self.batches)
        return torch.where(even < self.share, 2 * even / self.share - 1, 0.0)


def _table(database: Database, clip_keys: Array) -> tuple[Array, Array, Array]:
    """Keys (n,), poses (n, D) and path directions (n, E) of the training rows of clips with hurt versions.

    clip_keys: (clips,) key of each clip; clips with a negative key are left out. The key of a row is the key
    of its clip plus the phase. The rows are sorted by key.
    """
    manifest = database.manifest
    bare, into = without_terrain(database.layout), empty_buffers(manifest, SPLIT, 1)
    pose, direction = (
        np.r_[tuple(bare[name] for name in names)]
        for names in (("joint_position", "joint_velocity"), ("direction",))
    )
    row_bytes = 4 * (len(pose) + len(direction)) * manifest.rows(SPLIT)
    row_step = max(1, math.ceil(row_bytes / TABLE_BYTES))
    parts = [
        (np.empty(0), np.empty((0, len(pose)), np.float32), np.empty((0, len(direction)), np.float32)),
        *(
            _of_chunk(database.load(SPLIT, [number], into), clip_keys, pose, direction, database, row_step)
            for number in range(len(manifest.chunks[SPLIT]))
        ),
    ]
    key, poses, directions = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(key, kind="stable")
    return key[order], poses[order], directions[order]


def _of_chunk(
    window: ChunkWindow,
    clip_keys: Array,
    pose: np.ndarray,
    direction: np.ndarray,
    database: Database,
    row_step: int,
) -> tuple[Array, Array, Array]:
    """The arrays of `_table` for one chunk, not sorted, with only one of `row_step` rows.

    pose, direction: columns of x. Joint heights are measured from the
    mean ground height of the row's first terrain fit.
    """
    key = clip_keys[window.clip] + window.phase
    kept = np.flatnonzero(key >= 0)[::row_step]
    x = widen(window.x[kept]).astype(np.float32)
    lift = widen(window.fits[window.first[kept]]).astype(np.float32)[:, -1:]
    lower_joints(x, without_terrain(database.layout)["joint_position"], lift, _without_terrain_std(database))
    return key[kept], x[:, pose], x[:, direction]


def _without_terrain_std(database: Database) -> Array:
    """(columns,) standard deviations of X without its terrain columns."""
    return np.delete(database.statistics.x_std, database.layout.x_terrain)
