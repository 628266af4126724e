"""Measures errors of roll-outs: the network continues from its own poses, with the path of a clip.

A roll-out starts at a captured frame and continues for n frames like the runtime. In each later frame, its
input has the joints that the roll-out predicted in the frame before. Each new position is the mean of two:
the predicted position, and the old position plus the predicted velocity. The phase advances by its predicted
change. Trajectory, gait, ground and channels come from the clip.

Many roll-outs are computed together (a crowd), because a network predicts many poses at once faster than one
by one. A roll-out in a crowd is the same as alone, to the last bit. A short roll-out is the beginning of a
longer one from the same frame, so only the longest roll-out from each frame is computed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.measures.rollouts import Options

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NotRequired, TypedDict

import numpy as np

from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.measures.accuracy_run import check_layout, joint_indices, joints_to_measure, relative_and_distance
from hobble.measures.measure import SPLITS, MeasureInputs, Outcome, Row
from hobble.measures.sample import ClipPart, LoadedPart, Sample, clip_parts, sample_to_measure
from hobble.models.load import load_network
from hobble.models.network import Network, Predictor
from hobble.rows.captured import rotate_by_yaw, unbroken_stretches
from hobble.rows.clip_rows import ClipRows, compose_pairs
from hobble.rows.excerpts import Excerpt
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime.rule import joint_place, movement_share, phase_change


class RollOutNumbers(TypedDict):
    """Errors over `frames` frames of roll-outs. They are None if there were no frames.

    position_error_cm: mean distance between a joint and its captured position. mean, sd: mean and standard
    deviation of the relative error: this distance divided by the distance between the captured joint and the
    root. ended: number of roll-outs that reached their full length. last_cm: mean position error in the last
    frame of these roll-outs. last_phase: mean phase error after their last frame, cycles. interval:
    `position_error_cm` -> half width of its 95 % confidence interval, if only a sample was measured.
    """

    frames: int
    mean: float | None
    sd: float | None
    position_error_cm: float | None
    ended: int
    last_cm: float | None
    last_phase: float | None
    interval: NotRequired[dict[str, float]]


class ErrorsOfClip(RollOutNumbers):
    """The errors of one clip. split: "train" or "held_out"."""

    clip: str
    split: str


class LengthErrors(TypedDict):
    """The errors of roll-outs over `length` frames."""

    length: int
    train: RollOutNumbers
    held_out: RollOutNumbers
    clips: list[ErrorsOfClip]


class RollOutResults(TypedDict):
    """rollouts.json.

    joints: number of joints measured. mode: the network's phase mode. sample: the size of the sample, if only
    a sample was measured.
    """

    configuration: str
    joints: int
    mode: str
    lengths: list[LengthErrors]
    sample: NotRequired[dict[str, int]]


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


LENGTHS = (1, 10, 60, 300)  # frames
# Roll-outs of the same length overlap: each frame is in OVERLAP short roll-outs, or in OVERLAP_OF_LONG long
# ones. Twice as many short ones would change the mean error by less than .2 % (configuration `limp`, 10 and
# 60 frames).
OVERLAP, OVERLAP_OF_LONG = 2, 4
LONG = 100  # frames: a roll-out of this length or more is long
AT_ONCE = 6000  # the roll-outs in about this many rows of clips are computed together, in about 100 MB

log = logging.getLogger("hobble")


@dataclass(frozen=True)
class RollOutErrors:
    """Errors over `frames` frames of `starts` roll-outs.

    moments: of the relative error and of the position error (cm), see `RollOutNumbers` in
    hobble.measures.rollouts.results. last: moments of the position error (cm) and of the phase error (cycles)
    in the last frame of the `ended` roll-outs that reached their full length.
    """

    frames: int = 0
    starts: int = 0
    moments: Moments = field(default_factory=lambda: Moments.of_no_rows(2), repr=False)
    last: Moments = field(default_factory=lambda: Moments.of_no_rows(2), repr=False)
    ended: int = 0

    def __add__(self, other: RollOutErrors) -> RollOutErrors:
        return RollOutErrors(
            self.frames + other.frames,
            self.starts + other.starts,
            self.moments + other.moments,
            self.last + other.last,
            self.ended + other.ended,
        )

    def weighted_by(self, weight: float) -> RollOutErrors:
        """The same errors with each frame counted `weight` times."""
        if weight == 1:
            return self
        return RollOutErrors(self.frames, self.starts, self.moments * weight, self.last * weight, self.ended)

    def to_dict(self, phase: bool = True) -> RollOutNumbers:
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


def _roll_out_groups(loaded: LoadedPart, layout: RowLayout, lengths: Sequence[int]) -> list[RollOuts]:
    """The roll-outs that begin in the rows to measure. They may end after these rows.

    There is a group for each length and each stretch of consecutive frames. In a group, a frame is in OVERLAP
    roll-outs, or in OVERLAP_OF_LONG if they are long, or in one if they last only one frame.
    """
    out = []
    for stretch in unbroken_stretches(loaded.rows.frame):  # indices of rows
        first, stop = np.searchsorted(stretch, (loaded.first, loaded.stop))
        inputs = inputs_of_clip(loaded.rows, stretch, layout)
        for length in lengths:
            overlap = OVERLAP if length < LONG else OVERLAP_OF_LONG
            # No roll-out begins at frame 0 of a stretch, because the root's movement before it is unknown.
            starts = np.arange(max(1, first), stop, max(1, length // overlap))
            if len(starts):
                out.append(RollOuts(inputs, starts, length))
    return out


def _errors_of_parts(
    predictor: Predictor, parts: Sequence[list[RollOuts]], joints: Sequence[int], lengths: Sequence[int]
) -> list[dict[int, RollOutErrors]]:
    """For each clip or excerpt: length -> errors. The roll-outs of all of them are computed together.

    parts: the groups of roll-outs of each clip or excerpt. joints: indices of the joints to measure.
    """
    out = [{length: RollOutErrors() for length in lengths} for _ in parts]
    # Each group, with the entry of `out` to which its errors are added.
    owners = [(by_length, group) for by_length, groups in zip(out, parts, strict=True) for group in groups]
    if not owners:
        return out
    crowd = RollOutCrowd(predictor, [group for _, group in owners])
    layout = predictor.network.layout
    truth = crowd.y[:, layout.y_joint_position].reshape(len(crowd.y), -1, 3)[:, joints]
    moments = [Moments.of_no_rows(2) for _ in owners]
    last: list[Array] = [np.zeros((0, len(joints), 2)) for _ in owners]  # errors in the last frame
    for age, (at, joint_positions, members) in enumerate(crowd.frames()):
        errors = relative_and_distance(truth[at].astype(float), joint_positions[:, joints])
        for g, of_group in members.items():
            own = errors[of_group]
            weights = np.full(own[..., 0].size, 1 / len(joints))  # a frame has the weight 1
            moments[g] = moments[g] + Moments.of_rows(own.reshape(-1, 2), weights)
            if age == owners[g][1].length - 1:
                last[g] = own
    for (by_length, group), in_all, end, phase in zip(owners, moments, last, crowd.phases(), strict=True):
        by_length[group.length] += _errors_of_group(group, in_all, end, phase)
    return out


def _errors_of_group(group: RollOuts, moments: Moments, end: Array, phase: Array) -> RollOutErrors:
    """The errors of a group of n roll-outs.

    moments: of the errors in all frames. end: (m, joints, 2) relative and position errors in the last frame
    of the first m roll-outs, which reach their full length. phase: (n,) after the last frame of each
    roll-out.
    """
    frames = int(np.minimum(group.length, len(group.inputs.x) - group.starts).sum())
    # `phase` is that of the frame after a roll-out. Roll-outs that end with the stretch are not counted as
    # ended, because there is no captured phase for this frame.
    ended = int(np.searchsorted(group.starts, len(group.inputs.x) - group.length))
    if not ended:
        return RollOutErrors(frames, len(group.starts), moments)
    truth = group.inputs.phase[group.starts[:ended] + group.length]
    phase_error = np.abs(np.mod(phase[:ended] - truth + 0.5, 1.0) - 0.5)  # 0 to half a cycle
    last = np.stack([end[:ended, :, 1].mean(axis=1), phase_error], axis=1)
    return RollOutErrors(frames, len(group.starts), moments, Moments.of_rows(last), ended)


def measure_roll_outs(
    weights: str | Path,
    clips: Mapping[str, str | Path],
    splits: Mapping[str, str],
    configuration: str,
    equivalents: Sequence[str] | None = None,
    lengths: Sequence[int] = LENGTHS,
    mode: str = "cubic",
    sample: Sample | None = None,
) -> RollOutResults:
    """The content of rollouts.json: for each of `lengths`, the errors of the splits and of the clips.

    clips: name -> file of rows. splits: name -> "train" or "held_out". equivalents: names of the joints to
    measure; all by default. mode: the network's phase mode. sample: measure only the roll-outs that begin in
    its excerpts; the result then has the size of the sample in `sample` and half widths of 95 % confidence
    intervals in `interval`. Raises InputError if rows and network have different layouts.
    """
    network = load_network(weights)
    predictor = network.predictor(mode)
    joints = joint_indices(network, equivalents)
    total: dict[int, dict[str, RollOutErrors]]
    total = {length: dict.fromkeys(SPLITS, RollOutErrors()) for length in lengths}
    of_clip: dict[int, dict[str, RollOutErrors]] = {length: {} for length in lengths}
    excerpts: dict[int, dict[Excerpt, float | None]] = {length: {} for length in lengths}
    for parts in _part_batches(clip_parts(clips, sample), network, lengths):
        for part, by_length in zip(
            parts, _errors_of_parts(predictor, list(parts.values()), joints, lengths), strict=True
        ):
            for length, errors in by_length.items():
                weighed, clip_errors = errors.weighted_by(part.weight), of_clip[length]
                total[length][splits[part.clip]] += weighed
                clip_errors[part.clip] = clip_errors.get(part.clip, RollOutErrors()) + weighed
                if part.excerpt is not None:
                    excerpts[length][part.excerpt] = errors.to_dict()["position_error_cm"]
            log.info("%s: %s", part.excerpt or part.clip, by_length[lengths[-1]].to_dict(network.uses_phase))
    result: RollOutResults = {
        "configuration": configuration,
        "joints": len(joints),
        "mode": mode,
        "lengths": [
            {
                "length": length,
                "train": total[length]["train"].to_dict(network.uses_phase),
                "held_out": total[length]["held_out"].to_dict(network.uses_phase),
                "clips": [
                    {"clip": name, "split": splits[name], **errors.to_dict(network.uses_phase)}
                    for name, errors in of_clip[length].items()
                ],
            }
            for length in lengths
        ],
    }
    return result if sample is None else _with_intervals(result, sample, excerpts, splits)


def _part_batches(
    parts: Iterable[ClipPart], network: Network, lengths: Sequence[int]
) -> Iterator[dict[ClipPart, list[RollOuts]]]:
    """Yield the roll-outs of a few clips or excerpts at a time, which have about AT_ONCE rows together."""
    batch: dict[ClipPart, list[RollOuts]] = {}
    rows = 0
    for part in parts:
        # A roll-out needs the frame before its start, and max(lengths) frames from its start on. Twice as
        # many rows are read, because a frame that two cycles share has two rows.
        loaded = part.load(before=2, after=2 * max(lengths))
        check_layout(part.path, loaded.rows, network)
        batch[part] = _roll_out_groups(loaded, network.layout, lengths)
        rows += len(loaded.rows)
        if rows >= AT_ONCE:
            yield batch
            batch, rows = {}, 0
    if batch:
        yield batch


def _with_intervals(
    result: RollOutResults,
    sample: Sample,
    excerpts: Mapping[int, Mapping[Excerpt, float | None]],
    splits: Mapping[str, str],
) -> RollOutResults:
    """The result with the size of the sample, and the confidence intervals of each split and length.

    excerpts: length -> position error of each excerpt, cm. It is None for an excerpt that is too short for a
    roll-out; the mean of the split is then used.
    """
    for entry in result["lengths"]:
        for split in SPLITS:
            mean = entry[split]["position_error_cm"]
            if mean is not None:
                values = {
                    excerpt: mean if error is None else error
                    for excerpt, error in excerpts[entry["length"]].items()
                    if splits[excerpt.clip] == split
                }
                entry[split]["interval"] = {"position_error_cm": sample.confidence_half_width(split, values)}
    return {**result, "sample": sample.to_dict()}


def roll_out_rows(result: RollOutResults) -> list[Row]:
    """A table with a row for each length and split (`clip` is None), and for each length and clip."""
    rows: list[Row] = []
    for entry in result["lengths"]:
        for split in SPLITS:
            rows.append({"length": entry["length"], "clip": None, "split": split, **entry[split]})
        rows += [{"length": entry["length"], **clip} for clip in entry["clips"]]
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
