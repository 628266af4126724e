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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.measures.accuracy_run import check_layout, joint_indices, joints_to_measure
from hobble.measures.measure import SPLITS, MeasureInputs, Outcome, Row
from hobble.measures.sample import ClipPart, LoadedPart, Sample, clip_parts, sample_to_measure, with_sample
from hobble.models.load import load_network
from hobble.models.network import Network, Predictor
from hobble.rows.clip_rows import ClipRows, Excerpt, compose_pairs, rotate_by_yaw, unbroken_stretches
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime.error_calculator import relative_and_distance
from hobble.runtime.rule import joint_place, movement_share, phase_change

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
class RollOutErrors:
    """Errors over `frames` frames of roll-outs.

    moments: of the relative error and of the position error (cm). last: moments of the position error (cm)
    and of the phase error (cycles) in the last frame of the `ended` roll-outs that reached their full length.
    """

    frames: int = 0
    moments: Moments = field(default_factory=lambda: Moments.of_no_rows(2), repr=False)
    last: Moments = field(default_factory=lambda: Moments.of_no_rows(2), repr=False)
    ended: int = 0

    def __add__(self, other: RollOutErrors) -> RollOutErrors:
        return RollOutErrors(
            self.frames + other.frames,
            self.moments + other.moments,
            self.last + other.last,
            self.ended + other.ended,
        )

    def __mul__(self, weight: float) -> RollOutErrors:
        """The same errors with each frame counted `weight` times."""
        return RollOutErrors(self.frames, self.moments * weight, self.last * weight, self.ended)

    def to_dict(self, phase: bool = True) -> dict[str, Any]:
        """Plain data. Values are None if there are no frames, or no roll-outs that reached their full length.

        phase: whether the network uses the phase. If not, the phase error has no meaning and is None.
        """
        has_frames, ended = self.frames > 0, self.ended > 0
        return {
            "frames": self.frames,
            "mean": float(self.moments.mean[0]) if has_frames else None,
            "sd": float(self.moments.std[0]) if has_frames else None,
            "position_error_cm": float(self.moments.mean[1]) if has_frames else None,
            "ended": self.ended,
            "last_cm": float(self.last.mean[0]) if ended else None,
            "last_phase": float(self.last.mean[1]) if ended and phase else None,
        }


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


def stretches_of(loaded: LoadedPart, layout: RowLayout) -> list[Stretch]:
    """The stretches of consecutive frames in the rows of a clip or an excerpt. layout: the network's."""
    out = []
    for rows in unbroken_stretches(loaded.rows.frame):  # indices of rows
        first, stop = np.searchsorted(rows, (loaded.first, loaded.stop))
        out.append(Stretch(inputs_of_clip(loaded.rows, rows, layout), int(first), int(stop)))
    return out


def errors_of_stretches(
    predictor: Predictor, stretches: Sequence[Stretch], joints: Sequence[int], lengths: Sequence[int]
) -> list[dict[int, RollOutErrors]]:
    """For each stretch: length -> errors of its roll-outs. Those of all stretches are computed together.

    joints: indices of the joints to measure.
    """
    if not stretches:
        return []
    inputs = RollOutInputs(
        *(np.concatenate([getattr(s.inputs, f.name) for s in stretches]) for f in fields(RollOutInputs))
    )
    bounds = np.cumsum([0, *(len(s.inputs.x) for s in stretches)])  # in `inputs`
    out: list[dict[int, RollOutErrors]] = [{} for _ in stretches]
    for length in lengths:
        starts = [stretch.starts(length) for stretch in stretches]
        first = np.concatenate([begin + s for begin, s in zip(bounds[:-1], starts, strict=True)])
        ends = np.repeat(bounds[1:], [len(s) for s in starts])
        crowd = RollOutCrowd(predictor, inputs, first, np.minimum(first + length, ends))
        parts = np.cumsum([0, *(len(s) for s in starts)])  # which roll-outs begin in which stretch
        for by_length, errors in zip(out, _errors_of_crowd(crowd, parts, ends, joints, length), strict=True):
            by_length[length] = errors
    return out


def _errors_of_crowd(
    crowd: RollOutCrowd, parts: np.ndarray, ends: np.ndarray, joints: Sequence[int], length: int
) -> list[RollOutErrors]:
    """The errors of the roll-outs of S stretches.

    parts: (S + 1,) index of the first roll-out of each stretch, then R. ends: (R,) index of the frame after
    the stretch of a roll-out. length: of those that do not end with their stretch.
    """
    inputs, block = crowd.inputs, crowd.predictor.network.layout.y_joint_position
    truth = inputs.y[:, block].reshape(len(inputs.y), -1, 3)[:, joints]
    moments = [Moments.of_no_rows(2) for _ in parts[1:]]
    last_cm = np.zeros(len(crowd.first))  # mean position error in the last frame
    for alive, at, joint_positions in crowd.frames():
        errors = relative_and_distance(truth[at].astype(float), joint_positions[:, joints])
        last_cm[alive] = errors[..., 1].mean(axis=1)
        bounds = np.searchsorted(alive, parts)
        for s in np.flatnonzero(np.diff(bounds)).tolist():
            own = errors[bounds[s] : bounds[s + 1]].reshape(-1, 2)
            moments[s] = moments[s] + Moments.of_rows(own, np.full(len(own), 1 / len(joints)))
    # `phase` is that of the frame after a roll-out. Roll-outs that end with the stretch are not counted as
    # ended, because there is no captured phase for this frame.
    ended = crowd.first + length < ends
    truth_after = inputs.phase[np.where(ended, crowd.stop, 0)]
    phase_error = np.abs(np.mod(crowd.phase - truth_after + 0.5, 1.0) - 0.5)  # 0 to half a cycle
    last, frames = np.stack([last_cm, phase_error], axis=1), crowd.stop - crowd.first
    out = []
    for s, span in enumerate(map(slice, parts[:-1], parts[1:])):
        full = ended[span]
        out.append(
            RollOutErrors(
                int(frames[span].sum()), moments[s], Moments.of_rows(last[span][full]), int(full.sum())
            )
        )
    return out


