"""Roll-outs: a network continues from its own poses, with the path and the other inputs of a clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. The result of a roll-out does not depend on the others, to the last bit. A short roll-out is the
beginning of a longer one from the same frame, so only the longest from each frame is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hobble.character.rule import joint_place, moving, phase_change
from hobble.core.quat import Array
from hobble.evaluation.captured import rotate_by_yaw
from hobble.models.network import Predictor
from hobble.rows.clip_rows import ClipRows, pairs
from hobble.rows.layout import GAITS, RowLayout

BATCH = 256  # poses predicted at once; with more, their inputs do not fit the cache


@dataclass(frozen=True)
class RollOutInputs:
    """The inputs and targets of F consecutive frames of a clip, on the first terrain fit of each frame.

    x: (F, X) inputs with the captured joints. y: (F, Y) targets. Both are in raw units, with joint heights
    minus `mean` (F,), the mean ground height. phase: (F,) in cycles. turn: (F,) radians and velocity: (F, 2)
    cm, of the root until the next frame. moving: (F,) the share of the predicted movement that is applied,
    see `hobble.character.rule.moving`.
    """

    x: Array
    y: Array
    mean: Array
    phase: Array
    turn: Array
    velocity: Array
    moving: Array


def inputs_of_clip(rows: ClipRows, chosen: np.ndarray, layout: RowLayout) -> RollOutInputs:
    """The inputs of the rows `chosen` (F,), on the first fit of each, in the network's `layout`."""
    fit = rows.first_fit[chosen]
    x, y, *_ = pairs(rows, layout, chosen, fit)
    gait = x[:, layout.x_gait].reshape(len(x), len(GAITS), layout.samples)
    stand = gait[:, GAITS.index("stand"), layout.samples // 2]
    return RollOutInputs(
        x,
        y,
        rows.mean[fit].astype(np.float32),
        rows.p[chosen].astype(float),
        y[:, layout.y_turn][:, 0].astype(float),
        y[:, layout.y_root_velocity].astype(float),
        moving(stand),
    )


@dataclass(frozen=True)
class RollOuts:
    """Roll-outs over `length` frames of the stretch `given`. starts: (n,) their first frames, ascending."""

    inputs: RollOutInputs
    starts: np.ndarray
    length: int


class Crowd:
    """Computes all roll-outs of some groups together. Iterate over `frames` once, then call `phases`.

    It computes R roll-outs: the longest from each start frame. The arrays `first`, `stop`, `phase`, `place`,
    `speed` and `memory` have a row for each of them. of: for each group, the rows (n,) of its roll-outs.
    """

    def __init__(self, predictor: Predictor, groups: Sequence[RollOuts]) -> None:
        self.predictor, self.groups = predictor, groups
        stretches = list({id(group.inputs): group.inputs for group in groups}.values())
        begins = np.cumsum([0, *(len(inputs.x) for inputs in stretches)])
        begin = {id(inputs): int(at) for inputs, at in zip(stretches, begins[:-1], strict=True)}
        self.x, self.y, self.mean, phase, self.turn, self.velocity, self.moving = (
            np.concatenate([getattr(inputs, name) for inputs in stretches])
            for name in ("x", "y", "mean", "phase", "turn", "velocity", "moving")
        )
        firsts = [begin[id(group.inputs)] + group.starts for group in groups]
        stops = [
            begin[id(group.inputs)] + np.minimum(group.starts + group.length, len(group.inputs.x))
            for group in groups
        ]
        self.first, each = np.unique(np.concatenate(firsts), return_inverse=True)
        self.of = np.split(each, np.cumsum([len(first) for first in firsts])[:-1])
        self.stop = np.zeros_like(self.first)
        np.maximum.at(self.stop, each, np.concatenate(stops))
        self.phase = phase[self.first]
        self._phases = [self.phase[of] for of in self.of]
        layout = predictor.network.layout
        joints = (len(self.first), layout.joints, 3)
        self.place = self.x[self.first][:, layout.x_joint_position].reshape(joints).astype(float)
        self.speed = np.zeros(joints)
        self.memory = np.zeros((len(self.first), predictor.network.memory))

    def frames(self) -> Iterator[tuple[np.ndarray, Array, dict[int, np.ndarray]]]:
        """Yield, for each number of frames since the start, the n roll-outs that are not yet over.

        Each item has three parts. (n,): frames, as indices into `y`. (n, J, 3): joints in the root
        coordinates of that frame, heights minus its mean, cm. Group index -> which of the n belong to the
        group; a group whose roll-outs are all over is left out. Those of a group are its first ones, because
        roll-outs that start later reach the end of the stretch after fewer frames.
        """
        place = np.full(len(self.first), -1)
        for age in range(max((group.length for group in self.groups), default=0)):
            alive = np.flatnonzero(self.first + age < self.stop)
            if not len(alive):
                return
            at = self.first[alive] + age
            place[:] = -1
            place[alive] = np.arange(len(alive))
            joints = self._advanced(alive, at, age > 0)
            places = {}
            for g, (group, of) in enumerate(zip(self.groups, self.of, strict=True)):
                if age < group.length and len(own := place[of][place[of] >= 0]):
                    places[g] = own
                    self._phases[g] = self.phase[of]
            yield at, joints, places

    def phases(self) -> list[Array]:
        """(n,) phase of each roll-out after its last frame, for each group."""
        return self._phases

    def _advanced(self, alive: np.ndarray, at: np.ndarray, own: bool) -> Array:
        """Predict the roll-outs `alive` (n,) at frames `at` (n,), update their state, return their joints.

        own: whether the input pose is the roll-out's own (else the captured one).
        """
        layout = self.predictor.network.layout
        row = self.x[at]
        if own:
            # Joint heights are relative to the mean ground height of the last frame. Make them relative to
            # that of this frame.
            lower = self.place[alive]
            lower[..., 1] += (self.mean[at - 1] - self.mean[at])[:, None]
            row[:, layout.x_joint_position] = lower.reshape(len(at), -1)
            row[:, layout.x_joint_velocity] = self.speed[alive].reshape(len(at), -1)
        y = self._predicted(row, alive)
        before = row[:, layout.x_joint_position].reshape(len(at), -1, 3).astype(float)
        speed = y[:, layout.y_joint_velocity].reshape(len(at), -1, 3).astype(float)
        guess = y[:, layout.y_joint_position].reshape(len(at), -1, 3)
        place: Array = joint_place(self._carried(before, at) + speed, guess)
        self.place[alive], self.speed[alive] = place, speed
        moved = phase_change(self.moving[at], y[:, layout.y_phase_change][:, 0])
        self.phase[alive] = np.mod(self.phase[alive] + moved, 1.0)
        return place

    def _predicted(self, row: Array, alive: np.ndarray) -> Array:
        """Predict Y (n, Y) for X (n, X), a batch at a time, and update the network's `memory`."""
        y = np.empty((len(row), self.predictor.network.layout.y_size), np.float32)
        for first in range(0, len(row), BATCH):
            part = slice(first, first + BATCH)
            kept = {"memory": self.memory[alive[part]]} if self.predictor.network.memory else {}
            y[part] = self.predictor.predict(row[part], self.phase[alive[part]], **kept)
            if kept:
                self.memory[alive[part]] = kept["memory"]
        return y

    def _carried(self, place: Array, at: np.ndarray) -> Array:
        """Joints (n, J, 3) converted from the root coordinates of frames at - 1 to those of frames `at`."""
        out = place.copy()
        level = place[..., ::2] - self.velocity[at - 1][:, None]
        out[..., ::2] = rotate_by_yaw(level, self.turn[at - 1][:, None])
        return out
