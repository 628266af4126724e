"""Compares the errors of several configurations in predicting the frame after a captured frame."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from hobble.evaluation.comparison_rows import (
    ComparisonAddition,
    DifferenceOf,
    PublishedRow,
    compare_series,
    published_row,
)
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.accuracy.run import SPLITS, clips_table
from hobble.measures.inputs import Json, Row

NAME = "accuracy"  # name of the measurement
# split -> its name in texts for users
SPLIT_NAMES = {"train": "training", "held_out": "held-out"}


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The errors of each configuration, the difference of each pair, and the published errors beside ours.

    all_measured: the results of each configuration. published: the content of published.yaml.
    """
    return ComparisonAddition(
        entries=[{"dataset": m.dataset, **m.results_of(NAME), "configuration": m.name} for m in all_measured],
        about={m.name: {"joints": m.results_of(NAME)["joints"]} for m in all_measured},
        differences=accuracy_differences(all_measured),
        against_published=[
            *_published_splits(all_measured, published),
            *_published_clips(all_measured, published),
        ],
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """Name -> rows of a CSV table: the errors of every clip in every configuration.

    compared: the content of compare.json.
    """
    rows: list[Row] = [
        {"configuration": entry["configuration"], **row}
        for entry in compared[NAME]
        for row in clips_table(entry)
    ]
    return {NAME: rows}


def accuracy_differences(all_measured: Sequence[ConfigurationResults]) -> list[DifferenceOf]:
    """The difference between the errors of each two configurations, by eq. 3.2 of Segerstedt 2021.

    There is a row for each split and each clip on which both configurations were measured. `over` is the name
    of this split or clip.
    """
    out: list[DifferenceOf] = []
    for a, b in combinations(all_measured, 2):
        errors_a, errors_b = ({**_errors_of_splits(m), **_errors_of_clips(m)} for m in (a, b))
        for over in errors_a:
            if over in errors_b and errors_a[over]["frames"] and errors_b[over]["frames"]:
                differences = compare_series(errors_a[over], errors_b[over])
                out.append({"a": a.name, "b": b.name, "over": over, **differences})
    return out


def _errors_of_splits(results: ConfigurationResults) -> dict[str, Json]:
    """Split -> its errors over all frames, with the mean errors of its clips under `means`."""
    found = results.results_of(NAME)
    return {split: {**found[split], "means": clip_means(found, split)} for split in SPLITS}


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split that has one. found: the content of accuracy.json."""
    return [c["mean"] for c in found["clips"] if c["split"] == split and c["mean"] is not None]


def _published_splits(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published errors of each configuration, beside our errors on each split."""
    by_name = {m.name: m for m in all_measured}
    out = []
    for row in published["accuracy"]:
        results = by_name.get(row["configuration"])
        for split in SPLITS:
            ours = results.results_of(NAME)[split]["mean_of_clips"] if results else None
            out.append(published_row(f"relative error, {SPLIT_NAMES[split]} clips", row, row["mean"], ours))
            if "sd" in row:
                # The standard deviation (sd) was printed in the text of the publication, not in its table.
                in_text = {**row, "table": None}
                means = clip_means(results.results_of(NAME), split) if results else []
                sd = float(np.std(means)) if len(means) > 1 else None
                what = f"standard deviation of the means of {SPLIT_NAMES[split]} clips"
                out.append(published_row(what, in_text, row["sd"], sd))
    return out


def _published_clips(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published errors of single clips, beside the errors of each configuration on the same clips.

    The files of the clips that Holden et al. (2017) released have names that end in _000; the published names
    do not. Segerstedt (2021) published the errors of two networks: "segerstedt" is his own, "release" is the
    network that Holden et al. released.
    """
    out = []
    for row in published["clips"]:
        for results in all_measured:
            for clip in results.results_of(NAME)["clips"]:
                if clip["clip"].removesuffix("_000") == row["clip"]:
                    for source in ("segerstedt", "release"):
                        entry = {"configuration": results.name, "source": source}
                        what = f"relative error, {clip['clip']}"
                        out.append(published_row(what, entry, row[source], clip["mean"]))
    return out


def _errors_of_clips(results: ConfigurationResults) -> dict[str, Json]:
    """Clip -> its errors over all frames."""
    return {entry["clip"]: entry for entry in results.results_of(NAME)["clips"]}
