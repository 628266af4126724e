"""The diagnosis channel, with a column for each of three groups of diagnoses.

In a patient's clip, the column of the patient's diagnosis is 1. In a healthy person's clip, all are 0.
"""

from __future__ import annotations

import csv
import functools
import io
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from pydantic import Field

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.section import RelativePath, Section
from hobble.core.untrusted import MAX_TEXT_BYTES, printable, read_bytes

# Three groups of diagnoses that Rueangsirarak et al. (2018) distinguish by gait.
DIAGNOSES = ("joint problem", "muscle weakness", "neurological defect")
HEALTHY = "healthy"  # what the table or a clip's entry says of a person without a diagnosis
COLUMNS = ("file", "diagnosis")  # the columns that the table must have; all others are ignored


class DiagnosisTable(Section):
    """The section `channels.diagnosis` of a data set."""

    table: RelativePath = Field(
        description="CSV in the mocap folder with the columns `file` (a BVH file) and `diagnosis`"
    )


class Diagnosis(Channel):
    """The diagnosis of a clip's person, the same in all frames. For the class fields see `Channel`."""

    name = "diagnosis"
    title = "Diagnosis"
    value_word = "amount"  # the word on the page for a value: how strong the diagnosis is, 0 to 1
    highest = 1.0
    rate = 1.0
    slows = True
    manner = True
    Options = DiagnosisTable

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """Labels of the three columns, one for each group of diagnoses."""
        return DIAGNOSES

    def table_files(self, options: Section | None) -> tuple[str, ...]:
        """The name of the table, as the data set states it."""
        return (options.table,) if isinstance(options, DiagnosisTable) else ()

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether the person is healthy or the diagnosis is unknown."""
        return _diagnosis_of(source) in (HEALTHY, None)

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the clip's entry in the data set has an unknown diagnosis."""
        if source.value is not None and source.value not in (*DIAGNOSES, HEALTHY):
            where = f"{source.clip}.channels.{self.name}"
            raise InputError(where, f"cannot be {source.value!r:.80}", fix=f"Write one of {_known_names()}.")

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Values (F, 3), with 1 in the column of the person's diagnosis, and a warning if it is unknown."""
        found = _diagnosis_of(source)
        row = [float(diagnosis == found) for diagnosis in DIAGNOSES]
        warnings = (
            []
            if found
            else [f"{source.clip} is not in the table of diagnoses. The person is taken to be healthy."]
        )
        return np.tile(np.array(row, np.float32), (len(clip), 1)), warnings


def _diagnosis_of(source: ClipSource) -> str | None:
    """The diagnosis of a clip's person, or HEALTHY; None if it is unknown.

    It comes from the clip's entry in the data set or, if the entry has none, from the table.
    """
    if source.value is not None:
        return str(source.value)
    found: str | None = None
    for file in source.files:
        found = read_table(str(file)).get(source.clip, found)
    return found


@functools.cache  # the table is one file for all clips of a data set
def read_table(path: str) -> dict[str, str]:
    """Clip -> diagnosis or HEALTHY, from the CSV file `path`.

    Raises InputError, which names the line, for a missing column, an unknown diagnosis, or a clip with two
    diagnoses.
    """
    reader = csv.DictReader(
        io.StringIO(read_bytes(path, MAX_TEXT_BYTES).decode("utf-8-sig", "replace"), newline="")
    )
    if missing := [name for name in COLUMNS if name not in (reader.fieldnames or ())]:
        fix = f"The first line must name them: {','.join(COLUMNS)}."
        raise InputError(path, f"has no column {' and no '.join(missing)}", line=1, fix=fix)
    diagnoses: dict[str, str] = {}
    for row in reader:
        clip, diagnosis = PurePosixPath(row["file"] or "").stem, (row["diagnosis"] or "").strip()
        if diagnosis not in (*DIAGNOSES, HEALTHY):
            problem = f"{printable(clip)} has the unknown diagnosis {printable(diagnosis, 80)!r}"
            raise InputError(path, problem, line=reader.line_num, fix=f"Write one of {_known_names()}.")
        if diagnoses.setdefault(clip, diagnosis) != diagnosis:
            problem = f"{printable(clip)} is {diagnosis} here and {diagnoses[clip]} above"
            raise InputError(
                path, problem, line=reader.line_num, fix=f"Keep only one of them in {Path(path).name}."
            )
    return diagnoses


def _known_names() -> str:
    """All words that are allowed as a diagnosis, separated by commas."""
    return ", ".join((*DIAGNOSES, HEALTHY))


CHANNEL = Diagnosis()
