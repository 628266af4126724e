"""Collects what each measurement shows on the pages.

A measurement's `page.py` may have

- `section(found, material) -> PageSection`: its part of the report,
- `figures(found, material) -> Iterable[KeyFigure]`: key figures for the top of the report,
- `hints(found, material) -> Iterable[Hint]`: advice that follows from its numbers,

where `found` is the measurement's JSON ({} if it was not run) and `material` is everything else that is known
about the configuration. Its `comparison_page.py` may have

- `section(compared) -> PageSection`: its part of the comparison page,
- `columns(compared) -> Iterable[OverviewColumn]`: columns of the table of configurations at the top of that
  page,
- `verdicts(compared) -> Iterable[Verdict]`: sentences on which configuration is best, for the summary,

where `compared` is the content of compare.json.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hobble.measures.inputs import Json
from hobble.measures.registry import MEASURES
from hobble.report.gather import ReportMaterial
from hobble.report.page_parts import PageSection, joined
from hobble.report.summary import Hint, KeyFigure
from hobble.report.tables import Column
from hobble.report.verdicts import Verdict


@dataclass(frozen=True)
class OverviewColumn:
    """A column of the table of configurations.

    values: configuration -> value. at: its place; columns are sorted by it.
    """

    at: int
    column: Column
    values: Mapping[str, Any] = field(repr=False)


def sections(material: ReportMaterial) -> list[PageSection]:
    """The sections of the report that show measurements."""
    return joined(show(material.found(name), material) for name, show in _each("page", "section"))


def figures(material: ReportMaterial) -> list[KeyFigure]:
    """Key figures for the top of the report."""
    return [f for name, show in _each("page", "figures") for f in show(material.found(name), material)]


def hints(material: ReportMaterial) -> list[Hint]:
    """Advice that follows from the numbers."""
    return [h for name, show in _each("page", "hints") for h in show(material.found(name), material)]


def compared_sections(compared: Json) -> list[PageSection]:
    """The sections of the comparison page that show measurements."""
    return joined(show(compared) for _, show in _each("comparison_page", "section"))


def compared_verdicts(compared: Json) -> list[Verdict]:
    """Sentences on which configuration is best at something, in the order of the page."""
    found = [verdict for _, show in _each("comparison_page", "verdicts") for verdict in show(compared)]
    return sorted(found, key=lambda verdict: verdict.at)


def compared_columns(compared: Json) -> list[OverviewColumn]:
    """The columns of the table of configurations."""
    return [column for _, show in _each("comparison_page", "columns") for column in show(compared)]


def _each(part: str, function: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """(name of a measurement, function) for each measurement that has this function in its module `part`."""
    for measure in MEASURES:
        if (found := getattr(measure.part(part), function, None)) is not None:
            yield measure.name, found
