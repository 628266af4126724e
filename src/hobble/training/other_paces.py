"""Plays rows at other paces along smooth paths, so that neither speed nor path shows who walks."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.reader import Database

RISE = 0.5  # largest change of the pace from the middle of the window to its end, as a share of the pace
# Each row gets three numbers: for the pace, for its change, and for how smooth the path becomes. Each number
# is the fractional part of place * step of place + batch * step of batch, with the row's place in the batch
# and the number of the batch. As the steps are irrational, the numbers are spread evenly over 0..1.
STEPS_OF_PLACE = (math.sqrt(3) - 1, math.sqrt(7) - 2, math.sqrt(11) - 3)
STEPS_OF_BATCH = (math.sqrt(13) - 3, math.sqrt(17) - 4, math.sqrt(19) - 4)


class OtherPaces:
    """Plays each row's motion slower or faster, and moves its path towards a smooth one. X and Y both change.

    If the clips have few people, each at one speed, the speed in the input shows who walks. So does the sway
    of the path in each step. At run time the character has another speed and a straighter path, so the
    network takes it for somebody else, and the walk changes with the speed. With these rows anybody walks at
    any speed.

    The time t in the window, which has T frames on each side, becomes r t (1 + a t / T). Here log(r) is
    between -log(factor) and log(factor), and 2 a is between -RISE and RISE. Trajectory, gait and ground are
    interpolated at the new times. Past the ends of the window, positions continue straight, and directions,
    gait and ground keep their last values. Velocities, turn and change of phase are multiplied by r. Then the
    path moves towards the nearest parabola, by 0 to 1 times the way. log(r), a and this factor are spread
    evenly over the places of a batch and over batches.

    factor: largest r; 1 changes nothing, not even the path. batch: largest number of this process's rows in a
    batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, factor: float, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, statistics = database.layout, database.statistics
        self.layout, self.log_factor = layout, math.log(factor)
        self.x_std, self.x_mean, self.y_std, self.y_mean = (
            torch.from_numpy(part).to(device, torch.float32)
            for part in (statistics.x_std, statistics.x_mean, statistics.y_std, statistics.y_mean)
        )
        blocks = [layout.x_channel(name) for name, _ in layout.channels]
        self.channel_columns = [torch.arange(block.start, block.stop, device=device) for block in blocks]
        time = np.arange(layout.samples) / (layout.samples // 2) - 1.0  # -1 at the first sample, 0 now
        # Matrices that replace the samples of a path by the nearest parabola. The one for positions needs no
        # constant term, because they are 0 in the present frame.
        self.smooth_position, self.smooth_direction = (
            torch.from_numpy(_projection(np.stack([time**k for k in powers], axis=1))).to(
                device, torch.float32
            )
            for powers in ((1, 2), (0, 1, 2))
        )
        places = first + torch.arange(batch, device=device).double()
        self.place_terms = torch.stack([places * step for step in STEPS_OF_PLACE])
        self.batch_steps = torch.tensor(STEPS_OF_BATCH, device=device, dtype=torch.float64)[:, None]
        self.batches = 0

    def begin_section(self) -> None:
        """Count batches from 0 again, so that a section does not depend on the previous one."""
        self.batches = 0

    def play(self, x: Tensor, y: Tensor) -> None:
        """Change standardised inputs x (B, X) and outputs y (B, Y) in place."""
        if not self.log_factor or not len(x):
            return
        even = torch.remainder(self.place_terms[:, : len(x)] + self.batches * self.batch_steps, 1.0)
        self.batches += 1
        even_pace, even_rise, smoothness = even.to(x.dtype)[:, :, None]
        # r and a of the class's docstring.
        pace, rise = torch.exp((2 * even_pace - 1) * self.log_factor), (2 * even_rise - 1) * RISE / 2
        channels = [x[:, columns] for columns in self.channel_columns]
        # Channels get their old values back below. A channel that never varies is standardised by so large a
        # deviation that multiplying and dividing by it loses the value.
        raw_x, raw_y = x * self.x_std + self.x_mean, y * self.y_std + self.y_mean
        self._play_window(raw_x, raw_y, pace, rise)
        self._play_frame(raw_x, raw_y, pace)
        self._smooth(raw_x, smoothness)
        x.copy_((raw_x - self.x_mean) / self.x_std)
        y.copy_((raw_y - self.y_mean) / self.y_std)
        for columns, values in zip(self.channel_columns, channels, strict=True):
            x[:, columns] = values

    def _play_window(self, x: Tensor, y: Tensor, pace: Tensor, rise: Tensor) -> None:
        """Replace trajectory, gait and ground by those at the new times. pace, rise: (B, 1) r and a.

        Heights stay relative to the mean ground height under the path.
        """
        layout, n = self.layout, self.layout.samples
        blocks = [(layout.x_position, False), (layout.x_direction, True), (layout.x_gait, True)]
        for block, keep_last in [*blocks, (layout.x_terrain, True)]:
            x[:, block] = _interpolate(x[:, block], n, layout.future, pace, rise, keep_last)
        for block, keep_last in ((layout.y_position, False), (layout.y_direction, True)):
            y[:, block] = _interpolate(y[:, block], layout.future, layout.future, pace, rise, keep_last)
        ground = x[:, layout.x_terrain]
        mean = ground[:, n : 2 * n].mean(dim=1, keepdim=True)  # of the samples on the path, between the sides
        ground -= mean
        x[:, layout.x_joint_position][:, 1::3] -= mean
        y[:, layout.y_joint_position][:, 1::3] -= mean

    def _play_frame(self, x: Tensor, y: Tensor, pace: Tensor) -> None:
        """Multiply what happens in a frame by the pace.

        The pose in x is that of the previous frame. It moves so that the joints' way from it to the pose in y
        is multiplied, too.
        """
        layout = self.layout
        before, now = x[:, layout.x_joint_position], y[:, layout.y_joint_position]
        before += (1 - pace) * (now - before)
        x[:, layout.x_joint_velocity] *= pace
        for block in (layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_joint_velocity):
            y[:, block] *= pace

    def _smooth(self, x: Tensor, share: Tensor) -> None:
        """Move the path in x by the share (B, 1) of the way to the nearest parabola."""
        layout = self.layout
        for block, nearest in (
            (layout.x_position, self.smooth_position),
            (layout.x_direction, self.smooth_direction),
        ):
            path = x[:, block].unflatten(1, (2, layout.samples))
            x[:, block] = torch.lerp(path, path @ nearest.T, share[:, :, None]).flatten(1)


def _projection(powers: Array) -> Array:
    """(n, n) the matrix that projects n values onto the columns of `powers` (n, k), by least squares.

    The result is the nearest polynomial if the columns are powers of the time.
    """
    return powers @ np.linalg.pinv(powers)


def _interpolate(
    values: Tensor, samples: int, half: int, pace: Tensor, rise: Tensor, keep_last: bool
) -> Tensor:
    """Interpolate values (B, columns * samples) at the new times. pace, rise: (B, 1) r and a.

    samples: number of samples of `values`, which cover the whole window or its second half. half: samples in
    half of the window. keep_last: whether values stay constant past the ends of the window; else they
    continue straight.
    """
    table, now = values.unflatten(1, (-1, samples)), samples - half  # now: index of the present frame
    time = torch.arange(samples, device=values.device) - now
    place = now + pace * time * (1 + rise * time / half)
    if keep_last:
        place = place.clamp(0, samples - 1)
    below = place.floor().clamp(0, samples - 2)
    index = below.long()[:, None].expand(-1, table.shape[1], -1)
    share = (place - below)[:, None].to(values.dtype)
    return torch.lerp(table.gather(2, index), table.gather(2, index + 1), share).flatten(1)
