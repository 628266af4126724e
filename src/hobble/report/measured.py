"""What the measurements show of themselves on the pages: a walk through the list of them.

A measurement's `page.py` may have

- `section(found, material) -> Section`: its part of the report,
- `figures(found, material) -> Iterable[Figure]`: for the top of the report,
- `hints(found, material) -> Iterable[Hint]`: sentences drawn from its numbers,

where `found` is its own JSON ({} where it was not made) and `material` everything else that is known of the
configuration. Its `comparison_page.py` may have

- `section(compared) -> Section`: its part of the page of a comparison,
- `columns(compared) -> Iterable[Overview]`: for the table of configurations on top of it,
- `verdicts(compared) -> Iterable[Verdict]`: which configuration is best at something, for the first screen,

where `compared` is compare.json.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hobble.measures.given import Json
from hobble.measures.registry import MEASURES
from hobble.report.gather import Material
from hobble.report.parts import Section, joined
from hobble.report.summary import Figure, Hint
from hobble.report.tables import Column
from hobble.report.verdicts import Verdict


@dataclass(frozen=True)
class Overview:
    """A column of the table of configurations; values: of each of them; at: its place among the others."""

    at: int
    column: Column
    values: Mapping[str, Any] = field(repr=False)


def sections(material: Material) -> list[Section]:
    """The sections of the report that show measurements."""
    return joined(show(material.found(name), material) for name, show in _each("page", "section"))


def figures(material: Material) -> list[Figure]:
    """Figures for the top of the report."""
    return [f for name, show in _each("page", "figures") for f in show(material.found(name), material)]


def hints(material: Material) -> list[Hint]:
    """What the numbers suggest."""
    return [h for name, show in _each("page", "hints") for h in show(material.found(name), material)]


def compared_sections(compared: Json) -> list[Section]:
    """The sections of the page of a comparison that show measurements."""
    return joined(show(compared) for _, show in _each("comparison_page", "section"))


def compared_verdicts(compared: Json) -> list[Verdict]:
    """Which configuration is best at what, in the order in which it is said."""
    found = [verdict for _, show in _each("comparison_page", "verdicts") for verdict in show(compared)]
    return sorted(found, key=lambda verdict: verdict.at)


def compared_columns(compared: Json) -> list[Overview]:
    """Columns of the table of configurations."""
    return [column for _, show in _each("comparison_page", "columns") for column in show(compared)]


def _each(part: str, function: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The name of each measurement that has this function in that part, and the function."""
    for one in MEASURES:
        if (found := getattr(one.part(part), function, None)) is not None:
            yield one.name, found
