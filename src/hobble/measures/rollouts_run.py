"""Measures errors of roll-outs: the network continues from its own poses, with the path of a clip.

A roll-out starts at a captured frame and continues for n frames like the runtime. In each later frame, its
input has the joints that the roll-out predicted in the frame before. Each new position is the mean of two:
the predicted position, and the old position plus the predicted velocity. The phase advances by its predicted
change. Trajectory, gait, ground and channels come from the clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. A roll-out in a crowd is the same as alone, to the last bit.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.measures import sample as samples
from hobble.measures.accuracy_run import check_layout, joint_indices, joints_to_measure
from hobble.measures.measure import SPLITS, MeasureInputs, Outcome, Row
from hobble.models.load import load_network
from hobble.models.network import Network, Predictor
from hobble.rows.clip_rows import ClipRows, compose_pairs, rotate_by_yaw, unbroken_stretches
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime.error_calculator import relative_and_distance
from hobble.runtime.trajectory import joint_place, movement_share, phase_change

if TYPE_CHECKING:
    from hobble.measures.rollouts import Options

BATCH = 256  # poses predicted at once; the inputs of more poses do not fit into the processor's cache
LENGTHS = (1, 10, 60, 300)  # frames
# Roll-outs of the same length overlap: each frame is in OVERLAP short roll-outs, or in OVERLAP_OF_LONG long
# ones. Twice as many short ones would change the mean error by less than .2 % (configuration `limp`, 10 and
# 60 frames).
OVERLAP, OVERLAP_OF_LONG = 2, 4
LONG = 100  # frames: a roll-out of this length or more is long
AT_ONCE = 6000  # the roll-outs in about this many rows of clips are computed together, in about 100 MB

log = logging.getLogger("hobble")


@dataclass(frozen=True)
class RollOutInputs:
    """The inputs and targets of F consecutive frames of a clip.

    A frame may have several terrain fits: ground heights that suit the motion. The first fit is used. x: (F,
    X) inputs with the captured joints. y: (F, Y) targets. Both are in raw units, with joint heights relative
    to the mean ground height. ground: (F,) this mean height, cm. phase: (F,) in cycles. turn: (F,) negated
    change of the root's yaw until the next frame, radians. velocity: (F, 2) movement of the root until the
    next frame, cm. moving: (F,) the share of the root's predicted movement that is applied, see
    `hobble.runtime.trajectory.movement_share`.
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


class RollOutCrowd:
    """Computes R roll-outs together. Iterate over `frames` once.

    inputs: of the frames of all roll-outs. first, stop: (R,) index in `inputs` of the first frame of a
    roll-out, and of the frame after its last. The present state of the roll-outs is in phase (R,);
    joint_position and joint_velocity (R, J, 3), cm and cm per frame; memory (R, M), the numbers that the
    network keeps between frames.
    """

    def __init__(
        self, predictor: Predictor, inputs: RollOutInputs, first: np.ndarray, stop: np.ndarray
    ) -> None:
        self.predictor, self.inputs, self.first, self.stop = predictor, inputs, first, stop
        layout = predictor.network.layout
        shape = (len(first), layout.joints, 3)
        self.phase = inputs.phase[first]
        self.joint_position = inputs.x[first][:, layout.x_joint_position].reshape(shape).astype(float)
        self.joint_velocity = np.zeros(shape)
        self.memory = np.zeros((len(first), predictor.network.memory_size))

    def frames(self) -> Iterator[tuple[np.ndarray, np.ndarray, Array]]:
        """Advance all roll-outs by one frame at a time, and yield the n roll-outs that are not yet over.

        An item is (alive, at, joints). alive: (n,) their indices among the R, ascending. at: (n,) present
        frame of each, as an index into `inputs`. joints: (n, J, 3) cm, in the root coordinates of these
        frames, heights relative to the mean ground height.
        """
        for age in range(int((self.stop - self.first).max(initial=0))):
            alive = np.flatnonzero(self.first + age < self.stop)
            at = self.first[alive] + age
            yield alive, at, self._advance(alive, at, age > 0)

    def _advance(self, alive: np.ndarray, at: np.ndarray, continues: bool) -> Array:
        """Predict a frame of n roll-outs and update their state. Returns their joint positions (n, J, 3).

        alive: (n,) indices of the roll-outs. at: (n,) indices of their frames in `inputs`. continues: whether
        the input has the joints of the roll-out's frame before; else it has the captured joints.
        """
        layout = self.predictor.network.layout
        row = self.inputs.x[at]
        if continues:
            # Joint heights are relative to the mean ground height of the frame before. Make them relative to
            # the mean ground height of this frame.
            joints = self.joint_position[alive]
            joints[..., 1] += (self.inputs.ground[at - 1] - self.inputs.ground[at])[:, None]
            row[:, layout.x_joint_position] = joints.reshape(len(at), -1)
            row[:, layout.x_joint_velocity] = self.joint_velocity[alive].reshape(len(at), -1)
        y = self._predict(row, alive)
        before = row[:, layout.x_joint_position].reshape(len(at), -1, 3).astype(float)
        velocity = y[:, layout.y_joint_velocity].reshape(len(at), -1, 3).astype(float)
        predicted = y[:, layout.y_joint_position].reshape(len(at), -1, 3)
        position: Array = joint_place(self._in_next_frame(before, at) + velocity, predicted)
        self.joint_position[alive], self.joint_velocity[alive] = position, velocity
        moved = phase_change(self.inputs.moving[at], y[:, layout.y_phase_change][:, 0])
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
        horizontal = position[..., ::2] - self.inputs.velocity[at - 1][:, None]
        out[..., ::2] = rotate_by_yaw(horizontal, self.inputs.turn[at - 1][:, None])
        return out


