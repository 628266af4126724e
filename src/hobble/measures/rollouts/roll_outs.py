"""Roll-outs: a network continues from its own poses, with the path and the other inputs of a clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. A roll-out in a crowd is the same as alone, to the last bit. A short roll-out is the beginning of a
longer one from the same frame, so only the longest roll-out from each frame is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.captured import rotate_by_yaw
from hobble.models.network import Predictor
from hobble.rows.clip_rows import ClipRows, compose_pairs
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime.rule import joint_place, movement_share, phase_change

BATCH = 256  # poses predicted at once; the inputs of more poses do not fit into the processor's cache


@dataclass(frozen=True)
class RollOutInputs:
    """The inputs and targets of F consecutive frames of a clip.

    A frame may have several terrain fits: ground heights that suit the motion. The first fit is used. x: (F,
    X) inputs with the captured joints. y: (F, Y) targets. Both are in raw units, with joint heights relative
    to the mean ground height. ground: (F,) this mean height, cm. phase: (F,) in cycles. turn: (F,) negated
    change of the root's yaw until the next frame, radians. velocity: (F, 2) movement of the root until the
    next frame, cm. moving: (F,) the share of the root's predicted movement that is applied, see
    `hobble.runtime.rule.movement_share`.
    """

    x: Array
    y: Array
    ground: Array
    phase: Array
    turn: Array
    velocity: Array
    moving: Array


def inputs_of_clip(rows: ClipRows, chosen: np.ndarray, layout: RowLayout) -> RollOutInputs:
    """The inputs and targets in some rows of a clip. chosen: (F,) their indices. layout: the network's."""
    fit = rows.first_fit[chosen]
    x, y, *_ = compose_pairs(rows, layout, chosen, fit)
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
    """A group of n roll-outs of `length` frames in one stretch of consecutive frames of a clip.

    inputs: of all frames of the stretch. starts: (n,) index in the stretch of each roll-out's first frame,
    ascending. A roll-out near the end of the stretch is shorter than `length`.
    """

    inputs: RollOutInputs
    starts: np.ndarray
    length: int


