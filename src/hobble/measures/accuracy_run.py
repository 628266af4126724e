"""Measures errors of one-step predictions, per clip and over the training and held-out clips.

The relative error is eq. 3.1 of Segerstedt (2021): |t - p| / |t|, where t is the captured and p the predicted
position of a joint relative to the root. Its mean and standard deviation are over frames and joints. The
network gets the captured input of every frame, never its own output.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.measures.measure import SPLITS, JointOptions, MeasureInputs, Outcome, Row
from hobble.measures.sample import Sample, clip_parts, sample_to_measure, with_sample
from hobble.measures.walks import mean_of_known
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, Excerpt, pair_batches
from hobble.rows.layout import RowLayout
from hobble.runtime.error_calculator import relative_and_distance

if TYPE_CHECKING:
    from hobble.measures.accuracy import Options

# A prediction of n frames: inputs (n, X) and phases (n,) -> outputs (n, Y), not standardised. X and Y are the
# numbers of input and output columns of the network.
Predict = Callable[[Array, Array], Array]

BATCH = 256  # frames predicted in one call; the inputs of more frames do not fit in the processor's cache
# Segerstedt measured at most the first so many joint positions of a clip, in the phase mode `constant`.
PUBLISHED_POSITIONS = 500_000
# With the option `joints: equivalent`, only joints with a counterpart on this skeleton are measured.
REFERENCE = "holden31"
# Keys of the errors that have a confidence interval, if only a sample was measured.
WITH_INTERVAL = ("mean", "position_error_cm")
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

    def quantile(self, share: float) -> float:
        """The relative error below which `share` of all errors lie, accurate to about 1 % of its value."""
        below = np.concatenate([[0.0], np.cumsum(self.histogram)])  # weight of the errors below each of EDGES
        return float(np.interp(share * below[-1], below, EDGES))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for accuracy.json, with quantiles of the relative error; None if there was no frame."""
        if not self.frames:
            return {"frames": 0, "mean": None, "sd": None, "position_error_cm": None}
        return {
            "frames": self.frames,
            "mean": float(self.moments.mean[0]),
            "sd": float(self.moments.std[0]),
            "position_error_cm": float(self.moments.mean[1]),
            **{name: self.quantile(share) for name, share in QUANTILES.items()},
        }


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