@dataclass(frozen=True)
class Stretch:
    """Consecutive frames of a clip or an excerpt. Roll-outs begin in its frames `first` to `stop` - 1."""

    inputs: RollOutInputs
    first: int
    stop: int

    def starts(self, length: int) -> np.ndarray:
        """(n,) the first frames of its roll-outs of a length. They may end after `stop`.

        A frame is in OVERLAP roll-outs, or in OVERLAP_OF_LONG if they are long, or in one if they last only
        one frame. None begins at frame 0, because the root's movement before it is unknown.
        """
        overlap = OVERLAP if length < LONG else OVERLAP_OF_LONG
        return np.arange(max(1, self.first), self.stop, max(1, length // overlap))


def stretches_of(loaded: samples.LoadedPart, layout: RowLayout) -> list[Stretch]:
    """The stretches of consecutive frames in the rows of a clip or an excerpt. layout: the network's."""
    out = []
    for rows in unbroken_stretches(loaded.rows.frame):  # indices of rows
        first, stop = np.searchsorted(rows, (loaded.first, loaded.stop))
        out.append(Stretch(inputs_of_clip(loaded.rows, rows, layout), int(first), int(stop)))
    return out


def roll_out_sums(
    predictor: Predictor, stretches: Sequence[Stretch], joints: Sequence[int], length: int
) -> Array:
    """(S, 7) for each of S stretches, sums over its roll-outs of a length. All are computed together.

    Over the frames: 1, and means over the joints of the relative error, its square, and the position error
    (cm). Over the roll-outs that reach their full length: 1, and in the last frame the position error (cm)
    and the phase error (cycles). joints: indices of the joints to measure.
    """
    sums = np.zeros((len(stretches), 7))
    if not stretches:
        return sums
    inputs = RollOutInputs(
        *(np.concatenate([getattr(s.inputs, f.name) for s in stretches]) for f in fields(RollOutInputs))
    )
    bounds = np.cumsum([0, *(len(s.inputs.x) for s in stretches)])  # in `inputs`
    starts = [stretch.starts(length) for stretch in stretches]
    which = np.repeat(np.arange(len(stretches)), list(map(len, starts)))  # stretch of each roll-out
    first, ends = np.concatenate(starts) + bounds[which], bounds[which + 1]
    crowd = RollOutCrowd(predictor, inputs, first, np.minimum(first + length, ends))
    truth = inputs.y[:, predictor.network.layout.y_joint_position].reshape(len(inputs.y), -1, 3)[:, joints]
    last_cm = np.zeros(len(first))
    for alive, at, positions in crowd.frames():
        relative, cm = np.moveaxis(
            relative_and_distance(truth[at].astype(float), positions[:, joints]), -1, 0
        )
        last_cm[alive] = cm.mean(axis=1)
        of_frames = (np.ones(len(at)), relative.mean(axis=1), (relative**2).mean(axis=1), last_cm[alive])
        np.add.at(sums[:, :4], which[alive], np.column_stack(of_frames))
    # `phase` is that of the frame after a roll-out. Roll-outs that end with the stretch are not counted as
    # ended, because there is no captured phase for this frame.
    ended = first + length < ends
    phase_error = np.abs(np.mod(crowd.phase[ended] - inputs.phase[crowd.stop[ended]] + 0.5, 1.0) - 0.5)
    of_ended = np.column_stack([np.ones(ended.sum()), last_cm[ended], phase_error])
    np.add.at(sums[:, 4:], which[ended], of_ended)
    return sums


def values_of_sums(sums: Array, phase: bool = True) -> dict[str, Any]:
    """Plain data from the sums (7,) of `roll_out_sums`. Values of no frames or no ended roll-outs are None.

    phase: whether the network uses the phase. If not, the phase error has no meaning and is None.
    """
    ended = sums[4]
    return {
        **samples.errors_of_sums(sums),
        "ended": int(ended),
        "last_cm": float(sums[5] / ended) if ended else None,
        "last_phase": float(sums[6] / ended) if ended and phase else None,
    }


def measure_roll_outs(
    inputs: MeasureInputs,
    joint_names: Sequence[str] | None = None,
    lengths: Sequence[int] = LENGTHS,
    sample: samples.Sample | None = None,
) -> Json:
    """The content of rollouts.json: for each of `lengths`, the errors of the splits and of the clips.

    joint_names: the joints to measure; all by default. sample: measure only the roll-outs that begin in its
    excerpts; the result then has the size of the sample in `sample` and half widths of 95 % confidence
    intervals in `interval`. Raises InputError if rows and network have different layouts.
    """
    network, mode = load_network(inputs.weights), inputs.runtime.mode
    predictor, joints = network.predictor(mode), joint_indices(network, joint_names)
    of_parts: dict[int, dict[samples.ClipPart, Array]] = {length: {} for length in lengths}
    for batch in _part_batches(samples.clip_parts(inputs.clips, sample), network, lengths):
        stretches = [stretch for some in batch.values() for stretch in some]
        ends = np.cumsum([len(some) for some in batch.values()])[:-1]
        for length, sums in of_parts.items():
            of_stretches = np.split(roll_out_sums(predictor, stretches, joints, length), ends)
            sums |= {part: own.sum(axis=0) for part, own in zip(batch, of_stretches, strict=True)}
        log.info("rolled out: %s", ", ".join(str(part.excerpt or part.clip) for part in batch))
    values = partial(values_of_sums, phase=network.uses_phase)
    entries = [
        {"length": length, **samples.summed_up(sums, inputs.splits, sample, values, {"position_error_cm": 3})}
        for length, sums in of_parts.items()
    ]
    result = {"configuration": inputs.configuration, "joints": len(joints), "mode": mode, "lengths": entries}
    return samples.with_sample(result, sample)


def _part_batches(
    parts: Iterable[samples.ClipPart], network: Network, lengths: Sequence[int]
) -> Iterator[dict[samples.ClipPart, list[Stretch]]]:
    """Yield a few clips or excerpts at a time, together about AT_ONCE rows, with their stretches."""
    batch: dict[samples.ClipPart, list[Stretch]] = {}
    rows = 0
    for part in parts:
        # A roll-out needs the frame before its start, and max(lengths) frames from its start on. Twice as
        # many rows are read, because a frame that two cycles share has two rows.
        loaded = part.load(before=2, after=2 * max(lengths))
        check_layout(part.path, loaded.rows, network)
        batch[part] = stretches_of(loaded, network.layout)
        rows += len(loaded.rows)
        if rows >= AT_ONCE:
            yield batch
            batch, rows = {}, 0
    if batch:
        yield batch


def roll_out_rows(result: Json) -> list[Row]:
    """A table with a row for each length and split (`clip` is None), and for each length and clip."""
    rows: list[Row] = []
    for entry in result["lengths"]:
        of_splits = [{"clip": None, "split": split, **entry[split]} for split in SPLITS]
        rows += [{"length": entry["length"], **row} for row in (*of_splits, *entry["clips"])]
    return rows


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """rollouts.json, and its rows as a table."""
    joints, sample = joints_to_measure(inputs, options), samples.sample_to_measure(inputs, options)
    result = measure_roll_outs(inputs, joints, options.rollouts, sample)
    return Outcome(result, {"lengths": roll_out_rows(result)})