def measure_roll_outs(
    weights: str | Path,
    clips: Mapping[str, str | Path],
    splits: Mapping[str, str],
    configuration: str,
    equivalents: Sequence[str] | None = None,
    lengths: Sequence[int] = LENGTHS,
    mode: str = "cubic",
    sample: Sample | None = None,
) -> Json:
    """The content of rollouts.json: for each of `lengths`, the errors of the splits and of the clips.

    clips: name -> file of rows. splits: name -> "train" or "held_out". equivalents: names of the joints to
    measure; all by default. mode: the network's phase mode. sample: measure only the roll-outs that begin in
    its excerpts; the result then has the size of the sample in `sample` and half widths of 95 % confidence
    intervals in `interval`. Raises InputError if rows and network have different layouts.
    """
    network = load_network(weights)
    predictor, joints = network.predictor(mode), joint_indices(network, equivalents)
    total = {length: dict.fromkeys(SPLITS, RollOutErrors()) for length in lengths}
    of_clip: dict[int, dict[str, RollOutErrors]] = {length: {} for length in lengths}
    excerpts: dict[int, dict[Excerpt, float | None]] = {length: {} for length in lengths}
    for batch in _part_batches(clip_parts(clips, sample), network, lengths):
        found = iter(errors_of_stretches(predictor, [s for _, some in batch for s in some], joints, lengths))
        for part, stretches in batch:
            of_part = [next(found) for _ in stretches]
            for length in lengths:
                errors = sum((by_length[length] for by_length in of_part), RollOutErrors())
                weighed, clip_errors = errors * part.weight, of_clip[length]
                total[length][splits[part.clip]] += weighed
                clip_errors[part.clip] = clip_errors.get(part.clip, RollOutErrors()) + weighed
                if part.excerpt is not None:
                    excerpts[length][part.excerpt] = errors.to_dict()["position_error_cm"]
            log.info("%s: %s", part.excerpt or part.clip, errors.to_dict(network.uses_phase))
    entries = [
        {
            "length": length,
            **{split: errors.to_dict(network.uses_phase) for split, errors in total[length].items()},
            "clips": [
                {"clip": name, "split": splits[name], **errors.to_dict(network.uses_phase)}
                for name, errors in of_clip[length].items()
            ],
        }
        for length in lengths
    ]
    if sample is not None:
        _add_intervals(entries, sample, excerpts, splits)
    result = {"configuration": configuration, "joints": len(joints), "mode": mode, "lengths": entries}
    return with_sample(result, sample)


def _part_batches(
    parts: Iterable[ClipPart], network: Network, lengths: Sequence[int]
) -> Iterator[list[tuple[ClipPart, list[Stretch]]]]:
    """Yield a few clips or excerpts at a time, together about AT_ONCE rows, with their stretches."""
    batch: list[tuple[ClipPart, list[Stretch]]] = []
    rows = 0
    for part in parts:
        # A roll-out needs the frame before its start, and max(lengths) frames from its start on. Twice as
        # many rows are read, because a frame that two cycles share has two rows.
        loaded = part.load(before=2, after=2 * max(lengths))
        check_layout(part.path, loaded.rows, network)
        batch.append((part, stretches_of(loaded, network.layout)))
        rows += len(loaded.rows)
        if rows >= AT_ONCE:
            yield batch
            batch, rows = [], 0
    if batch:
        yield batch


def _add_intervals(
    entries: Sequence[dict[str, Any]],
    sample: Sample,
    excerpts: Mapping[int, Mapping[Excerpt, float | None]],
    splits: Mapping[str, str],
) -> None:
    """Add the confidence interval of each split to the entry of each length.

    excerpts: length -> position error of each excerpt, cm. It is None for an excerpt that is too short for a
    roll-out; the mean of the split is then used.
    """
    for entry in entries:
        for split in SPLITS:
            mean = entry[split]["position_error_cm"]
            if mean is not None:
                values = {
                    excerpt: mean if error is None else error
                    for excerpt, error in excerpts[entry["length"]].items()
                    if splits[excerpt.clip] == split
                }
                entry[split]["interval"] = {"position_error_cm": sample.confidence_half_width(split, values)}


def roll_out_rows(result: Json) -> list[Row]:
    """A table with a row for each length and split (`clip` is None), and for each length and clip."""
    rows: list[Row] = []
    for entry in result["lengths"]:
        of_splits = [{"clip": None, "split": split, **entry[split]} for split in SPLITS]
        rows += [{"length": entry["length"], **row} for row in (*of_splits, *entry["clips"])]
    return rows


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """rollouts.json, and its rows as a table."""
    result = measure_roll_outs(
        inputs.weights,
        inputs.clips,
        inputs.splits,
        inputs.configuration,
        joints_to_measure(inputs, options),
        options.rollouts,
        inputs.runtime.mode,
        sample_to_measure(inputs, options),
    )
    return Outcome(result, {"lengths": roll_out_rows(result)})
