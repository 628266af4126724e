"""Compares the errors of one-step predictions of several configurations."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from hobble.evaluation.comparison_rows import (
    DifferenceOf,
    PublishedRow,
    SideBySide,
    compare_series,
    published_row,
)
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.accuracy.run import SPLITS, clip_rows
from hobble.measures.inputs import Json, Row

NAME = "accuracy"  # of the measurement
SPLIT_NAMES = {"train": "training", "held_out": "held-out"}


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> SideBySide:
    """Errors of each configuration, the difference of each pair, and the published errors beside ours."""
    return SideBySide(
        entries=[{"dataset": m.dataset, **m.found(NAME), "configuration": m.name} for m in all_measured],
        about={m.name: {"joints": m.found(NAME)["joints"]} for m in all_measured},
        differences=accuracy_differences(all_measured),
        against_published=[
            *_published_splits(all_measured, published),
            *_published_clips(all_measured, published),
        ],
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """A table with the errors of every clip in every configuration."""
    rows: list[Row] = [
        {"configuration": entry["configuration"], **row}
        for entry in compared[NAME]
        for row in clip_rows(entry)
    ]
    return {NAME: rows}


def accuracy_differences(all_measured: Sequence[ConfigurationResults]) -> list[DifferenceOf]:
    """The difference of each pair of configurations (eq. 3.2 of Segerstedt 2021).

    It is given for each split, and for each clip on which both configurations were measured.
    """
    out: list[DifferenceOf] = []
    for a, b in combinations(all_measured, 2):
        of_a, of_b = ({**_of_splits(m), **_clips(m)} for m in (a, b))
        for over in of_a:
            if over in of_b and of_a[over]["frames"] and of_b[over]["frames"]:
                out.append({"a": a.name, "b": b.name, "over": over, **compare_series(of_a[over], of_b[over])})
    return out


def _of_splits(measured: ConfigurationResults) -> dict[str, Json]:
    """Split -> its errors over all frames, with the mean errors of its clips under `means`."""
    found = measured.found(NAME)
    return {split: {**found[split], "means": clip_means(found, split)} for split in SPLITS}


def clip_means(found: Json, split: str) -> list[float]:
    """The mean error of each clip of a split."""
    return [c["mean"] for c in found["clips"] if c["split"] == split and c["mean"] is not None]


def _published_splits(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published errors of each configuration, beside our errors on each split."""
    by_name = {m.name: m for m in all_measured}
    out = []
    for row in published["accuracy"]:
        m = by_name.get(row["configuration"])
        for split in SPLITS:
            ours = m.found(NAME)[split]["mean_of_clips"] if m else None
            out.append(published_row(f"relative error, {SPLIT_NAMES[split]} clips", row, row["mean"], ours))
            if "sd" in row:
                in_text = {**row, "table": None}  # sd is published in the text, not in the table
                means = clip_means(m.found(NAME), split) if m else []
                sd = float(np.std(means)) if len(means) > 1 else None
                what = f"standard deviation of the means of {SPLIT_NAMES[split]} clips"
                out.append(published_row(what, in_text, row["sd"], sd))
    return out


def _published_clips(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published errors of single clips, beside our errors on the clips with the same names.

    The names of the clips that Holden et al. (2017) released end in _000; the published names do not.
    Segerstedt (2021) published the errors of two networks: "segerstedt" is his own, "release" is the network
    that Holden et al. released.
    """
    out = []
    for row in published["clips"]:
        for m in all_measured:
            for clip in m.found(NAME)["clips"]:
                if clip["clip"].removesuffix("_000") == row["clip"]:
                    for source in ("segerstedt", "release"):
                        named = {"configuration": m.name, "source": source}
                        what = f"relative error, {clip['clip']}"
                        out.append(published_row(what, named, row[source], clip["mean"]))
    return out


def _clips(measured: ConfigurationResults) -> dict[str, Json]:
    return {entry["clip"]: entry for entry in measured.found(NAME)["clips"]}
