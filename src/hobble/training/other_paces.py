"""Plays rows at other paces along smooth paths, so that neither speed nor path shows who walks."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hobble.core.quat import Array
from hobble.database.reader import Database

RISE = 0.5  # largest change of the pace from the middle of the window to its end, as a share of the pace
# The fractional parts of the multiples of these irrational numbers are spread evenly over 0..1. Three
# numbers: for the pace, for its change, and for how smooth the path is.
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
    interpolated at the new times. Past the ends of the window, paths continue straight, and the rest keeps
    its last value. Velocities, turn and change of phase are multiplied by r. Then the path moves towards the
    nearest parabola, by 0 to 1 times the way. log(r), a and this factor are spread evenly over the places of
    a batch and over batches.

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
        time = np.arange(layout.samples) / (layout.samples // 2) - 1.0
        # Positions need no constant term, because they are 0 in the present frame.
        self.smooth_position, self.smooth_direction = (
            torch.from_numpy(_nearest(np.stack([time**k for k in powers], axis=1))).to(device, torch.float32)
            for powers in ((1, 2), (0, 1, 2))
        )
        places = first + torch.arange(batch, device=device).double()
        self.spread = torch.stack([places * step for step in STEPS_OF_PLACE])
        self.steps = torch.tensor(STEPS_OF_BATCH, device=device, dtype=torch.float64)[:, None]
        self.batches = 0

    def begin(self) -> None:
        """Start again, so that a section does not depend on the previous one."""
        self.batches = 0

    def play(self, x: Tensor, y: Tensor) -> None:
        """Change standardised inputs x (B, X) and outputs y (B, Y) in place."""
        if not self.log_factor or not len(x):
            return
        even = torch.remainder(self.spread[:, : len(x)] + self.batches * self.steps, 1.0)
        self.batches += 1
        pace, rise, part = even.to(x.dtype)[:, :, None]
        pace, rise = torch.exp((2 * pace - 1) * self.log_factor), (2 * rise - 1) * RISE / 2
        channels = [x[:, columns] for columns in self.channel_columns]
        # Channels are put back below as they were: the deviation of a channel that never varies is so large
        # that multiplying and dividing by it loses the value.
        raw_x, raw_y = x * self.x_std + self.x_mean, y * self.y_std + self.y_mean
        self._play_window(raw_x, raw_y, pace, rise)
        self._play_frame(raw_x, raw_y, pace)
        self._smooth(raw_x, part)
        x.copy_((raw_x - self.x_mean) / self.x_std)
        y.copy_((raw_y - self.y_mean) / self.y_std)
        for columns, values in zip(self.channel_columns, channels, strict=True):
            x[:, columns] = values

    def _play_window(self, x: Tensor, y: Tensor, pace: Tensor, rise: Tensor) -> None:
        """Change trajectory, gait and ground to those at the new times.

        Heights stay relative to the mean ground height under the path.
        """
        layout, n = self.layout, self.layout.samples
        blocks = [(layout.x_position, False), (layout.x_direction, True), (layout.x_gait, True)]
        for block, ends in [*blocks, (layout.x_terrain, True)]:
            x[:, block] = _at(x[:, block], n, layout.future, pace, rise, ends)
        for block, ends in ((layout.y_position, False), (layout.y_direction, True)):
            y[:, block] = _at(y[:, block], layout.future, layout.future, pace, rise, ends)
        ground = x[:, layout.x_terrain]
        mean = ground[:, n : 2 * n].mean(dim=1, keepdim=True)
        ground -= mean
        x[:, layout.x_joint_position][:, 1::3] -= mean
        y[:, layout.y_joint_position][:, 1::3] -= mean

    def _play_frame(self, x: Tensor, y: Tensor, pace: Tensor) -> None:
        """Multiply what happens in a frame by the pace.

        The pose in x is that of the previous frame. It moves nearer to the pose in y, or away from it, to
        match.
        """
        layout = self.layout
        before, now = x[:, layout.x_joint_position], y[:, layout.y_joint_position]
        before += (1 - pace) * (now - before)
        x[:, layout.x_joint_velocity] *= pace
        for block in (layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_joint_velocity):
            y[:, block] *= pace

    def _smooth(self, x: Tensor, part: Tensor) -> None:
        """Move the path in x by `part` (B, 1) of the way to the nearest parabola."""
        layout = self.layout
        for block, nearest in (
            (layout.x_position, self.smooth_position),
            (layout.x_direction, self.smooth_direction),
        ):
            path = x[:, block].unflatten(1, (2, layout.samples))
            x[:, block] = torch.lerp(path, path @ nearest.T, part[:, :, None]).flatten(1)


def _nearest(powers: Array) -> Array:
    """(n, n) the matrix that projects n values onto the columns of `powers` (n, k), by least squares."""
    return powers @ np.linalg.pinv(powers)


def _at(values: Tensor, samples: int, half: int, pace: Tensor, rise: Tensor, ends: bool) -> Tensor:
    """Interpolate values (B, columns * samples) at the new times. pace, rise: (B, 1) r and a.

    samples: of the whole window or of its second half. half: samples in half of the window. ends: whether the
    last value is kept past the ends of the window; else the values continue straight.
    """
    table, middle = values.unflatten(1, (-1, samples)), samples - half
    time = torch.arange(samples, device=values.device) - middle
    place = middle + pace * time * (1 + rise * time / half)
    if ends:
        place = place.clamp(0, samples - 1)
    below = place.floor().clamp(0, samples - 2)
    at = below.long()[:, None].expand(-1, table.shape[1], -1)
    share = (place - below)[:, None].to(values.dtype)
    return torch.lerp(table.gather(2, at), table.gather(2, at + 1), share).flatten(1)
