"""Compares how well hurt parts are recognised in several configurations."""

from __future__ import annotations

from collections.abc import Sequence

from hobble.channels.injury.recognition.run import confusion_rows
from hobble.core.files import Json
from hobble.measures.compare import ComparisonAddition, ConfigurationResults, published_row
from hobble.measures.measure import Row

NAME = "recognition"  # name of the measurement


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The result of each configuration, and rows that compare it with people's recognition of hurt parts.

    published: name of a measurement -> its published result.
    """
    return ComparisonAddition(
        entries=[{**m.results_of(NAME), "configuration": m.name} for m in all_measured],
        against_published=[row for m in all_measured for row in _against_people(m, published["recognition"])],
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """The confusion tables of all configurations, as one table. compared: the content of compare.json."""
    named_rows = [(entry["configuration"], row) for entry in compared[NAME] for row in confusion_rows(entry)]
    return {NAME: [{"configuration": name, **row} for name, row in named_rows]}


def _against_people(results: ConfigurationResults, people: Json) -> list[Row]:
    """The shares of hurt parts that the classifier recognises, each next to the share of people.

    people: the published result, with the key `share`.
    """
    found = results.results_of(NAME)
    if not found["applies"]:
        return []
    published, generated = {**people, "configuration": results.name}, found["generated"]
    shares = {
        "all severities": generated["right"],
        "all severities, left and right not distinguished": generated["right_without_side"],
    }
    hurt = [row for row in generated["by_severity"] if row["severity"] > 0]
    shares |= {f"severity {row['severity']:g}": row["right"] for row in hurt}
    return [
        published_row(
            f"hurt part recognised, {which} (published: by people)",
            published,
            people["share"],
            ours,
        )
        for which, ours in shares.items()
    ]
