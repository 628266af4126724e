"""What a section of a page is made of: charts, tables, words and figures, each at its place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from markupsafe import Markup

from hobble.report.charts import Chart, Family
from hobble.report.summary import Figure
from hobble.report.tables import Table


@dataclass(frozen=True)
class Words:
    """A paragraph. Only what is written in the code may be Markup; everything else is escaped."""

    text: str | Markup
    empty: bool = False  # it says that there is nothing to show


@dataclass(frozen=True)
class Numbers:
    """A few figures in a row."""

    figures: Sequence[Figure]


@dataclass(frozen=True)
class Pair:
    """Charts side by side, where there is room."""

    charts: Sequence[Chart | None]


@dataclass(frozen=True)
class Fragment:
    """A template of the report's folder, for what needs a script of the page."""

    template: str


Content = Chart | Family | Table | Words | Numbers | Pair | Fragment
KINDS: dict[type, str] = {
    Chart: "chart",
    Family: "family",
    Table: "table",
    Words: "words",
    Numbers: "numbers",
    Pair: "pair",
    Fragment: "fragment",
}


@dataclass(frozen=True)
class Part:
    """One thing of a section, at a place among the others: 0 is the top, 100 the end.

    content: None where there is nothing to show. tall: of a chart with a row for each clip. open, short: of a
    table that is not folded, of one without a bar to scroll.
    """

    at: int
    content: Content | None = field(repr=False)
    tall: bool = False
    open: bool = False
    short: bool = False

    @property
    def kind(self) -> str:
        """What it is, for the template."""
        return KINDS[type(self.content)]


@dataclass(frozen=True)
class Section:
    """A section of a page. Several may have one `name`: then they are one, with the parts of all.

    title: what stands over it, said by one of them. at: its place among the sections. nav: a shorter title
    for the contents. long: whether a print may break it.
    """

    name: str
    parts: Sequence[Part] = field(repr=False)
    title: str = ""
    at: int = 50
    nav: str = ""
    long: bool = False


def joined(sections: Iterable[Section]) -> list[Section]:
    """Sections in their order, those of one name as one, with its parts in their order; empty ones left out.

    Title and place are those of the first that has a title.
    """
    by_name: dict[str, list[Section]] = {}
    for section in sections:
        by_name.setdefault(section.name, []).append(section)
    out = []
    for name, some in by_name.items():
        parts = sorted((p for s in some for p in s.parts if p.content is not None), key=lambda part: part.at)
        owner = next((s for s in some if s.title), some[0])
        title = owner.title or name.replace("_", " ").capitalize()
        if parts:
            out.append(replace(owner, parts=parts, title=title, nav=owner.nav or title))
    return sorted(out, key=lambda section: section.at)
