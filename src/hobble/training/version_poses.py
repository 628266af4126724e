"""Moves input poses between a clip and its hurt versions, so that a network learns what an injury changes.

A hurt version is a copy of a healthy clip in which Hobble has made some links injured. A link is a pair of
neighbouring joints, such as hip and knee.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.chunk_window import ChunkWindow, empty_buffers
from hobble.database.precision import to_floats
from hobble.database.reader import Database
from hobble.rows.compose import blocks_without_terrain, lower_joints
from hobble.training.even_spread import EvenSpread

SPLIT = "train"
# Memory for the poses of the training rows. If they need more, only every second (third, ...) row is used.
TABLE_BYTES = 256 << 20
CANDIDATES = 8  # the pose comes from one of this many rows with the nearest phases: the most similar path
NEAR = 1 / 32  # largest difference in phase between two poses that are mixed, in cycles


class VersionPoses:
    """Moves the pose in rows of X towards the pose of another version of the same clip. Y is unchanged.

    Each link is hurt in few clips. So a network can take the posture of these clips for a sign of the injury,
    and continue the walk that it sees. If a character limps as at severity 10 and the severity then falls to
    5, it goes on limping just as much. With the moved poses, the network sees the poses of each clip both
    with and without the injury, and only the channels tell whether Y is hurt.

    The pose of a hurt row moves along the line to a pose of the healthy clip. The pose of a healthy row moves
    along the line to a pose of a hurt version. This other pose comes from a row with nearly the same phase:
    the one whose path turns most like the path of the moved row. The pose moves by a factor of -1 to 1 times
    the way to the other pose; a negative factor moves it away. The factors are spread evenly. They depend
    only on the row's place in the batch and on the number of the batch, so several processes change the rows
    just as one process would. Rows of clips without hurt versions are not changed.

    The mean of the factors is 0, for this reason: if all poses of X moved towards the other version, Y would
    always be further from that version than X, because Y does not move. The network would learn to step away
    from that version in each frame, so the character would exaggerate its limp at run time.

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
        index_of = {name: i for i, name in enumerate(names)}
        hurt = np.array([name in sources for name in names])
        # Each clip's family: the index of its healthy original; -1 for clips without hurt versions.
        family = np.array([index_of.get(sources.get(name, name), -1) for name in names])
        family[~np.isin(family, family[hurt])] = -1
        # The healthy clip of a family has one key, and its hurt versions share another. `own_key` is the key
        # of each clip, and `other_key` is the key of the clips whose poses it gets. Rows are sorted by the
        # key of their clip plus their phase. Keys are 2 apart, so that rows of different keys are never near.
        # Clips without hurt versions have a negative key.
        self.own_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * hurt))
        self.other_key = np.where(family < 0, -2.0, 2.0 * (family + len(names) * ~hurt))
        self.pose_blocks = (layout.x_joint_position, layout.x_joint_velocity)
        self.direction_block = layout.x_direction
        key, poses, directions = _pose_table(database, self.own_key)
        self.key = torch.from_numpy(key).to(device)
        self.poses, self.directions = (torch.from_numpy(array).to(device) for array in (poses, directions))
        self.spread = EvenSpread(batch, device, first)
        # The places of the candidates, counted from the place of the sought key.
        self.offsets = torch.arange(CANDIDATES, device=device) - CANDIDATES // 2
        self.batches = 0  # number of batches since `begin_section`

    def begin_section(self) -> None:
        """Count batches from 0 again, so that a section does not depend on the previous one."""
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
        sought = torch.from_numpy(self.other_key[clip]).to(x.device)[moved] + p[moved].double()
        candidates = torch.searchsorted(self.key, sought)[:, None] + self.offsets
        candidates = candidates.clamp(0, len(self.key) - 1)
        is_near = ((self.key[candidates] - sought[:, None]).abs() < NEAR) & (sought >= 0)[:, None]
        path_difference = torch.linalg.vector_norm(
            self.directions[candidates] - x[moved, self.direction_block][:, None], dim=2
        )
        smallest, chosen = torch.where(is_near, path_difference, torch.inf).min(dim=1)
        factor = torch.where(smallest < torch.inf, factors[moved], 0.0).to(x.dtype)
        other_pose = self.poses[candidates.gather(1, chosen[:, None])[:, 0]]
        for block, other_block in zip(self.pose_blocks, other_pose.chunk(2, dim=1), strict=True):
            x[moved, block] = torch.lerp(x[moved, block], other_block, factor[:, None])

    def _factors(self, rows: int) -> Tensor:
        """(rows,) the factor of each row: spread evenly from -1 to 1 in `share` of the rows, else 0."""
        even = self.spread.numbers(rows, self.batches)
        return torch.where(even < self.share, 2 * even / self.share - 1, 0.0)


def _pose_table(database: Database, clip_keys: Array) -> tuple[Array, Array, Array]:
    """Keys (n,), poses (n, D) and path directions (n, E) of the training rows of clips with hurt versions.

    These are the clips of hurt versions and their healthy originals. Poses and directions are standardised.
    clip_keys: (clips,) key of each clip; clips with a negative key are left out. The key of a row is the key
    of its clip plus the phase. The rows are sorted by key.
    """
    manifest = database.manifest
    blocks, buffers = blocks_without_terrain(database.layout), empty_buffers(manifest, SPLIT, 1)
    pose_columns, direction_columns = (
        np.r_[tuple(blocks[name] for name in names)]
        for names in (("joint_position", "joint_velocity"), ("direction",))
    )
    table_bytes = 4 * (len(pose_columns) + len(direction_columns)) * manifest.row_count(SPLIT)  # float32
    row_step = max(1, math.ceil(table_bytes / TABLE_BYTES))
    parts = [
        (  # arrays without rows, so that there is something to concatenate
            np.empty(0),
            np.empty((0, len(pose_columns)), np.float32),
            np.empty((0, len(direction_columns)), np.float32),
        ),
        *(
            _chunk_table(
                database.load(SPLIT, [number], buffers),
                clip_keys,
                pose_columns,
                direction_columns,
                database,
                row_step,
            )
            for number in range(len(manifest.chunks[SPLIT]))
        ),
    ]
    key, poses, directions = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(key, kind="stable")
    return key[order], poses[order], directions[order]


def _chunk_table(
    window: ChunkWindow,
    clip_keys: Array,
    pose_columns: np.ndarray,
    direction_columns: np.ndarray,
    database: Database,
    row_step: int,
) -> tuple[Array, Array, Array]:
    """The arrays of `_pose_table` for one chunk, not sorted, with every `row_step`-th row of the clips.

    window: the rows of the chunk. pose_columns, direction_columns: columns of X without terrain. Joint
    heights are measured from the mean ground height of the row's first terrain fit.
    """
    key = clip_keys[window.clip] + window.phase
    chosen = np.flatnonzero(key >= 0)[::row_step]
    x = to_floats(window.x[chosen]).astype(np.float32)
    lift = to_floats(window.fits[window.first_fit[chosen]]).astype(np.float32)[:, -1:]
    lower_joints(
        x, blocks_without_terrain(database.layout)["joint_position"], lift, _without_terrain_std(database)
    )
    return key[chosen], x[:, pose_columns], x[:, direction_columns]


def _without_terrain_std(database: Database) -> Array:
    """(columns,) standard deviations of X without its terrain columns."""
    return np.delete(database.statistics.x_std, database.layout.x_terrain)
