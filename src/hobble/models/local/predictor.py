"""Runs a network gated by local phases, and carries what each character remembers from frame to frame."""

from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.models.predict import BlendPredictor

SHOWN = 0  # index in a character's memory: 1 once it was shown. See `Local.remembered` for what follows.


class LocalPredictor(BlendPredictor):
    """A `Predictor` that carries each character's local phases and rotations from frame to frame."""

    network: Any  # a `Local`

    def evaluate(self, z: Array, phase: Array, out: Array, memory: Array | None = None) -> None:
        """As in `Predictor`. memory: (C, M) float64. With None, what it has is that in z."""
        network, layout = self.network, self.network.layout
        at = network.remembered
        if memory is None:
            super().evaluate(z, phase, out)
            return
        new = ~((memory[:, SHOWN] == 1) & np.isfinite(memory).all(axis=1))
        memory[new, 1:] = network.start
        before = memory[:, 1:]
        z[:, at] = (before.astype(np.float32) - self._x_mean[at]) * self._x_inverse[at]
        super().evaluate(z, phase, out)
        vectors, change = out[:, layout.y_local_phase], out[:, layout.y_local_change]
        phases = next_phases(before[:, : vectors.shape[1]], vectors, change)
        memory[:, 1:] = np.concatenate([phases, out[:, layout.y_joint_rotation]], axis=1)
        memory[:, SHOWN] = 1


def next_phases(before: Array, predicted: Array, change: Array) -> Array:
    """(C, 2 * parts) the local phases of the next frame.

    before, predicted: (C, 2 * parts) vectors now, and those that the network predicts. change: (C, parts)
    predicted change of the angles, cycles. The angle is that of the mean of the predicted vector and the
    turned one, as in Starke et al. 2020. The length is the predicted one: means of vectors are too short.
    """
    count = len(before)
    old, new = before.reshape(count, -1, 2), predicted.astype(float).reshape(count, -1, 2)
    angle = 2 * np.pi * change.astype(float)
    cos, sin = np.cos(angle), np.sin(angle)
    turned = np.stack([old[..., 0] * cos - old[..., 1] * sin, old[..., 0] * sin + old[..., 1] * cos], axis=-1)
    mean = turned + new
    length, wanted = (np.sqrt(np.square(v).sum(axis=-1, keepdims=True)) for v in (mean, new))
    return np.where(length > 1e-6, mean * (wanted / np.maximum(length, 1e-6)), new).reshape(count, -1)
