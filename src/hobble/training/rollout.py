"""Roll-outs in training: poses that carry the network's own errors, as a running character's do."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.character.rule import joint_place
from hobble.database.reader import Database


class RollOut:
    """Adds to the pose in X what the network's own errors would have made of it; Y stays as it is.

    A character's next joints come to lie half way between where the predicted velocities carry them and
    where they are predicted. So if they were d off, and the network errs by v in velocities and by p in
    positions, they are (d + v + p) / 2 off in the next frame, and their velocities v. (How the root turned
    meanwhile, a few hundredths of a radian, is left out.)

    Each place in a batch is a roll-out over the rows that come to stand there, in any order: what goes on
    from one to the next is how large errors grow and which joints err together. (With the errors of its own
    past a row is learnt by heart, and held-out clips fare worse.)

    frames: how long a roll-out is; its first pose is the recorded one, so 1 changes nothing. batch: the most
    rows of a batch. first: the place of the first of them, where other processes have those before.
    """

    def __init__(
        self, database: Database, frames: int, batch: int, device: torch.device, first: int = 0
    ) -> None:
        layout, s = database.layout, database.statistics
        self.frames, self.first = frames, first
        self.x_place, self.x_speed = layout.x_joint_position, layout.x_joint_velocity
        self.y_place, self.y_speed = layout.y_joint_position, layout.y_joint_velocity
        # Standard deviations of Y in those of X.
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
        """Forget, so that a section does not depend on the one before."""
        self.place.zero_()
        self.speed.zero_()
        self.batches = 0

    def add(self, x: Tensor) -> None:
        """Change standardised inputs x (B, X) in place."""
        if self.frames > 1:
            x[:, self.x_place] += self.place[: len(x)]
            x[:, self.x_speed] += self.speed[: len(x)]

    def remember(self, error: Tensor) -> None:
        """Go on by a frame with the errors (B, Y) of the standardised output, prediction minus truth."""
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
