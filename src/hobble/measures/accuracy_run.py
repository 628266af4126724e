"""Measures errors of one-step predictions, per clip and over the training and held-out clips.

The relative error is eq. 3.1 of Segerstedt (2021): |t - p| / |t|, where t is the captured and p the predicted
position of a joint relative to the root. Its mean and standard deviation are over frames and joints. The
network gets the captured input of every frame, never its own output.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.measures.accuracy import Options

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NotRequired, TypedDict

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.measures.measure import SPLITS, JointOptions, MeasureInputs, Outcome, Row
from hobble.measures.sample import Sample, clip_parts, sample_to_measure
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, pair_batches
from hobble.rows.excerpts import Excerpt
from hobble.rows.layout import RowLayout


class ErrorNumbers(TypedDict):
    """Errors over `frames` frames.

    mean, sd, p05 to p95: mean, standard deviation and percentiles of the relative error of a joint, that is,
    the error of its position as a fraction of its captured distance from the root (see
    `hobble.measures.accuracy.run`). position_error_cm: mean distance between the predicted and the captured
    position of a joint. If `frames` is 0, the means and sd are None, and there are no percentiles.
    """

    frames: int
    mean: float | None
    sd: float | None
    position_error_cm: float | None
    p05: NotRequired[float]
    p25: NotRequired[float]
    p50: NotRequired[float]
    p75: NotRequired[float]
    p95: NotRequired[float]


class ErrorsOfClip(ErrorNumbers):
    """The errors of one clip. split: "train" or "held_out"."""

    clip: str
    split: str


class ErrorsOfExcerpt(ErrorsOfClip):
    """The errors of an excerpt of a clip. first_frame, last_frame: its first and last frame in the clip."""

    first_frame: int
    last_frame: int


class ErrorsOfSplit(ErrorNumbers):
    """The errors over all clips of a split.

    clips: number of clips with measured frames. mean_of_clips: the mean of the mean relative errors of these
    clips. interval: "mean" or "position_error_cm" -> half the width of its 95 % confidence interval, if only
    a sample was measured.
    """

    clips: int
    mean_of_clips: float | None
    interval: NotRequired[dict[str, float]]


class Accuracy(TypedDict):
    """The content of accuracy.json, and `excerpts`, which are written to a table instead.

    joints: number of measured joints. sample, excerpts: the size of the sample and the errors of each of its
    excerpts; missing if all clips were measured as a whole.
    """

    configuration: str
    joints: int
    clips: list[ErrorsOfClip]
    train: ErrorsOfSplit
    held_out: ErrorsOfSplit
    sample: NotRequired[dict[str, int]]
    excerpts: NotRequired[list[ErrorsOfExcerpt]]


# A prediction of n frames: inputs (n, X) and phases (n,) -> outputs (n, Y), not standardised. X and Y are the
# numbers of input and output columns of the network.
Predict = Callable[[Array, Array], Array]

BATCH = 256  # frames predicted in one call; the inputs of more frames do not fit in the processor's cache
LEAST_DISTANCE = 1e-3  # cm: a joint nearer to the root counts as this far from it
# With the option `joints: equivalent`, only joints with a counterpart on this skeleton are measured.
REFERENCE = "holden31"
# Keys of the errors that have a confidence interval, if only a sample was measured.
WITH_INTERVAL: tuple[Literal["mean"], Literal["position_error_cm"]] = ("mean", "position_error_cm")
QUANTILES = {"p05": 0.05, "p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95}
# Columns of the table of clips.
COLUMNS = ("clip", "split", "frames", "mean", "sd", "position_error_cm", *QUANTILES)
# Edges of the bins of the relative error, each 2 % above the one before. Quantiles are read from the bins, so
# that the errors of single frames need not be stored.
EDGES = np.concatenate([[0.0], np.geomspace(1e-4, 1e2, 701)])

log = logging.getLogger("hobble")


@dataclass(frozen=True)
class Errors:
    """The relative errors and the position errors (cm) of the joints in `frames` frames.

    moments: weighted mean and variance of two columns, the relative error and the position error. histogram:
    (bins,) total weight of the relative errors in each bin between two EDGES.
    """

    frames: int = 0
    moments: Moments = field(default_factory=lambda: Moments.of_no_rows(2), repr=False)
    histogram: Array = field(default_factory=lambda: np.zeros(len(EDGES) - 1), repr=False)

    def __add__(self, other: Errors) -> Errors:
        return Errors(
            self.frames + other.frames, self.moments + other.moments, self.histogram + other.histogram
        )

    def weighted_by(self, weight: float) -> Errors:
        """The same errors with `weight` times their weights. `frames` stays the number of measured frames."""
        return self if weight == 1 else Errors(self.frames, self.moments * weight, self.histogram * weight)

    def quantile(self, share: float) -> float:
        """The relative error below which `share` of all errors lie, accurate to about 1 % of its value."""
        below = np.concatenate([[0.0], np.cumsum(self.histogram)])  # weight of the errors below each of EDGES
        return float(np.interp(share * below[-1], below, EDGES))

    def to_dict(self) -> ErrorNumbers:
        """Plain data for accuracy.json, with quantiles of the relative error; None if there was no frame."""
        if not self.frames:
            return {"frames": 0, "mean": None, "sd": None, "position_error_cm": None}
        mean, sd = self.moments.mean, self.moments.std
        return {
            "frames": self.frames,
            "mean": float(mean[0]),
            "sd": float(sd[0]),
            "position_error_cm": float(mean[1]),
            "p05": self.quantile(QUANTILES["p05"]),
            "p25": self.quantile(QUANTILES["p25"]),
            "p50": self.quantile(QUANTILES["p50"]),
            "p75": self.quantile(QUANTILES["p75"]),
            "p95": self.quantile(QUANTILES["p95"]),
        }


def joint_errors(layout: RowLayout, truth: Array, predicted: Array, joints: Sequence[int]) -> Array:
    """(n, len(joints), 2): relative error, and distance in cm, of the joints with the indices `joints`.

    truth, predicted: (n, Y) captured and predicted outputs, not standardised.
    """
    block = layout.y_joint_position
    t = truth[:, block].reshape(len(truth), -1, 3)[:, joints].astype(np.float64)
    return relative_and_distance(t, predicted[:, block].reshape(len(truth), -1, 3)[:, joints])


def relative_and_distance(truth: Array, predicted: Array) -> Array:
    """(..., 2): relative error, and distance in cm, of predicted joint positions.

    truth, predicted: (..., 3) captured and predicted positions relative to the root, cm.
    """
    distance = np.linalg.norm(truth - predicted, axis=-1)
    from_root = np.maximum(np.linalg.norm(truth, axis=-1), LEAST_DISTANCE)
    return np.stack([distance / from_root, distance], axis=-1)


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


def clip_errors(
    network: Network, rows: ClipRows, joints: Sequence[int], predict: Predict | None = None
) -> Errors:
    """The errors in all frames of a clip.

    A frame may have several terrain fits (ground heights that suit the motion). It is predicted on each of
    them and counts once, with its mean error. joints: indices of the joints to measure. predict: how to
    evaluate the network; by default `Network.predict`.
    """
    layout, predict = network.layout, predict or network.predict
    total, histogram = Moments.of_no_rows(2), np.zeros(len(EDGES) - 1)
    for pairs in pair_batches(rows, layout):
        errors = joint_errors(layout, pairs.y, predict(pairs.x, pairs.p), joints)
        weights = np.repeat(pairs.weight / len(joints), len(joints))  # all weights of a frame add up to 1
        errors = errors.reshape(-1, 2)
        total = total + Moments.of_rows(errors, weights)
        histogram += np.histogram(np.minimum(errors[:, 0], EDGES[-1]), EDGES, weights=weights)[0]
    return Errors(len(rows), total, histogram)


def measure_accuracy(
    weights: str | Path,
    clips: Mapping[str, str | Path],
    splits: Mapping[str, str],
    configuration: str,
    joint_names: Sequence[str] | None = None,
    sample: Sample | None = None,
) -> Accuracy:
    """The content of accuracy.json: errors over the frames of each split, and of each clip, sorted by name.

    weights: the network's file. clips: name -> file of rows. splits: name -> "train" or "held_out".
    joint_names: the joints to measure; all by default. sample: the excerpts to measure in place of all clips;
    then the result also has the size of the sample, confidence intervals, and the errors of each excerpt. In
    the result, `mean_of_clips` is the mean of the mean errors of clips, as in the published tables. Raises
    InputError if rows and network have different layouts.
    """
    network = load_network(weights)
    joints, predict = joint_indices(network, joint_names), predict_function(network)
    of_clip: dict[str, Errors] = {}
    excerpts: dict[Excerpt, ErrorsOfExcerpt] = {}
    totals: dict[str, Errors] = dict.fromkeys(SPLITS, Errors())
    for part in clip_parts(clips, sample):
        loaded = part.load()
        check_layout(part.path, loaded.rows, network)
        errors = clip_errors(network, loaded.rows, joints, predict)
        split = splits[part.clip]
        totals[split] += errors.weighted_by(part.weight)
        of_clip[part.clip] = of_clip.get(part.clip, Errors()) + errors.weighted_by(part.weight)
        values = errors.to_dict()
        if part.excerpt is not None:
            first, last = loaded.first_and_last_frame
            place = {"clip": part.clip, "split": split, "first_frame": first, "last_frame": last}
            excerpts[part.excerpt] = ErrorsOfExcerpt(**place, **values)  # type: ignore[typeddict-item]
        log.info("%s: %s", part.excerpt or part.clip, values)
    entries: list[ErrorsOfClip] = [
        {"clip": name, "split": splits[name], **errors.to_dict()} for name, errors in of_clip.items()
    ]
    train, held_out = (_errors_of_split(split, totals[split], entries) for split in SPLITS)
    result: Accuracy = {
        "configuration": configuration,
        "joints": len(joints),
        "clips": entries,
        "train": train,
        "held_out": held_out,
    }
    return result if sample is None else _with_intervals(result, sample, excerpts)


def _errors_of_split(split: str, errors: Errors, entries: Sequence[ErrorsOfClip]) -> ErrorsOfSplit:
    """The entry of a split. errors: over all its frames. entries: the entries of the clips of both splits."""
    means = [e["mean"] for e in entries if e["split"] == split and e["mean"] is not None]
    mean = float(np.mean(means)) if means else None
    return {**errors.to_dict(), "clips": len(means), "mean_of_clips": mean}


def _with_intervals(
    result: Accuracy, sample: Sample, excerpts: Mapping[Excerpt, ErrorsOfExcerpt]
) -> Accuracy:
    """The result with the size of the sample, the excerpts, and 95 % confidence intervals for each split.

    `mean_of_clips` becomes a mean over the excerpts, weighted to represent all clips. excerpts: the errors of
    each excerpt that was measured.
    """
    for split in SPLITS:
        # Excerpt of this split -> its errors.
        of_split = {excerpt: entry for excerpt, entry in excerpts.items() if entry["split"] == split}
        weights = [sample.clip_weights[excerpt] for excerpt in of_split]
        # Every excerpt of a sample has rows, so no value is None. (`or 0.0` tells the type checker.)
        means, distances = (
            {excerpt: entry[key] or 0.0 for excerpt, entry in of_split.items()} for key in WITH_INTERVAL
        )
        errors = result[split]
        if of_split:
            errors["mean_of_clips"] = float(np.average(list(means.values()), weights=weights))
        pairs = zip(WITH_INTERVAL, (means, distances), strict=True) if of_split else ()
        errors["interval"] = {key: sample.confidence_half_width(split, values) for key, values in pairs}
    return {**result, "sample": sample.to_dict(), "excerpts": list(excerpts.values())}


def equivalent_joints(skeleton: Json, reference: str = REFERENCE) -> list[str] | None:
    """Names of the joints of a skeleton that have a counterpart on the skeleton named `reference`.

    skeleton: the content of config/skeletons/<name>.yaml. If its `maps` do not list `reference`, the result
    is None, which stands for all joints.
    """
    counterparts = skeleton.get("maps", {}).get(reference)
    return None if counterparts is None else list(counterparts)


def joints_to_measure(inputs: MeasureInputs, options: JointOptions) -> list[str] | None:
    """Names of the joints that the options select; None for all."""
    return equivalent_joints(inputs.skeleton) if options.joints == "equivalent" else None


def joint_indices(network: Network, names: Sequence[str] | None = None) -> list[int]:
    """Indices of the joints in `names`, in the network's order; all joints by default."""
    if names is None:
        return list(range(network.layout.joints))
    if network.skeleton is None:
        raise HobbleError(
            "The network's file has no joint names, so `joints: equivalent` is not possible. Write "
            "`joints: all` in the section `evaluation` of the configuration."
        )
    indices = [i for i, name in enumerate(network.skeleton.joints) if name in names]
    if not indices:
        raise HobbleError(
            f"None of {', '.join(names)} is a joint of the network's skeleton, {network.skeleton.name}. "
            "Write `joints: all` in the section `evaluation` of the configuration."
        )
    return indices


