"""The diagnosis channel: a column, 0 or 1, for each of three groups of diagnoses. All are 0 if healthy."""

from __future__ import annotations

import csv
import functools
import io
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from pydantic import Field

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.core.errors import InputError
from hobble.core.section import MocapPath, Section
from hobble.core.untrusted import MAX_TEXT_BYTES, printable, read_bytes

if TYPE_CHECKING:
    from hobble.core.clip import Clip
    from hobble.core.quat import Array

# The groups of Rueangsirarak et al. (2018), who distinguish them by gait.
DIAGNOSES = ("joint problem", "muscle weakness", "neurological defect")
HEALTHY = "healthy"  # stands in the table, or in a clip's entry, instead of a diagnosis
COLUMNS = ("file", "diagnosis")  # columns that the table needs; others are ignored


class DiagnosisTable(Section):
    """The section `channels.diagnosis` of a data set."""

    table: MocapPath = Field(
        description="CSV in the mocap folder with the columns `file` (a BVH file) and `diagnosis`"
    )


class Diagnosis(Channel):
    """The diagnosis of a clip's person, the same in all frames. For the class fields see `Channel`."""

    name = "diagnosis"
    title = "Diagnosis"
    value = "amount"  # the word on the page for a value: how strong the diagnosis is, 0 to 1
    highest = 1.0
    rate = 1.0
    slows = True
    manner = True
    Options = DiagnosisTable

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The three groups of diagnoses."""
        return DIAGNOSES

    def tables(self, options: Section | None) -> tuple[str, ...]:
        """The table that the data set names."""
        return (options.table,) if isinstance(options, DiagnosisTable) else ()

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether the person is healthy or the diagnosis is unknown."""
        return _diagnosis_of(source) in (HEALTHY, None)

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the data set's entry for the clip names a diagnosis that is not known."""
        if source.value is not None and source.value not in (*DIAGNOSES, HEALTHY):
            where = f"{source.clip}.channels.{self.name}"
            raise InputError(where, f"cannot be {source.value!r:.80}", fix=f"Write one of {_known_names()}.")

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """1 for the person's diagnosis in every frame, and a warning if the table lacks the clip."""
        import numpy as np

        found = _diagnosis_of(source)
        row = [float(diagnosis == found) for diagnosis in DIAGNOSES]
        warnings = [] if found else [f"{source.clip} is not in the table. The person is taken to be healthy."]
        return np.tile(np.array(row, np.float32), (len(clip), 1)), warnings


def _diagnosis_of(source: ClipSource) -> str | None:
    """The diagnosis of a clip's person, or HEALTHY. None if neither the clip's entry nor the table has it.

    The entry, which is in the configuration of the data set, is used if both have it.
    """
    if source.value is not None:
        return str(source.value)
    found: str | None = None
    for file in source.files:
        found = read_table(str(file)).get(source.clip, found)
    return found


@functools.cache  # the table is one file for all clips of a data set
def read_table(path: str) -> dict[str, str]:
    """Clip -> diagnosis.

    Raises InputError with the line for a missing column, an unknown diagnosis, or a clip with two diagnoses.
    """
    reader = csv.DictReader(
        io.StringIO(read_bytes(path, MAX_TEXT_BYTES).decode("utf-8-sig", "replace"), newline="")
    )
    if missing := [name for name in COLUMNS if name not in (reader.fieldnames or ())]:
        fix = f"The first line must name them: {','.join(COLUMNS)}."
        raise InputError(path, f"has no column {' and no '.join(missing)}", line=1, fix=fix)
    out: dict[str, str] = {}
    for row in reader:
        clip, diagnosis = PurePosixPath(row["file"] or "").stem, (row["diagnosis"] or "").strip()
        if diagnosis not in (*DIAGNOSES, HEALTHY):
            problem = f"{printable(clip)} has {printable(diagnosis, 80)!r}"
            raise InputError(path, problem, line=reader.line_num, fix=f"Write one of {_known_names()}.")
        if out.setdefault(clip, diagnosis) != diagnosis:
            problem = f"{printable(clip)} is {diagnosis} here and {out[clip]} above"
            raise InputError(
                path, problem, line=reader.line_num, fix=f"Keep only one of them in {Path(path).name}."
            )
    return out


def _known_names() -> str:
    return ", ".join((*DIAGNOSES, HEALTHY))


CHANNEL = Diagnosis()
