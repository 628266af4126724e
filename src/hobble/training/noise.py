"""Noise on the pose that a running character feeds back into its network."""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.database.reader import Database


class Noise:
    """Normal noise on the joint positions and velocities of the previous frame in X; Y stays as it is.

    A network that has only seen recorded poses has not learnt the way back from its own. amount: standard
    deviation of the noise, as a share of what positions and velocities vary by over the training clips (their
    deviation in Y, centimetres, which X divides by its own). Joints left out of X stay out.
    """

    def __init__(self, database: Database, amount: float, device: torch.device) -> None:
        layout, s = database.layout, database.statistics
        self.columns = slice(layout.x_joint_position.start, layout.x_joint_velocity.stop)
        of_y = slice(layout.y_joint_position.start, layout.y_joint_velocity.stop)
        deviation = amount * s.y_std[of_y] / s.x_std[self.columns]
        self.deviation = torch.from_numpy(deviation).to(device, torch.float32)
        self.generator = torch.Generator(device)
        self.amount = amount

    def seed(self, seed: int) -> None:
        """Begin a new sequence, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def add(self, x: Tensor) -> None:
        """Change standardised inputs x (B, X) in place."""
        if self.amount:
            shape = (len(x), len(self.deviation))
            drawn = torch.randn(shape, generator=self.generator, device=x.device, dtype=x.dtype)
            x[:, self.columns].addcmul_(drawn, self.deviation)