class RollOutCrowd:
    """Computes the roll-outs of several groups together. Iterate over `frames` once, then call `phases`.

    It computes R roll-outs: the longest from each start frame. x, y, ground, turn, velocity, moving: the
    fields of `RollOutInputs`, for the frames of all stretches one after another. first, stop: (R,) index in
    `x` of the first frame of a roll-out, and of the frame after its last. of_group: for each group, the
    indices (n,) of its roll-outs among the R.

    The present state of the roll-outs is in phase (R,); joint_position and joint_velocity (R, J, 3), cm and
    cm per frame; memory (R, M), the numbers that the network keeps between frames.
    """

    def __init__(self, predictor: Predictor, groups: Sequence[RollOuts]) -> None:
        self.predictor, self.groups = predictor, groups
        stretches = list({id(group.inputs): group.inputs for group in groups}.values())
        begins = np.cumsum([0, *(len(inputs.x) for inputs in stretches)])
        begin = {id(inputs): int(at) for inputs, at in zip(stretches, begins[:-1], strict=True)}
        self.x, self.y, self.ground, phase, self.turn, self.velocity, self.moving = (
            np.concatenate([getattr(inputs, name) for inputs in stretches])
            for name in ("x", "y", "ground", "phase", "turn", "velocity", "moving")
        )
        firsts = [begin[id(group.inputs)] + group.starts for group in groups]
        stops = [
            begin[id(group.inputs)] + np.minimum(group.starts + group.length, len(group.inputs.x))
            for group in groups
        ]
        self.first, index = np.unique(np.concatenate(firsts), return_inverse=True)
        self.of_group = np.split(index, np.cumsum([len(first) for first in firsts])[:-1])
        self.stop = np.zeros_like(self.first)
        np.maximum.at(self.stop, index, np.concatenate(stops))
        self.phase = phase[self.first]
        self._phases = [self.phase[indices] for indices in self.of_group]
        layout = predictor.network.layout
        shape = (len(self.first), layout.joints, 3)
        self.joint_position = self.x[self.first][:, layout.x_joint_position].reshape(shape).astype(float)
        self.joint_velocity = np.zeros(shape)
        self.memory = np.zeros((len(self.first), predictor.network.memory_size))

    def frames(self) -> Iterator[tuple[np.ndarray, Array, dict[int, np.ndarray]]]:
        """Advance all roll-outs by one frame at a time, and yield the n roll-outs that are not yet over.

        An item is (at, joints, members). at: (n,) present frame of each roll-out, as an index into `x` and
        `y`. joints: (n, J, 3) cm, in the root coordinates of these frames, heights relative to the mean
        ground height. members: index of a group -> indices, among the n, of the group's roll-outs. These are
        always the first roll-outs of the group, because later ones reach the end of the stretch earlier. A
        group is left out when all its roll-outs are over.
        """
        index = np.full(len(self.first), -1)  # index of each roll-out among the n; -1 if it is over
        for age in range(max((group.length for group in self.groups), default=0)):
            alive = np.flatnonzero(self.first + age < self.stop)
            if not len(alive):
                return
            at = self.first[alive] + age
            index[:] = -1
            index[alive] = np.arange(len(alive))
            joints = self._advance(alive, at, age > 0)
            members = {}
            for g, (group, indices) in enumerate(zip(self.groups, self.of_group, strict=True)):
                if age < group.length and len(not_over := index[indices][index[indices] >= 0]):
                    members[g] = not_over
                    self._phases[g] = self.phase[indices]
            yield at, joints, members

    def phases(self) -> list[Array]:
        """For each group, the phases (n,) of its roll-outs after their last frames."""
        return self._phases

    def _advance(self, alive: np.ndarray, at: np.ndarray, continues: bool) -> Array:
        """Predict a frame of n roll-outs and update their state. Returns their joint positions (n, J, 3).

        alive: (n,) indices of the roll-outs. at: (n,) indices of their frames in `x`. continues: whether the
        input has the joints of the roll-out's frame before; else it has the captured joints.
        """
        layout = self.predictor.network.layout
        row = self.x[at]
        if continues:
            # Joint heights are relative to the mean ground height of the frame before. Make them relative to
            # the mean ground height of this frame.
            joints = self.joint_position[alive]
            joints[..., 1] += (self.ground[at - 1] - self.ground[at])[:, None]
            row[:, layout.x_joint_position] = joints.reshape(len(at), -1)
            row[:, layout.x_joint_velocity] = self.joint_velocity[alive].reshape(len(at), -1)
        y = self._predict(row, alive)
        before = row[:, layout.x_joint_position].reshape(len(at), -1, 3).astype(float)
        velocity = y[:, layout.y_joint_velocity].reshape(len(at), -1, 3).astype(float)
        predicted = y[:, layout.y_joint_position].reshape(len(at), -1, 3)
        position: Array = joint_place(self._in_next_frame(before, at) + velocity, predicted)
        self.joint_position[alive], self.joint_velocity[alive] = position, velocity
        moved = phase_change(self.moving[at], y[:, layout.y_phase_change][:, 0])
        self.phase[alive] = np.mod(self.phase[alive] + moved, 1.0)
        return position

    def _predict(self, row: Array, alive: np.ndarray) -> Array:
        """Predict outputs (n, Y) for the inputs `row` (n, X), a batch at a time, and update `memory`."""
        y = np.empty((len(row), self.predictor.network.layout.y_size), np.float32)
        for first in range(0, len(row), BATCH):
            part = slice(first, first + BATCH)
            memory = {"memory": self.memory[alive[part]]} if self.predictor.network.memory_size else {}
            y[part] = self.predictor.predict(row[part], self.phase[alive[part]], **memory)
            if memory:
                self.memory[alive[part]] = memory["memory"]
        return y

    def _in_next_frame(self, position: Array, at: np.ndarray) -> Array:
        """Convert joint positions from the root coordinates of frames at - 1 to those of frames `at`.

        position: (n, J, 3). at: (n,).
        """
        out = position.copy()
        horizontal = position[..., ::2] - self.velocity[at - 1][:, None]
        out[..., ::2] = rotate_by_yaw(horizontal, self.turn[at - 1][:, None])
        return out
