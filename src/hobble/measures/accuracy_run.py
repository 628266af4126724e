"""Measures errors of one-step predictions, per clip and over the training and held-out clips.

The relative error is eq. 3.1 of Segerstedt (2021): |t - p| / |t|, where t is the captured and p the predicted
position of a joint relative to the root. Its mean and standard deviation are over frames and joints. The
network gets the captured input of every frame, never its own output.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.measures import sample as samples
from hobble.measures.measure import SPLITS, JointOptions, MeasureInputs, Outcome, flat_rows
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, pair_batches
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
QUANTILES = {"p05": 0.05, "p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95}
# Edges of the bins of the relative error, each 2 % above the one before. Quantiles are read from the bins, so
# that the errors of single frames need not be stored.
EDGES = np.concatenate([[0.0], np.geomspace(1e-4, 1e2, 701)])

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
    """(n,) sums over the frames of a clip: those of `errors_of_sums`, then the weight of each bin of EDGES.

    A frame may have several terrain fits (ground heights that suit the motion). It is predicted on each of
    them and counts once, with its mean error. joints: indices of the joints to measure.
    """
    sums, bins = np.zeros(4), np.zeros(len(EDGES) - 1)
    for pairs in pair_batches(rows, network.layout):
        relative, cm = (
            joint_errors(network.layout, pairs.y, predict(pairs.x, pairs.p), joints).reshape(-1, 2).T
        )
        weights = np.repeat(pairs.weight / len(joints), len(joints))  # all weights of a frame add up to 1
        sums += (weights * [np.ones_like(cm), relative, relative**2, cm]).sum(axis=1)
        bins += np.histogram(np.minimum(relative, EDGES[-1]), EDGES, weights=weights)[0]
    return np.concatenate([sums, bins])


def values_of_sums(sums: Array) -> dict[str, Any]:
    """Plain data for accuracy.json from `clip_sums`. Quantiles are right to about 1 %."""
    below = np.concatenate([[0.0], np.cumsum(sums[4:])])  # weight of the errors below each of EDGES
    quantiles = np.interp(np.array([*QUANTILES.values()]) * below[-1], below, EDGES)
    known = quantiles.tolist() if sums[0] else [None] * len(QUANTILES)
    return samples.errors_of_sums(sums) | dict(zip(QUANTILES, known, strict=True))


def measure_accuracy(
    inputs: MeasureInputs,
    joint_names: Sequence[str] | None = None,
    sample: samples.Sample | None = None,
) -> dict[str, Any]:
    """The content of accuracy.json: errors over the frames of each split, and of each clip, sorted by name.

    joint_names: the joints to measure; all by default. sample: the excerpts to measure in place of all clips;
    then the result also has the size of the sample, confidence intervals, and `excerpts`, the errors of each
    excerpt. In the result, `mean_of_clips` is the mean of the mean errors of clips, as in the published
    tables. `as_published` has the errors as Segerstedt (2021) measured them: in the phase mode `constant`, on
    the first PUBLISHED_POSITIONS of each clip; of a split, mean and standard deviation (n - 1) of the clips'
    means. It is left out of a sample. Raises InputError if rows and network have different layouts.
    """
    network, splits = load_network(inputs.weights), inputs.splits
    joints, predict = joint_indices(network, joint_names), predict_function(network)
    constant, first_frames = at_stored_phases(network, predict), PUBLISHED_POSITIONS // network.layout.joints
    sums: dict[samples.ClipPart, Array] = {}
    published, excerpts = {}, []
    for part in samples.clip_parts(inputs.clips, sample):
        rows = part.load().rows
        check_layout(part.path, rows, network)
        sums[part] = clip_sums(network, rows, joints, predict)
        values = values_of_sums(sums[part])
        log.info("%s: %s", part.excerpt or part.clip, values)
        if sample is None:
            of_first = clip_sums(network, rows.part(slice(first_frames)), joints, constant)
            found = samples.errors_of_sums(of_first)
            published[part.clip] = {key: found[key] for key in ("frames", "mean", "sd")}
        else:
            place = {"first_frame": int(rows.frame[0]), "last_frame": int(rows.frame[-1])}
            excerpts.append({"clip": part.clip, "split": splits[part.clip], **place, **values})
    result = samples.summed_up(sums, splits, sample, values_of_sums, {"mean": 1, "position_error_cm": 3})
    for split in SPLITS:
        own = {part: s[1] / s[0] for part, s in sums.items() if splits[part.clip] == split and s[0]}
        # The mean over clips, of which each has as much weight as there is of it in the sample.
        mean = float(np.average([*own.values()], weights=[part.share for part in own])) if own else None
        result[split] |= {"clips": len({part.clip for part in own}), "mean_of_clips": mean}
        if sample is None:
            means = [published[part.clip]["mean"] for part in own]
            sd = float(np.std(means, ddof=1)) if len(means) > 1 else None
            mean = float(np.mean(means)) if means else None
            result[split]["as_published"] = {"mean_of_clips": mean, "sd_of_clips": sd}
    for clip in result["clips"] if sample is None else ():
        clip["as_published"] = published[clip["clip"]]
    result = {"configuration": inputs.configuration, "joints": len(joints), **result}
    return {**samples.with_sample(result, sample), **({"excerpts": excerpts} if sample else {})}


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


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """accuracy.json, and the tables `clips` and, if a sample was measured, `excerpts`, with their errors."""
    joints, sample = joints_to_measure(inputs, options), samples.sample_to_measure(inputs, options)
    result = measure_accuracy(inputs, joints, sample)
    excerpts = {"excerpts": result.pop("excerpts")} if sample else {}
    return Outcome(result, {"clips": flat_rows([result], "clips"), **excerpts})