def clip_errors(
    network: Network,
    rows: ClipRows,
    joints: Sequence[int],
    predict: Predict | None = None,
    first: int | None = None,
) -> Errors:
    """The errors in all frames of a clip.

    A frame may have several terrain fits (ground heights that suit the motion). It is predicted on each of
    them and counts once, with its mean error. joints: indices of the joints to measure. predict: how to
    evaluate the network; by default `Network.predict`. first: only so many rows, from the beginning.
    """
    layout, predict = network.layout, predict or network.predict
    total, histogram = Moments.of_no_rows(2), np.zeros(len(EDGES) - 1)
    rows = rows if first is None or len(rows) <= first else rows.part(slice(first))
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
) -> dict[str, Any]:
    """The content of accuracy.json: errors over the frames of each split, and of each clip, sorted by name.

    weights: the network's file. clips: name -> file of rows. splits: name -> "train" or "held_out".
    joint_names: the joints to measure; all by default. sample: the excerpts to measure in place of all clips;
    then the result also has the size of the sample, confidence intervals, and `excerpts`, the errors of each
    excerpt. In the result, `mean_of_clips` is the mean of the mean errors of clips, as in the published
    tables. `as_published` has the errors as Segerstedt (2021) measured them: in the phase mode `constant`, on
    the first PUBLISHED_POSITIONS of each clip; of a split, mean and standard deviation (n - 1) of the clips'
    means. It is left out of a sample. Raises InputError if rows and network have different layouts.
    """
    network = load_network(weights)
    joints, predict = joint_indices(network, joint_names), predict_function(network)
    constant, first_frames = at_stored_phases(network, predict), PUBLISHED_POSITIONS // network.layout.joints
    of_clip: dict[str, Errors] = {}
    as_published: dict[str, dict[str, Any]] = {}
    excerpts: dict[Excerpt, dict[str, Any]] = {}
    for part in clip_parts(clips, sample):
        rows = part.load().rows
        check_layout(part.path, rows, network)
        errors = clip_errors(network, rows, joints, predict)
        of_clip[part.clip] = of_clip.get(part.clip, Errors()) + errors
        values = errors.to_dict()
        if part.excerpt is None:
            published = clip_errors(network, rows, joints, constant, first_frames).to_dict()
            as_published[part.clip] = {key: published[key] for key in ("frames", "mean", "sd")}
        else:
            place = {"first_frame": int(rows.frame[0]), "last_frame": int(rows.frame[-1])}
            excerpts[part.excerpt] = {"clip": part.clip, "split": splits[part.clip], **place, **values}
        log.info("%s: %s", part.excerpt or part.clip, values)
    entries = [
        {"clip": name, "split": splits[name], **errors.to_dict()}
        | ({"as_published": as_published[name]} if sample is None else {})
        for name, errors in of_clip.items()
    ]
    result: dict[str, Any] = {"configuration": configuration, "joints": len(joints), "clips": entries}
    for split in SPLITS:
        total = sum((errors for name, errors in of_clip.items() if splits[name] == split), Errors())
        own = [e for e in entries if e["split"] == split and e["mean"] is not None]
        mean = mean_of_known([e["mean"] for e in own], 15)
        result[split] = {**total.to_dict(), "clips": len(own), "mean_of_clips": mean}
        if sample is None:
            means = [e["as_published"]["mean"] for e in own]
            sd = float(np.std(means, ddof=1)) if len(means) > 1 else None
            result[split]["as_published"] = {"mean_of_clips": mean_of_known(means, 15), "sd_of_clips": sd}
        elif drawn := sample.splits.get(split):
            # The mean over clips, of which each has as much weight as there is of it in the sample.
            shares = [excerpt.rows / excerpt.clip_rows for excerpt in drawn.drawn]
            means = [excerpts[excerpt]["mean"] for excerpt in drawn.drawn]
            result[split]["mean_of_clips"] = float(np.average(means, weights=shares))
            result[split]["interval"] = {
                key: drawn.confidence_half_width({e: excerpts[e][key] for e in drawn.drawn})
                for key in WITH_INTERVAL
            }
    return {**with_sample(result, sample), **({"excerpts": list(excerpts.values())} if sample else {})}


def joints_to_measure(inputs: MeasureInputs, options: JointOptions) -> list[str] | None:
    """Names of the joints that the options select; None for all.

    For `equivalent` they are those that have a counterpart on REFERENCE, if the skeleton's `maps` list it.
    """
    counterparts = inputs.skeleton.get("maps", {}).get(REFERENCE) if options.joints == "equivalent" else None
    return None if counterparts is None else list(counterparts)


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
    same_without_channels = rows.layout.with_channels(()) == replace(layout, channels=())
    if not same_without_channels or not set(layout.channels) <= set(rows.layout.channels):
        raise InputError(
            where,
            f"its rows ({rows.layout}) are not those the network has learnt ({layout})",
            fix="Use a data set with the network's skeleton and all its channels.",
        )


def clips_table(result: Mapping[str, Any]) -> list[Row]:
    """The entries of the clips as rows of a table. Each row has all COLUMNS; a missing value is None."""
    return [{key: clip.get(key) for key in COLUMNS} for clip in result["clips"]]


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """accuracy.json, and the tables `clips` and, if a sample was measured, `excerpts`, with their errors."""
    joints, sample = joints_to_measure(inputs, options), sample_to_measure(inputs, options)
    result = measure_accuracy(
        inputs.weights, inputs.clips, inputs.splits, inputs.configuration, joints, sample
    )
    excerpts = {"excerpts": result.pop("excerpts")} if sample else {}
    return Outcome(result, {"clips": clips_table(result), **excerpts})
