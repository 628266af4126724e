"""Moves input poses towards poses with other channel values, so that a network has to use its channels."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.database.reader import Database
from hobble.rows.layout import GAITS
from hobble.training.even_spread import EvenSpread

REMEMBERED_ROWS = 32  # number of earlier rows that each place in a batch remembers
NEAR = 1 / 16  # poses are mixed only if their phases differ by less than this, in cycles
SAME_GAIT = 0.5  # poses are mixed only if the share of each gait differs by less than this
BEYOND = 0.5  # a pose may also move away from the other pose, by up to this share of the distance
OTHER_VALUE = 1e-3  # standardised channel values that differ by more than this count as different


class OtherPoses:
    """Moves the pose in some rows of X towards the pose of a row with other channel values. Y is unchanged.

    If a channel is constant in a clip, such as a mood, all poses of the clip show the channel's value, too.
    Then a network can ignore the channel and continue the walk that it sees, and a character keeps the walk
    that its pose has drifted to. For example, a network was trained without moved poses on 24 people with one
    of three diagnoses or none. Its character walked like another group than the requested one. With moved
    poses, only the channels tell which walk Y belongs to.

    Each place in a batch remembers only its own earlier rows, so several processes give the same rows as one.
    Of the remembered rows with the same gait and other channel values, the one with the nearest phase is
    chosen. The pose moves by -BEYOND to 1 times the way to the pose of the chosen row. These factors are
    spread evenly over places and batches. With a negative factor, the pose becomes more extreme than any
    captured one, and the network learns the way back. Without such poses a character that leaned forward
    leaned more and more.

    share: share of the rows that are moved; 0 changes nothing. batch: largest number of this process's rows
    in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, share: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, middle = database.layout, database.layout.samples // 2
        self.share = share if batch and layout.channels else 0.0
        blocks = (layout.x_joint_position, layout.x_joint_velocity)
        # Columns of X: those of the pose, the share of each gait in the present frame, and the channels.
        self.pose_columns = torch.cat([torch.arange(b.start, b.stop) for b in blocks]).to(device)
        start, samples = layout.x_gait.start, layout.samples
        present = [start + gait * samples + middle for gait in range(len(GAITS))]
        self.gait_columns = torch.tensor(present, device=device)
        std = torch.from_numpy(database.statistics.x_std).to(device, torch.float32)
        self.gait_std = std[self.gait_columns]
        columns = [torch.arange(0)] + [
            torch.arange(layout.x_size)[layout.x_channel(name)] for name, _ in layout.channels
        ]
        self.channel_columns = torch.cat(columns).to(device)
        self.places = torch.arange(batch, device=device)
        self.spread = EvenSpread(batch, device, first)
        rows = batch if self.share else 0
        # The remembered rows of each place. A new row replaces the oldest one.
        self.poses, self.gaits, self.channels = (
            torch.zeros(rows, REMEMBERED_ROWS, len(columns), device=device)
            for columns in (self.pose_columns, self.gait_columns, self.channel_columns)
        )
        self.phases = torch.full((rows, REMEMBERED_ROWS), torch.nan, device=device)  # nan: no row yet
        self.batches = 0

    def begin_section(self) -> None:
        """Forget all rows, so that a section does not depend on the previous one."""
        self.phases.fill_(torch.nan)
        self.batches = 0

    def mix(self, x: Tensor, p: Tensor) -> None:
        """Move the poses of standardised inputs x (B, X) in place. p: (B,) phases, 0 to 1."""
        if not self.share or not len(x):
            return
        rows, slot = len(x), self.batches % REMEMBERED_ROWS
        pose, values = x[:, self.pose_columns], x[:, self.channel_columns]
        gait = x[:, self.gait_columns] * self.gait_std  # not standardised, apart from a constant
        same_gait = (gait[:, None] - self.gaits[:rows]).abs().amax(dim=2) < SAME_GAIT
        other_value = (values[:, None] - self.channels[:rows]).abs().amax(dim=2) > OTHER_VALUE
        # Difference in phase, at most half a cycle.
        apart = (torch.remainder(p[:, None] - self.phases[:rows] + 0.5, 1.0) - 0.5).abs()
        apart = torch.where(same_gait & other_value & (apart < NEAR), apart, torch.inf)
        nearest, chosen = apart.min(dim=1)
        factor = torch.where(nearest < NEAR, self._factors(rows).to(x.dtype), 0.0)
        other_pose = self.poses[self.places[:rows], chosen]
        x[:, self.pose_columns] = torch.lerp(pose, other_pose, factor[:, None])
        remembered = (self.poses, self.gaits, self.channels, self.phases)
        for table, row in zip(remembered, (pose, gait, values, p), strict=True):
            table[:rows, slot] = row
        self.batches += 1

    def _factors(self, rows: int) -> Tensor:
        """(rows,) how far each pose moves: in `share` of the rows spread evenly from -BEYOND to 1, else 0."""
        even = self.spread.numbers(rows, self.batches)
        factor = 1 - (1 - even) / self.share  # above 0 in `share` of the rows, and there spread from 0 to 1
        return torch.where(factor > 0, factor * (1 + BEYOND) - BEYOND, 0.0)
