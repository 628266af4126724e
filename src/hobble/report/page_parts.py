"""The parts of a section of a page: charts, tables, text and key figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from markupsafe import Markup

from hobble.report.charts import Chart, ChartGroup
from hobble.report.summary import KeyFigure
from hobble.report.tables import Table


@dataclass(frozen=True)
class Paragraph:
    """A paragraph. Markup is not escaped, so only text from the source code may be Markup."""

    text: str | Markup


@dataclass(frozen=True)
class KeyFigures:
    """A row of key figures."""

    figures: Sequence[KeyFigure]


@dataclass(frozen=True)
class ChartPair:
    """Charts side by side, if the window is wide enough. None: there is nothing to show in this place."""

    charts: Sequence[Chart | None]


@dataclass(frozen=True)
class TemplatePart:
    """A part that a script of the page draws. template: file name of its HTML in this folder."""

    template: str


Content = Chart | ChartGroup | Table | Paragraph | KeyFigures | ChartPair | TemplatePart
# Type of content -> its kind, which the page's template reads.
KINDS: dict[type, str] = {
    Chart: "chart",
    ChartGroup: "family",
    Table: "table",
    Paragraph: "words",
    KeyFigures: "numbers",
    ChartPair: "pair",
    TemplatePart: "fragment",
}


@dataclass(frozen=True)
class SectionPart:
    """One part of a section.

    order: its place in the section, from 0 (top) to 100 (end). content: None if there is nothing to show.
    tall: whether the content is a chart with a row for each clip. open: whether the content is a table that
    is unfolded at first. short: whether it is a table that needs no scroll bar.
    """

    order: int
    content: Content | None = field(repr=False)
    tall: bool = False
    open: bool = False
    short: bool = False

    @property
    def kind(self) -> str:
        """Name of the kind of content, for the template."""
        return KINDS[type(self.content)]


@dataclass(frozen=True)
class PageSection:
    """A section of a page. `join_sections` joins sections with the same `name` into one.

    title: the heading; only one of the joined sections needs it. order: a number; sections are sorted by it.
    nav: a shorter title for the list of contents; by default the title. long: whether printing may break the
    section between pages.
    """

    name: str
    parts: Sequence[SectionPart] = field(repr=False)
    title: str = ""
    order: int = 50
    nav: str = ""
    long: bool = False


def join_sections(sections: Iterable[PageSection]) -> list[PageSection]:
    """The sections of a page, in order. Sections of the same name become one; empty sections are left out.

    A joined section has the parts of all its sections. Its other fields are those of its first section that
    has a title.
    """
    by_name: dict[str, list[PageSection]] = {}
    for section in sections:
        by_name.setdefault(section.name, []).append(section)
    out = []
    for name, same_name in by_name.items():
        parts = sorted(
            (p for s in same_name for p in s.parts if _is_shown(p.content)), key=lambda part: part.order
        )
        titled = next((s for s in same_name if s.title), same_name[0])
        title = titled.title or name.replace("_", " ").capitalize()
        if parts:
            out.append(replace(titled, parts=parts, title=title, nav=titled.nav or title))
    return sorted(out, key=lambda section: section.order)


def _is_shown(content: Content | None) -> bool:
    """Whether the content has anything to show."""
    if isinstance(content, ChartPair):
        return any(chart is not None for chart in content.charts)
    return content is not None
