"""The network's own errors in the pose that it is given, as a running character meets them."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.database.reader import Database


class Feedback:
    """Adds errors that the network has just made to the previous pose in its next inputs; Y stays as it is.

    A running character feeds its own pose back, and a network that has only seen recorded ones has not learnt
    the way back from its own. Noise that is independent from joint to joint does not look like them; the
    errors of the batch before, each row's on the row in the same place (any two, since rows are shuffled),
    do. amount: how many times an error is added, since over frames they add up; 0 adds nothing.
    """

    def __init__(self, database: Database, amount: float, device: torch.device) -> None:
        layout, s = database.layout, database.statistics
        self.amount = amount
        self.of_x = slice(layout.x_joint_position.start, layout.x_joint_velocity.stop)
        self.of_y = slice(layout.y_joint_position.start, layout.y_joint_velocity.stop)
        ratio = amount * s.y_std[self.of_y] / s.x_std[self.of_x]  # joints left out of X have almost none
        self.ratio = torch.from_numpy(ratio).to(device, torch.float32)
        self.last: Tensor | None = None

    def begin(self) -> None:
        """Forget, so that a section does not depend on the one before."""
        self.last = None

    def add(self, x: Tensor) -> None:
        """Change standardised inputs x (B, X) in place."""
        if self.amount and self.last is not None:
            rows = min(len(x), len(self.last))
            x[:rows, self.of_x].addcmul_(self.last[:rows, self.of_y], self.ratio)

    def remember(self, error: Tensor) -> None:
        """The errors (B, Y) of the standardised output, prediction minus truth, as just made."""
        self.last = error
