"""A summary of a clip's rows, so that excerpts of the clip can be chosen before its rows are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.core.files import read_json, write_json
from hobble.rows.clip_rows import DELETE_IT, ClipRows
from hobble.rows.excerpts import Excerpt, ExcerptKind, cut_into_excerpts, excerpt_kind


@dataclass(frozen=True)
class RowsSummary:
    """A summary of a clip's rows.

    clip: name of the clip. rows: number of rows. kinds: what kind of motion is in each excerpt of the clip,
    in the order of `hobble.rows.excerpts.excerpts`.
    """

    clip: str
    rows: int
    kinds: tuple[ExcerptKind, ...] = field(repr=False)

    @property
    def excerpts(self) -> dict[Excerpt, ExcerptKind]:
        """Each excerpt of the clip -> what kind of motion is in it."""
        return dict(zip(cut_into_excerpts(self.clip, self.rows), self.kinds, strict=True))


def summary_of_rows(rows: ClipRows) -> RowsSummary:
    """Make the summary of a clip's rows."""
    parts = cut_into_excerpts(rows.clip, len(rows))
    return RowsSummary(
        rows.clip, len(rows), tuple(excerpt_kind(rows, part.first, part.stop) for part in parts)
    )


def save_summary(path: str | Path, summary: RowsSummary) -> None:
    """Write a summary as JSON."""
    write_json(Path(path), asdict(summary))


def load_summary(path: str | Path) -> RowsSummary:
    """Read what `save_summary` wrote. Raises InputError if the file holds something else."""
    values: Mapping[str, Any] = read_json(Path(path))
    try:
        kinds = tuple(
            ExcerptKind(**{**kind, "channels": tuple(kind["channels"])}) for kind in values["kinds"]
        )
        summary = RowsSummary(str(values["clip"]), int(values["rows"]), kinds)
        summary.excerpts  # noqa: B018 - raises ValueError if there is not one kind for each excerpt
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"not the summary of a clip ({error})", fix=DELETE_IT) from error
    return summary
