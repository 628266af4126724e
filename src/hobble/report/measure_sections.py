"""Collects what each measurement shows in the report and on the comparison page.

A measurement is a package, described in `hobble.measures.measure`. Its `page.py` may define

- `section(found, material) -> PageSection`: its part of the report,
- `figures(found, material) -> Iterable[KeyFigure]`: key figures for the top of the report,
- `hints(found, material) -> Iterable[Hint]`: advice that follows from its numbers,

where `found` is the measurement's JSON ({} if it was not run) and `material` has all results of the
configuration. Its `comparison_page.py` may define

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
from hobble.report.page_parts import PageSection, join_sections
from hobble.report.summary import Hint, KeyFigure
from hobble.report.tables import Column
from hobble.report.verdicts import Verdict


@dataclass(frozen=True)
class OverviewColumn:
    """A column of the table of configurations, which has a row for each configuration.

    values: configuration -> value in its row. order: a number; columns are sorted by it.
    """

    order: int
    column: Column
    values: Mapping[str, Any] = field(repr=False)


def sections(material: ReportMaterial) -> list[PageSection]:
    """The sections of the report that show measurements."""
    return join_sections(
        show(material.results_of(name), material) for name, show in _functions("page", "section")
    )


def figures(material: ReportMaterial) -> list[KeyFigure]:
    """The key figures that measurements have for the top of the report."""
    return [
        f for name, show in _functions("page", "figures") for f in show(material.results_of(name), material)
    ]


def hints(material: ReportMaterial) -> list[Hint]:
    """The advice that follows from the numbers of the measurements."""
    return [
        h for name, show in _functions("page", "hints") for h in show(material.results_of(name), material)
    ]


def compared_sections(compared: Json) -> list[PageSection]:
    """The sections of the comparison page that show measurements."""
    return join_sections(show(compared) for _, show in _functions("comparison_page", "section"))


def compared_verdicts(compared: Json) -> list[Verdict]:
    """Sentences on which configuration is best in some respect, in the order of the page."""
    verdicts = [
        verdict for _, show in _functions("comparison_page", "verdicts") for verdict in show(compared)
    ]
    return sorted(verdicts, key=lambda verdict: verdict.order)


def compared_columns(compared: Json) -> list[OverviewColumn]:
    """The columns that measurements add to the table of configurations. They are not sorted yet."""
    return [column for _, show in _functions("comparison_page", "columns") for column in show(compared)]


def _functions(module: str, name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Find the function `name` in the modules of this name of all measurements.

    module: "page" or "comparison_page". Yields (name of the measurement, function). A measurement without
    the module or the function is left out.
    """
    for measure in MEASURES:
        if (function := getattr(measure.import_module(module), name, None)) is not None:
            yield measure.name, function