def check_layout(where: str | Path, rows: ClipRows, network: Network) -> None:
    """Raise InputError if the rows do not have the columns that the network has learnt.

    Rows may have more channels than the network. where: the file of the rows, for the message.
    """
    layout = network.layout
    same_without_channels = rows.layout.with_channels(()) == replace(layout, channels=(), order=())
    if not same_without_channels or not set(layout.channels) <= set(rows.layout.channels):
        raise InputError(
            where,
            f"its rows ({rows.layout}) are not those the network has learnt ({layout})",
            fix="Use a data set with the network's skeleton and all its channels.",
        )


def clips_table(result: Accuracy) -> list[Row]:
    """The entries of the clips as rows of a table. Each row has all COLUMNS; a missing value is None."""
    return [{key: clip.get(key) for key in COLUMNS} for clip in result["clips"]]


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """accuracy.json, and the tables `clips` and, if a sample was measured, `excerpts`, with their errors."""
    sample = sample_to_measure(inputs, options)
    result = measure_accuracy(
        inputs.weights,
        inputs.clips,
        inputs.splits,
        inputs.configuration,
        joints_to_measure(inputs, options),
        sample,
    )
    excerpts = {"excerpts": result.pop("excerpts")} if sample else {}
    return Outcome(result, {"clips": clips_table(result), **excerpts})
