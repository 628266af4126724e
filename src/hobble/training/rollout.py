"""Roll-outs in training: input poses get the network's own errors, as at run time."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.character.rule import joint_place
from hobble.database.reader import Database


class RollOut:
    """Adds the errors that the network would have accumulated to the pose in X; Y is unchanged.

    At run time a joint's next position is the mean of two: the predicted position, and the old position plus
    the predicted velocity. Let d be the present error of its position, and p and v the network's errors in
    position and velocity. In the next frame its position is off by (d + v + p) / 2 and its velocity by v.
    (The turn of the root between the frames, a few hundredths of a radian, is ignored.)

    Each place in a batch carries its errors to the same place in the next batch, usually a row of another
    clip, because rows are shuffled. The errors still have a realistic size and pattern over the joints. (If
    each row got the errors of its own past, the network would learn it by heart, and the error on held-out
    clips would grow.)

    frames: length of a roll-out. Its first pose is the captured one, so 1 changes nothing. batch: largest
    number of this process's rows in a batch. first: the place of its first row in the whole batch.
    """

    def __init__(
        self, database: Database, frames: int, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, s = database.layout, database.statistics
        self.frames, self.first = frames, first
        self.x_place, self.x_speed = layout.x_joint_position, layout.x_joint_velocity
        self.y_place, self.y_speed = layout.y_joint_position, layout.y_joint_velocity
        # Factors from errors in standardised Y to errors in standardised X.
        self.place_of_place, self.place_of_speed, self.speed_of_speed = (
            torch.from_numpy(s.y_std[of_y] / s.x_std[of_x]).to(device, torch.float32)
            for of_x, of_y in (
                (self.x_place, self.y_place),
                (self.x_place, self.y_speed),
                (self.x_speed, self.y_speed),
            )
        )
        self.place, self.speed = (torch.zeros(batch, 3 * layout.joints, device=device) for _ in range(2))
        self.batches = 0

    def begin(self) -> None:
        """Set all errors to 0, so that a section does not depend on the previous one."""
        self.place.zero_()
        self.speed.zero_()
        self.batches = 0

    def add(self, x: Tensor) -> None:
        """Add the errors to standardised inputs x (B, X) in place."""
        if self.frames > 1:
            x[:, self.x_place] += self.place[: len(x)]
            x[:, self.x_speed] += self.speed[: len(x)]

    def remember(self, error: Tensor) -> None:
        """Advance the errors by a frame. error: (B, Y) standardised prediction minus truth of this batch."""
        if self.frames == 1:
            return
        rows = len(error)
        place, speed = error[:, self.y_place], error[:, self.y_speed]
        made = place * self.place_of_place + speed * self.place_of_speed
        self.place[:rows] = joint_place(self.place[:rows], made)
        torch.mul(speed, self.speed_of_speed, out=self.speed[:rows])
        self.batches += 1
        ended = slice((self.batches - self.first) % self.frames, None, self.frames)
        self.place[ended] = 0
        self.speed[ended] = 0
