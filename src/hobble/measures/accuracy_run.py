"""Measures errors of predictions: of the next frame, and of roll-outs, which continue from their own poses.

The relative error is eq. 3.1 of Segerstedt (2021): |t - p| / |t|, where t is the captured and p the predicted
position of a joint relative to the root. Its mean and standard deviation are over frames and joints. For the
errors of one step, the network gets the captured input of every frame, never its own output.

A roll-out starts at a captured frame and continues for n frames like the runtime, with the path of the clip.
In each later frame, its input has the joints that the roll-out predicted in the frame before. Each new
position is the mean of two: the predicted position, and the old position plus the predicted velocity. The
phase advances by its predicted change. Trajectory, gait, ground and channels come from the clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. A roll-out in a crowd is the same as alone, to the last bit.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.measures import sample as samples
from hobble.measures.measure import SPLITS, MeasureInputs, Outcome, Row, flat_rows, mean_and_sd
from hobble.models.load import load_network
from hobble.models.network import Network, Predictor
from hobble.rows.clip_rows import ClipRows, compose_pairs, pair_batches, rotate_by_yaw, unbroken_stretches
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime.error_calculator import relative_and_distance
from hobble.runtime.trajectory import joint_place, movement_share, phase_change

if TYPE_CHECKING:
    from hobble.measures.accuracy import Options

# A prediction of n frames: inputs (n, X) and phases (n,) -> outputs (n, Y), not standardised. X and Y are the
# numbers of input and output columns of the network.
Predict = Callable[[Array, Array], Array]

BATCH = 256  # poses predicted at once; the inputs of more poses do not fit into the processor's cache
# Segerstedt measured at most the first so many joint positions of a clip, in the phase mode `constant`.
PUBLISHED_POSITIONS = 500_000
# With the option `joints: equivalent`, only joints with a counterpart on this skeleton are measured.
REFERENCE = "holden31"
# Roll-outs of the same length overlap: each frame is in OVERLAP short roll-outs, or in OVERLAP_OF_LONG long
# ones. Twice as many short ones would change the mean error by less than .2 % (configuration `limp`, 10 and
# 60 frames).
OVERLAP, OVERLAP_OF_LONG = 2, 4
LONG = 100  # frames: a roll-out of this length or more is long
AT_ONCE = 6000  # the roll-outs in about this many rows of clips are computed together, in about 100 MB

log = logging.getLogger("hobble")


def joint_errors(layout: RowLayout, truth: Array, predicted: Array, joints: Sequence[int]) -> Array:
    """(n, len(joints), 2): relative error, and distance in cm, of the joints with the indices `joints`.

    truth, predicted: (n, Y) captured and predicted outputs, not standardised.
    """
    block = layout.y_joint_position
    t = truth[:, block].reshape(len(truth), -1, 3)[:, joints].astype(np.float64)
    return relative_and_distance(t, predicted[:, block].reshape(len(truth), -1, 3)[:, joints])


def predict_function(network: Network) -> Predict:
    """The runtime's exact prediction, which takes two thirds of the time of `Network.predict`.

    For a network that remembers the earlier frames of a character (`Network.memory_size`), the result is
    `Network.predict`, which needs no memory. Here each frame is predicted on its own.
    """
    if network.memory_size:
        return network.predict
    predictor = network.predictor(storage="float32")

    def predict(x: Array, phase: Array) -> Array:
        phase = phase.astype(float)  # the type at run time; another type would be compiled anew
        starts = range(0, len(x), BATCH)
        return np.concatenate([predictor.predict(x[n : n + BATCH], phase[n : n + BATCH]) for n in starts])

    return predict


def at_stored_phases(network: Network, predict: Predict) -> Predict:
    """`predict` in the phase mode `constant`: phases are rounded down to those whose weights it stores.

    The same function for a network without this mode.
    """
    if "constant" not in network.modes:
        return predict
    stored = network.stored_numbers("constant") // network.parameter_count

    def predict_stored(x: Array, phase: Array) -> Array:
        nearest_below = np.floor(phase.astype(np.float32) * stored)  # float32, as at run time
        return predict(x, np.minimum(nearest_below, stored - 1) / stored)

    return predict_stored


def clip_sums(network: Network, rows: ClipRows, joints: Sequence[int], predict: Predict) -> Array:
    """(4,) sums over the frames of a clip: those of `errors_of_sums`.

    A frame may have several terrain fits (ground heights that suit the motion). It is predicted on each of
    them and counts once, with its mean error. joints: indices of the joints to measure.
    """
    sums = np.zeros(4)
    for pairs in pair_batches(rows, network.layout):
        errors = joint_errors(network.layout, pairs.y, predict(pairs.x, pairs.p), joints)
        relative, cm = errors.reshape(-1, 2).T
        weights = np.repeat(pairs.weight / len(joints), len(joints))  # all weights of a frame add up to 1
        sums += (weights * [np.ones_like(cm), relative, relative**2, cm]).sum(axis=1)
    return sums


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
        self.memory = predictor.network.memory_of(inputs.x[first])

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


def values_of_roll_outs(sums: Array, phase: bool = True) -> dict[str, Any]:
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


def measure_accuracy(
    inputs: MeasureInputs,
    joints: Sequence[int] | None = None,
    sample: samples.Sample | None = None,
    lengths: Sequence[int] = (),
) -> Json:
    """The content of accuracy.json: errors over the frames of each split, and of each clip, sorted by name.

    joints: indices of the joints to measure; all by default. sample: the excerpts to measure in place of all
    clips; then the result also has the size of the sample, and confidence intervals. lengths: of roll-outs.
    In the result, `as_published` has the errors as Segerstedt (2021) measured them: in the phase mode
    `constant`, on the first PUBLISHED_POSITIONS of each clip; of a split, mean and standard deviation (n - 1)
    of the clips' means. It is left out of a sample, whose roll-outs begin in its excerpts. Raises InputError
    if rows and network have different layouts.
    """
    network, splits = load_network(inputs.weights), inputs.splits
    joints, predict = joints or range(network.layout.joints), predict_function(network)
    constant, first_frames = at_stored_phases(network, predict), PUBLISHED_POSITIONS // network.layout.joints
    predictor, published = network.predictor(inputs.runtime.mode), {}
    of_steps: dict[samples.ClipPart, Array] = {}
    of_length: dict[int, dict[samples.ClipPart, Array]] = {length: {} for length in lengths}
    for batch in _part_batches(samples.clip_parts(inputs.clips, sample), network, lengths):
        for part, loaded in batch.items():
            rows = loaded.rows.part(slice(loaded.first, loaded.stop))
            of_steps[part] = clip_sums(network, rows, joints, predict)
            log.info("%s: %s", part.excerpt or part.clip, samples.errors_of_sums(of_steps[part]))
            if sample is None:
                of_first = clip_sums(network, rows.part(slice(first_frames)), joints, constant)
                found = samples.errors_of_sums(of_first)
                published[part.clip] = {key: found[key] for key in ("frames", "mean", "sd")}
        stretches = [stretches_of(loaded, network.layout) for loaded in batch.values()]
        for length, of_parts in of_length.items():
            of_parts |= zip(batch, _sums_of_parts(predictor, stretches, joints, length), strict=True)
    result = samples.summed_up(
        of_steps, splits, sample, samples.errors_of_sums, {"mean": 1, "position_error_cm": 3}
    )
    for clip in result["clips"] if sample is None else ():
        clip["as_published"] = published[clip["clip"]]
    for split in SPLITS if sample is None else ():
        of_split = [published[clip]["mean"] for clip in published if splits[clip] == split]
        mean, sd = mean_and_sd([mean for mean in of_split if mean is not None])
        result[split]["as_published"] = {"mean_of_clips": mean, "sd_of_clips": sd}
    values = partial(values_of_roll_outs, phase=network.uses_phase)
    result["rollouts"] = [
        {"length": length, **samples.summed_up(sums, splits, sample, values, {"position_error_cm": 3})}
        for length, sums in of_length.items()
    ]
    head = {"configuration": inputs.configuration, "joints": len(joints), "mode": inputs.runtime.mode}
    return samples.with_sample({**head, **result}, sample)


def _part_batches(
    parts: Iterable[samples.ClipPart], network: Network, lengths: Sequence[int]
) -> Iterator[dict[samples.ClipPart, samples.LoadedPart]]:
    """Yield a few clips or excerpts at a time, together about AT_ONCE rows, with their rows."""
    batch: dict[samples.ClipPart, samples.LoadedPart] = {}
    for part in parts:
        # A roll-out needs the frame before its start, and max(lengths) frames from its start on. Twice as
        # many rows are read, because a frame that two cycles share has two rows.
        batch[part] = part.load(before=2, after=2 * max(lengths, default=0))
        check_layout(part.path, batch[part].rows, network)
        if sum(len(loaded.rows) for loaded in batch.values()) >= AT_ONCE:
            yield batch
            batch = {}
    if batch:
        yield batch


def _sums_of_parts(
    predictor: Predictor, stretches: Sequence[Sequence[Stretch]], joints: Sequence[int], length: int
) -> list[Array]:
    """The `roll_out_sums` of each part of the clips, summed over its stretches."""
    sums = roll_out_sums(predictor, [each for of_part in stretches for each in of_part], joints, length)
    ends = np.cumsum([len(of_part) for of_part in stretches])[:-1]
    return [own.sum(axis=0) for own in np.split(sums, ends)]


def joints_to_measure(network: Network, skeleton: Json, joints: str) -> list[int]:
    """Indices of the joints to measure, in the network's order. joints: the option of this name.

    For `equivalent` they are those that have a counterpart on REFERENCE, if the skeleton's `maps` list it.
    skeleton: the data set's.
    """
    assert network.skeleton is not None
    names = network.skeleton.joints
    known = skeleton.get("maps", {}).get(REFERENCE, names) if joints == "equivalent" else names
    return [i for i, name in enumerate(names) if name in known]


def check_layout(where: str | Path, rows: ClipRows, network: Network) -> None:
    """Raise InputError if the rows do not have the columns that the network has learnt.

    Rows may have more channels than the network. where: the file of the rows, for the message.
    """
    layout = network.layout
    if not rows.layout.serves(layout):
        raise InputError(
            where,
            f"its rows ({rows.layout}) are not those the network has learnt ({layout})",
            fix="Use a data set with the network's skeleton and all its channels.",
        )


def roll_out_rows(rolled: Sequence[Json]) -> list[Row]:
    """A table of roll-outs: for each length, a row for each split (`clip` is None) and each clip."""
    rows: list[Row] = []
    for entry in rolled:
        of_splits = [{"clip": None, "split": split, **entry[split]} for split in SPLITS]
        rows += [{"length": entry["length"], **row} for row in (*of_splits, *entry["clips"])]
    return rows


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """accuracy.json, and two tables: `clips` has the errors of one step, `rollouts` those of roll-outs."""
    joints = joints_to_measure(load_network(inputs.weights), inputs.skeleton, options.joints)
    result = measure_accuracy(inputs, joints, samples.sample_to_measure(inputs, options), options.rollouts)
    return Outcome(
        result, {"clips": flat_rows([result], "clips"), "rollouts": roll_out_rows(result["rollouts"])}
    )
