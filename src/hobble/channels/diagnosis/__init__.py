"""The diagnosis channel, with a column for each of three groups of diagnoses.

In a patient's clip, the column of the patient's diagnosis is 1. In a healthy person's clip, all are 0.
"""

import functools
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Literal

from pydantic import Field

from hobble.channels.channel import ClipChannel, ClipSource, HasLinks
from hobble.core.errors import InputError
from hobble.core.files import printable, read_table
from hobble.core.section import RelativePath, Section

# Three groups of diagnoses that Rueangsirarak et al. (2018) distinguish by gait.
DIAGNOSES = ("joint problem", "muscle weakness", "neurological defect")
HEALTHY = "healthy"  # what the table or a clip's entry says of a person without a diagnosis
COLUMNS = ("file", "diagnosis")  # the columns that the table must have; all others are ignored


class DiagnosisTable(Section):
    """The section `channels.diagnosis` of a data set."""

    table: RelativePath = Field(
        description="CSV in the mocap folder with the columns `file` (a BVH file) and `diagnosis`"
    )


class Diagnosis(ClipChannel):
    """The diagnosis of a clip's person, the same in all frames. For the class fields see `Channel`."""

    name = "diagnosis"
    title = "Diagnosis"
    value_word = "amount"  # the word on the page for a value: how strong the diagnosis is, 0 to 1
    highest = 1.0
    rate = 1.0
    slows = True
    manner = True
    Options = DiagnosisTable
    Value = Literal[DIAGNOSES, HEALTHY]  # type: ignore[valid-type]

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """Labels of the three columns, one for each group of diagnoses."""
        return DIAGNOSES

    def table_files(self, options: Section | None) -> tuple[str, ...]:
        """The name of the table, as the data set states it."""
        return (options.table,) if isinstance(options, DiagnosisTable) else ()

    def values_of(self, source: ClipSource) -> Sequence[float] | None:
        """As in `ClipChannel`: 1 in the column of the person's diagnosis.

        The clip's entry in the data set says it or, if there is none, the table.
        """
        found = source.value
        for file in source.files if found is None else ():
            found = read_diagnoses(str(file)).get(source.clip, found)
        return None if found is None else [float(diagnosis == found) for diagnosis in DIAGNOSES]


@functools.cache  # the table is one file for all clips of a data set
def read_diagnoses(path: str) -> dict[str, str]:
    """Clip -> diagnosis or HEALTHY, from the CSV file `path`.

    Raises InputError, which names the line, for a missing column, an unknown diagnosis, or a clip with two
    diagnoses.
    """
    known = (*DIAGNOSES, HEALTHY)
    diagnoses: dict[str, str] = {}
    for line, row in read_table(path, COLUMNS):
        clip, diagnosis = PurePosixPath(row["file"]).stem, row["diagnosis"]
        if diagnosis not in known:
            problem = f"{printable(clip)} has the unknown diagnosis {printable(diagnosis, 80)!r}"
            raise InputError(path, problem, line=line, fix=f"Write one of {', '.join(known)}.")
        if diagnoses.setdefault(clip, diagnosis) != diagnosis:
            problem = f"{printable(clip)} is {diagnosis} here and {diagnoses[clip]} above"
            raise InputError(path, problem, line=line, fix=f"Keep only one of them in {Path(path).name}.")
    return diagnoses


CHANNEL = Diagnosis()
