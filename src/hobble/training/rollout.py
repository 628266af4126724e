"""Roll-outs in training: the network's own errors are added to its input poses, as at run time."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.database.reader import Database
from hobble.runtime.rule import joint_place


class RollOut:
    """Adds to the pose in X the errors that the network would have accumulated; Y is unchanged.

    At run time a joint's next position is the mean of two: the predicted position, and the old position plus
    the predicted velocity. Let d be the present error of the joint's position, and p and v the errors of the
    predicted position and velocity. In the next frame the joint's position is off by (d + v + p) / 2, and its
    velocity by v. (The turn of the root between the frames, a few hundredths of a radian, is ignored.)

    Each place in a batch carries its errors to the same place in the next batch. There the row is usually of
    another clip, because rows are shuffled. The errors still have a realistic size and pattern over the
    joints. (If each row got the errors of its own past, the network would learn this past by heart, and the
    error on held-out clips would grow.)

    frames: length of a roll-out. Its first pose is the captured one, so 1 changes nothing. batch: largest
    number of this process's rows in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, frames: int, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, s = database.layout, database.statistics
        self.frames, self.first = frames, first
        self.x_position, self.x_velocity = layout.x_joint_position, layout.x_joint_velocity
        self.y_position, self.y_velocity = layout.y_joint_position, layout.y_joint_velocity
        # Factors that turn errors in standardised Y into errors in standardised X. For example,
        # `position_of_velocity` is for the error that a velocity in Y causes in a position in X.
        self.position_of_position, self.position_of_velocity, self.velocity_of_velocity = (
            torch.from_numpy(s.y_std[y_block] / s.x_std[x_block]).to(device, torch.float32)
            for x_block, y_block in (
                (self.x_position, self.y_position),
                (self.x_position, self.y_velocity),
                (self.x_velocity, self.y_velocity),
            )
        )
        # The present errors in standardised X, for each place in the batch.
        self.position, self.velocity = (
            torch.zeros(batch, 3 * layout.joints, device=device) for _ in range(2)
        )
        self.batches = 0

    def begin_section(self) -> None:
        """Set all errors to 0, so that a section does not depend on the previous one."""
        self.position.zero_()
        self.velocity.zero_()
        self.batches = 0

    def add(self, x: Tensor) -> None:
        """Add the errors to standardised inputs x (B, X) in place."""
        if self.frames > 1:
            x[:, self.x_position] += self.position[: len(x)]
            x[:, self.x_velocity] += self.velocity[: len(x)]

    def remember(self, error: Tensor) -> None:
        """Advance the errors by a frame. error: (B, Y) prediction minus Y of this batch, standardised."""
        if self.frames == 1:
            return
        rows = len(error)
        position, velocity = error[:, self.y_position], error[:, self.y_velocity]
        added = position * self.position_of_position + velocity * self.position_of_velocity
        self.position[:rows] = joint_place(self.position[:rows], added)  # (d + p + v) / 2
        torch.mul(velocity, self.velocity_of_velocity, out=self.velocity[:rows])
        self.batches += 1
        # After each batch, the roll-outs of every `frames`-th place end, so that not all end at once.
        ended = slice((self.batches - self.first) % self.frames, None, self.frames)
        self.position[ended] = 0
        self.velocity[ended] = 0
