"""Errors of roll-outs: the network continues from its own poses, with the path and other inputs of a clip.

A roll-out starts at a captured frame and continues for n frames like the runtime. In each later frame, its
input has the joints that the roll-out predicted in the frame before. Each new position is the mean of two:
the predicted position, and the old position plus the predicted velocity. The phase advances by its predicted
change. Trajectory, gait, ground and channels come from the clip.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.evaluation.captured import unbroken_stretches
from hobble.measures.accuracy.run import (
    check_layout,
    joint_indices,
    joints_to_measure,
    relative_and_distance,
)
from hobble.measures.clip_parts import ClipPart, LoadedPart, clip_parts, sample_to_measure
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.results import SPLITS
from hobble.measures.rollouts import Options
from hobble.measures.rollouts.results import RollOutNumbers, RollOutResults
from hobble.measures.rollouts.roll_outs import RollOutCrowd, RollOuts, inputs_of_clip
from hobble.measures.stratified_sample import Sample
from hobble.models.load import load_network
from hobble.models.network import Network, Predictor
from hobble.rows.excerpts import Excerpt
from hobble.rows.layout import RowLayout

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
