"""Roll-outs: a network continues from its own poses, with the path and the other inputs of a clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. Computed with others or alone, a roll-out is the same to the last bit. A short roll-out is the
beginning of a longer one from the same frame, so only the longest from each frame is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hobble.character.rule import joint_place, movement_share, phase_change
from hobble.core.quat import Array
from hobble.evaluation.captured import rotate_by_yaw
from hobble.models.network import Predictor
from hobble.rows.clip_rows import ClipRows, pairs
from hobble.rows.layout import GAITS, RowLayout

BATCH = 256  # poses predicted at once; with more, their inputs do not fit into the cache


@dataclass(frozen=True)
class RollOutInputs:
    """The inputs and targets of F consecutive frames of a clip, on the first terrain fit of each frame.

    x: (F, X) inputs with the captured joints. y: (F, Y) targets. Both are in raw units, with joint heights
    relative to the mean ground height. mean: (F,) this ground height, cm. phase: (F,) in cycles. turn: (F,)
    radians, and velocity: (F, 2) cm, by which the root turns and moves until the next frame. moving: (F,)
    the share of the predicted movement that is applied, see `hobble.character.rule.movement_share`.
    """

    x: Array
    y: Array
    mean: Array
    phase: Array
    turn: Array
    velocity: Array
    moving: Array


def inputs_of_clip(rows: ClipRows, chosen: np.ndarray, layout: RowLayout) -> RollOutInputs:
    """The inputs of the rows `chosen` (F,), on the first terrain fit of each, in the network's `layout`."""
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
        movement_share(stand),
    )


@dataclass(frozen=True)
class RollOuts:
    """A group of n roll-outs over `length` frames in one stretch of consecutive frames.

    inputs: of all frames of the stretch. starts: (n,) index in the stretch of each roll-out's first frame,
    ascending.
    """

    inputs: RollOutInputs
    starts: np.ndarray
    length: int


class Crowd:
    """Computes the roll-outs of several groups together. Iterate over `frames` once, then call `phases`.

    It computes R roll-outs: the longest from each start frame. x, y, mean, turn, velocity, moving: the fields
    of `RollOutInputs`, for the frames of all stretches one after another. first, stop: (R,) index in `x` of
    the first frame of a roll-out, and of the frame after its last. The present state of the roll-outs:
    phase (R,); place, speed (R, J, 3), positions and velocities of the joints; memory (R, M), what the
    network keeps between frames. of: for each group, the indices (n,) of its roll-outs among the R.
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

        An item is (at, joints, members). at: (n,) their present frames, as indices into `y`. joints:
        (n, J, 3) cm, in the root coordinates of these frames, heights relative to the mean ground height.
        members: group index -> which of the n belong to the group. In each group, the first roll-outs last
        longest, because later ones reach the end of the stretch after fewer frames. A group is left out when
        all its roll-outs are over.
        """
        index = np.full(len(self.first), -1)  # index of each roll-out among the n; -1 if it is over
        for age in range(max((group.length for group in self.groups), default=0)):
            alive = np.flatnonzero(self.first + age < self.stop)
            if not len(alive):
                return
            at = self.first[alive] + age
            index[:] = -1
            index[alive] = np.arange(len(alive))
            joints = self._advanced(alive, at, age > 0)
            members = {}
            for g, (group, of) in enumerate(zip(self.groups, self.of, strict=True)):
                if age < group.length and len(not_over := index[of][index[of] >= 0]):
                    members[g] = not_over
                    self._phases[g] = self.phase[of]
            yield at, joints, members

    def phases(self) -> list[Array]:
        """For each group, the phases (n,) of its roll-outs after their last frames."""
        return self._phases

    def _advanced(self, alive: np.ndarray, at: np.ndarray, continues: bool) -> Array:
        """Predict a frame of the roll-outs `alive` (n,), update their state, return their joints (n, J, 3).

        at: (n,) indices of their frames. continues: whether their input has the joints that they predicted in
        the frame before; else it has the captured joints.
        """
        layout = self.predictor.network.layout
        row = self.x[at]
        if continues:
            # Joint heights are relative to the mean ground height of the frame before. Make them relative to
            # the mean ground height of this frame.
            joints = self.place[alive]
            joints[..., 1] += (self.mean[at - 1] - self.mean[at])[:, None]
            row[:, layout.x_joint_position] = joints.reshape(len(at), -1)
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
        """Convert joint positions from the root coordinates of frames at - 1 to those of frames `at`.

        place: (n, J, 3). at: (n,).
        """
        out = place.copy()
        horizontal = place[..., ::2] - self.velocity[at - 1][:, None]
        out[..., ::2] = rotate_by_yaw(horizontal, self.turn[at - 1][:, None])
        return out
