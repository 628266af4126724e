"""Compares the errors of several configurations in roll-outs."""

from __future__ import annotations

from collections.abc import Sequence

from hobble.evaluation.comparison_rows import ComparisonAddition
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.measures.accuracy.run import SPLITS
from hobble.measures.inputs import Json, Row

NAME = "rollouts"


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """A list entry for each configuration and length of roll-outs, without the errors of single clips."""
    return ComparisonAddition(
        entries=[
            {"configuration": m.name, **{k: v for k, v in entry.items() if k != "clips"}}
            for m in all_measured
            for entry in m.results_of(NAME)["lengths"]
        ]
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """One table, with a row for each configuration, length and split."""
    rows: list[Row] = [
        {"configuration": entry["configuration"], "length": entry["length"], "split": split, **entry[split]}
        for entry in compared[NAME]
        for split in SPLITS
    ]
    return {NAME: rows}
