"""The parts of which pages are made: numbers as text, charts, tables, key figures, hints and sections.

Measurements import from here what their sections need. A colour such as "@accent" stands for the CSS variable
--accent of the page.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import pydantic_core
import yaml
from markupsafe import Markup

from hobble.core.messages import format_duration as format_duration


def format_bytes(count: float | None) -> str:
    """A number of bytes as text, in B, kB, MB or GB (powers of 1000); a dash for None.

    >>> [format_bytes(count) for count in (512, 606e6, 999_600, 7_120_000_000, 1.2345e12, None)]
    ['512 B', '606 MB', '1 MB', '7.12 GB', '1,234 GB', '–']
    """
    if count is None:
        return "–"
    for unit in ("B", "kB", "MB", "GB"):
        text = f"{count:.0f}" if unit == "B" else f"{count:.3g}"
        if float(text) < 1000:  # rounding may have made it 1000
            return f"{text} {unit}"
        count /= 1000
    return f"{1000 * count:,.0f} GB"


def format_number(value: float | None, digits: int = 3) -> str:
    """A number as text with `digits` significant digits; a dash for None, NaN and infinity.

    Digits before the decimal point are all shown, with separators of thousands.

    >>> format_number(20000, 5)
    '20,000'
    >>> [format_number(value) for value in (0.04391, 1234.5, None, float("nan"), 0)]
    ['0.0439', '1,234', '–', '–', '0']
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{places}f}"


def embedded(value: Any) -> Markup:
    """JSON that is safe inside a <script> element, whatever its strings contain.

    Arrays become lists, NaN and infinities become null.
    "<", ">" and "&" are written as escapes, so that no string can end the element or open a comment.

    >>> embedded({"clip": "</script><b>"})
    Markup('{"clip":"\\\\u003c/script\\\\u003e\\\\u003cb\\\\u003e"}')
    """
    text = pydantic_core.to_json(value, inf_nan_mode="null", fallback=lambda array: array.tolist()).decode()
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


Trace = dict[str, Any]


@dataclass(frozen=True)
class Chart:
    """A chart, with a caption that says how to read it.

    name: the chart's id in the page. traces, layout: as plotly takes them. height: pixels.

    A chart with a menu has `options` instead of `traces`: text in the menu -> the traces to show. choose:
    the menu's label. option_layouts: text in the menu -> changes of the layout.
    """

    kind: ClassVar[str] = "chart"
    name: str
    title: str
    caption: str
    traces: Sequence[Trace] = field(repr=False, default=())
    layout: Mapping[str, Any] = field(repr=False, default_factory=dict)
    height: int = 340
    choose: str | None = None
    options: Mapping[str, Sequence[Trace]] = field(repr=False, default_factory=dict)
    option_layouts: Mapping[str, Mapping[str, Any]] = field(repr=False, default_factory=dict)

    def spec(self) -> dict[str, Any]:
        """What the page's script needs to draw the chart: its id, layout, and the traces of each option."""
        return {
            "name": self.name,
            "layout": _escaped({"height": self.height, **self.layout}),
            "options": [
                {"traces": _escaped(list(value)), "layout": self.option_layouts.get(key)}
                for key, value in (self.options or {"": self.traces}).items()
            ],
        }


@dataclass(frozen=True)
class ChartGroup:
    """Charts side by side, if the window is wide enough. None: there is nothing to show in this place.

    Small charts may share a title and a caption; then name is the group's id in the page. choose: label of a
    menu that selects one of the `options` of all charts; "" for no menu.
    """

    kind: ClassVar[str] = "family"
    charts: Sequence[Chart | None] = field(repr=False)
    name: str = ""
    title: str = ""
    caption: str = ""
    choose: str = ""


def _escaped(value: Any) -> Any:
    """`value` with "<" and "&" escaped in every text, because plotly reads texts as HTML.

    Hover templates are not escaped. They are written in the code, and only refer to data.
    """
    if isinstance(value, Mapping):
        return {k: v if k == "hovertemplate" else _escaped(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_escaped(item) for item in value]
    return value.replace("&", "&amp;").replace("<", "&lt;") if isinstance(value, str) else value


def axis(title: str, **more: Any) -> dict[str, Any]:
    """A plotly axis with a title. more: further settings of the axis."""
    return {"title": {"text": title}, **more}


def log_axis(title: str, values: Iterable[float | None]) -> dict[str, Any]:
    """A logarithmic axis with ticks at 1, 2 and 5 times the powers of ten, as plain numbers.

    values: the values that the chart shows.
    """
    positive = [v for v in values if v is not None and v > 0]
    if not positive:
        return axis(title, type="log")
    decades = range(math.floor(math.log10(min(positive))) - 1, math.ceil(math.log10(max(positive))) + 1)
    ticks = [float(f"{digit}e{decade}") for decade in decades for digit in (1, 2, 5)]
    return axis(title, type="log", tickvals=ticks, ticktext=[f"{tick:g}" for tick in ticks])


def line_trace(name: str, x: Sequence, y: Sequence, colour: str, **more: Any) -> Trace:
    """The trace of a line through the points x, y.

    more: `dash` and `width` of the line; further settings are set in the trace.
    """
    stroke = {"color": colour, "width": more.pop("width", 2), "dash": more.pop("dash", "solid")}
    mode = more.pop("mode", "lines")
    return {"type": "scatter", "mode": mode, "name": name, "x": list(x), "y": list(y), "line": stroke, **more}


def bar_trace(name: str, x: Sequence, y: Sequence, colour: str, hover: str) -> Trace:
    """The trace of bars at x with heights y. hover: template of the text when the pointer is on a bar."""
    trace: Trace = {"type": "bar", "name": name, "x": list(x), "y": list(y)}
    return trace | {"marker": {"color": colour}, "hovertemplate": hover}


def marker_trace(name: str, x: Sequence, y: Sequence, marker: Mapping[str, Any], **more: Any) -> Trace:
    """The trace of a marker at each point x, y. more: further settings of the trace."""
    points = {"type": "scatter", "mode": "markers", "name": name, "x": list(x), "y": list(y)}
    return points | {"marker": dict(marker)} | more


def log_range(values: Iterable[float]) -> list[float]:
    """The two ends of a logarithmic axis for `values`, as exponents of ten.

    It begins with the whole decade below the smallest positive value. Beyond the largest value there is room
    for a text.
    """
    powers = [math.log10(value) for value in values if value > 0] or [0.0, 1.0]
    return [math.floor(min(powers)), max(powers) + 0.4 * (max(powers) - math.floor(min(powers)) + 1)]


def reference_line(value: float, text: str, vertical: bool = True) -> dict[str, list[dict]]:
    """What a layout needs for a dotted line across the whole plot at `value`, with a text at its end.

    vertical: whether the line is vertical. `value` is on the x axis for a vertical line, otherwise on the y
    axis.
    """
    a, b = "xy" if vertical else "yx"
    end = {"yanchor": "bottom"} if vertical else {"xanchor": "right", "yanchor": "bottom"}
    shape: dict[str, Any] = {"type": "line", "line": {"color": "@soft", "width": 1, "dash": "dot"}}
    shape |= {f"{a}0": value, f"{a}1": value, f"{b}ref": "paper", f"{b}0": 0, f"{b}1": 1}
    note = {"text": text, "showarrow": False, "font": {"size": 11, "color": "@soft"}}
    return {"shapes": [shape], "annotations": [{**note, a: value, f"{b}ref": "paper", b: 1, **end}]}


@dataclass(frozen=True)
class Column:
    """A column of a table.

    label: its heading. show: a function from a value to the text in the cell. kind: its CSS class. Columns of
    the class "n" are sorted as numbers, others as text.
    """

    label: str
    show: Callable[[Any], str] = str
    kind: str = "text"

    @classmethod
    def number(cls, label: str, digits: int = 3) -> Column:
        """A column of numbers, shown to `digits` significant digits; the CSV has all digits."""
        return cls(label, lambda value: format_number(value, digits), "n")

    @classmethod
    def count(cls, label: str) -> Column:
        """A column of whole numbers."""
        return cls(label, lambda value: f"{value:,.0f}", "n")


@dataclass(frozen=True)
class Table:
    """A table.

    name: of its CSV file, without ".csv". rows: a value for each column; None for an empty cell. title: the
    line above the table; a click on it folds or unfolds the table. first: how many rows a page shows before
    its script adds the others.
    """

    kind: ClassVar[str] = "table"
    name: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]] = field(repr=False)
    title: str = "Table of the values"
    first: int = 10

    @property
    def cells(self) -> list[list[tuple[str, str, str]]]:
        """For each row, (kind of the column, whole value as text, shown text) of each cell."""
        return [
            [
                (c.kind, "" if v is None else str(v), "–" if v is None else c.show(v))
                for c, v in zip(self.columns, row, strict=True)
            ]
            for row in self.rows
        ]

    def spec(self) -> list[list[Any]]:
        """The rows for the page's script: for each cell the shown text, or [whole value, shown text]."""
        return [[shown if raw == shown else [raw, shown] for _, raw, shown in cells] for cells in self.cells]


@dataclass(frozen=True)
class KeyFigure:
    """A number at the top of a page. note: the smaller text under it. order: figures are sorted by it."""

    label: str
    value: str
    unit: str = ""
    note: str = ""
    order: int = 50


@dataclass(frozen=True)
class Hint:
    """Advice that follows from the numbers.

    kind: "warn", a problem; "note", something to improve; "good", something fine; "fact", information. head:
    the first words, in bold. text: the words after them. order: hints of the same kind are sorted by it. It
    grows along the pipeline, because earlier problems cause later ones: data below 20, training 20, network
    30, motion of the character 40, channels 50, speed 60, cost of the pipeline 90.
    """

    kind: str
    head: str
    text: str
    order: int = 50


def citation(row: Mapping[str, Any], sources: Mapping[str, str]) -> str:
    """Source and table of a published number. If its publication also gives another value, this is added.

    row: the number's entry in `hobble/report/published.yaml`. sources: key of a source -> its authors and
    year.

    >>> citation({"source": "a", "table": "5.2", "other_figure": "3 in Appendix A"}, {"a": "Author (2021)"})
    'Author (2021), Table 5.2 (but 3 in Appendix A)'
    >>> citation({"source": "a"}, {"a": "Author (2021)"})
    'Author (2021)'
    """
    text = sources.get(row["source"], row["source"])
    if place := row.get("table"):
        text += f", {place}" if place.startswith(("Section", "Figure")) else f", Table {place}"
    return f"{text} (but {row['other_figure']})" if row.get("other_figure") else text


@dataclass(frozen=True)
class Paragraph:
    """A paragraph. Markup is not escaped, so only text from the source code may be Markup."""

    kind: ClassVar[str] = "words"
    text: str | Markup


@dataclass(frozen=True)
class KeyFigures:
    """A row of key figures."""

    kind: ClassVar[str] = "numbers"
    figures: Sequence[KeyFigure]


@dataclass(frozen=True)
class TemplatePart:
    """A part that a script of the page draws. template: file name of its HTML in this folder."""

    kind: ClassVar[str] = "fragment"
    template: str


Content = Chart | ChartGroup | Table | Paragraph | KeyFigures | TemplatePart


@dataclass(frozen=True)
class SectionPart:
    """One part of a section.

    order: its place in the section, from 0 (top) to 100 (end). content: None if there is nothing to show.
    open: whether the content is a table that is unfolded at first, and then has no scroll bar.
    """

    order: int
    content: Content | None = field(repr=False)
    open: bool = False


@dataclass(frozen=True)
class PageSection:
    """A section of a page. `join_sections` joins sections with the same `name` into one.

    title: the heading; only one of the joined sections needs it. order: a number; sections are sorted by it.
    nav: a shorter title for the list of contents; by default the title. note: a line under the heading, which
    is read before the section is opened.
    """

    name: str
    parts: Sequence[SectionPart] = field(repr=False)
    title: str = ""
    order: int = 50
    nav: str = ""
    note: str = ""


def join_sections(sections: Iterable[PageSection]) -> list[PageSection]:
    """The sections of a page, in order. Sections of the same name become one; empty sections are left out.

    A joined section has the parts of all its sections, except those that show nothing. Its other fields are
    those of its first section that has a title.
    """
    by_name: dict[str, list[PageSection]] = {}
    for section in sections:
        by_name.setdefault(section.name, []).append(section)
    out = []
    for name, same_name in by_name.items():
        parts = [p for s in same_name for p in s.parts if shows_something(p.content)]
        parts.sort(key=lambda part: part.order)
        titled = next((s for s in same_name if s.title), same_name[0])
        title = titled.title or name.replace("_", " ").capitalize()
        if parts:
            out.append(replace(titled, parts=parts, title=title, nav=titled.nav or title))
    return sorted(out, key=lambda section: section.order)


def shows_something(content: Content | None) -> bool:
    """False for None, a chart without traces, a table without rows, and a group or row without members."""
    if isinstance(content, Chart):
        return bool(content.traces or content.options)
    if isinstance(content, Table | KeyFigures):
        return bool(content.rows if isinstance(content, Table) else content.figures)
    return content is not None and any(getattr(content, "charts", (True,)))


Compared = Mapping[str, Any]  # the content of compare.json
# The page's CSS colours for the configurations. After the last, they begin again.
PALETTE = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0", "@g1", "@predicted")
# Split -> its name in the charts.
SPLITS = {"held_out": "held-out clips", "train": "training clips"}


def configuration_names(compared: Compared) -> list[str]:
    """The names of the configurations, in the order of the page."""
    return [entry["configuration"] for entry in compared["configurations"]]


def configuration_colours(compared: Compared) -> dict[str, str]:
    """Configuration -> its colour in all charts."""
    return {name: PALETTE[i % len(PALETTE)] for i, name in enumerate(configuration_names(compared))}


def dot_trace(name: str, x: Sequence, y: Sequence, colour: str, hover: str) -> Trace:
    """A dot at each point x, y. name: the configuration. hover: template of the text at a dot."""
    marker = {"color": colour, "size": 9, "opacity": 0.85}
    return marker_trace(name, x, y, marker, hovertemplate=f"{hover}<extra>%{{fullData.name}}</extra>")


def heatmap(
    x: Sequence[str], y: Sequence[str], z: Sequence[Sequence[float | None]], hover: str, **more: Any
) -> Trace:
    """A trace with a cell for each pair of names; the larger its value, the darker.

    z: a row of values for each item of y. hover: template of the text at a cell. more: further settings.
    """
    scale = {"colorscale": [[0, "@sunken"], [1, "@accent"]], "zmin": 0, "showscale": False}
    cells = {"type": "heatmap", "x": x, "y": y, "z": z, "xgap": 2, "ygap": 2, "hovertemplate": hover}
    return {**cells, **scale, **more}


def ordered_axis(names: Iterable[str], **more: Any) -> dict[str, Any]:
    """An axis with a row for each of `names`, from the bottom. more: further settings of the axis."""
    return {"categoryorder": "array", "categoryarray": list(names), "automargin": True, **more}


# Two values are called almost equal if the higher one exceeds the lower one by at most this share.
EQUAL = 0.03


@dataclass(frozen=True)
class ComparedValue:
    """A value of each configuration: a column of the table of configurations, and perhaps a verdict.

    order: a number; columns, and verdicts, are sorted by it. values: configuration -> value, or None if it
    was not measured. best: heading of the verdict on the lowest value, such as "Fastest"; "": no verdict.
    sentence: half of the verdict's sentence, with {name} and {value}. more: text that follows the sentence.

    >>> seconds = {"a": 2.0, "b": 3.0}
    >>> sentence = "a frame of {name} takes {value} s"
    >>> ComparedValue(1, Column.number("s", 2), seconds, "Fastest", sentence).verdict.text
    'A frame of a takes 2.0 s; a frame of b takes 3.0 s.'
    """

    order: int
    column: Column
    values: Mapping[str, Any] = field(repr=False)
    best: str = ""
    sentence: str = ""
    more: str = ""

    def shown(self, name: str) -> str | None:
        """The value of a configuration as text; None if there is none."""
        value = self.values.get(name)
        return None if value is None else self.column.show(value)

    @property
    def verdict(self) -> Hint | None:
        """The lowest value compared with the second; None if fewer than two configurations have a value."""
        known = sorted((value, name) for name, value in self.values.items() if value is not None)
        if not self.best or len(known) < 2:
            return None
        (low, best), (other, _), *_ = known
        first, second = (
            self.sentence.format(name=name, value=self.column.show(value)) for value, name in known[:2]
        )
        almost = "almost equal: " if other <= low * (1 + EQUAL) else ""
        text = f"{first}; {almost}{second}.{self.more}"
        return Hint("good", f"{self.best}: {best}.", text[0].upper() + text[1:])


Records = Sequence[Mapping[str, Any]]  # rows of a table: key -> value
LONG = 50  # a text of more characters is broken into lines
CAPTIONS = Path(__file__).with_name("captions.yaml")


@functools.cache
def _captions() -> dict[str, Any]:
    return yaml.safe_load(CAPTIONS.read_text(encoding="utf-8"))


def told(name: str) -> Any:
    """An entry of captions.yaml, with a dot before the name of a text in an entry that has several."""
    found: Any = _captions()
    for key in name.split("."):
        found = found[key]
    return found


def words(*names: str, **values: Any) -> str:
    """Texts of captions.yaml (see `told`), with `values` in place of the names in braces."""
    return " ".join(told(name).format(**values) for name in names)


def hint(name: str, **values: Any) -> Hint:
    """A hint of captions.yaml: an entry with its kind, order, head and text, see `words` and `Hint`."""
    found = told(name)
    head, text = (found[part].format(**values) for part in ("head", "text"))
    return Hint(found["kind"], head, text, found["order"])


def chart(
    name: str,
    traces: Sequence[Trace] = (),
    layout: Mapping[str, Any] | None = None,
    height: int = 340,
    *,
    choose: str | None = None,
    options: Mapping[str, Sequence[Any]] | None = None,
    option_layouts: Mapping[str, Mapping[str, Any]] | None = None,
    more: Sequence[str] = (),
    entry: str = "",
    **values: Any,
) -> Chart:
    """A chart with the title and the caption that captions.yaml has under its name. The rest: see `Chart`.

    entry: of captions.yaml, if it is not the chart's name. more: keys of further sentences that the entry
    has. values: see `words`.
    """
    entry = entry or name
    title = words(f"{entry}.title", **values)
    caption = words(*(f"{entry}.{key}" for key in ("caption", *more)), **values)
    menu = choose, options or {}, option_layouts or {}
    return Chart(name, title, caption, list(traces), layout or {}, height, *menu)


def table(
    name: str,
    records: Records,
    heads: Mapping[str, str] | None = None,
    title: str = "",
    show: Mapping[str, Callable[[Any], str]] | None = None,
) -> Table:
    """A table with a row for each record. Whole numbers are shown in full, others with three digits.

    heads: key of a record -> heading of its column; by default all keys of the first record, in words.
    show: key -> function from a value to its text.
    """
    heads = heads or {key: in_words(key) for key in (records[0] if records else ())}
    columns = {}
    for key, head in heads.items():
        value = next((r[key] for r in records if r.get(key) is not None), 0.0)
        if show and key in show:
            columns[key] = Column(head, show[key], "text" if isinstance(value, str) else "n")
        elif isinstance(value, bool):
            columns[key] = Column(head, lambda is_so: "yes" if is_so else "no")
        elif isinstance(value, str):
            is_long = any(len(r.get(key) or "") > LONG for r in records)
            columns[key] = Column(head, kind="long" if is_long else "text")
        else:
            columns[key] = Column.count(head) if isinstance(value, int) else Column.number(head)
    rows = [[record.get(key) for key in columns] for record in records]
    return Table(name, list(columns.values()), rows, title or "Table of the values")


def in_words(key: str) -> str:
    """A key of a measurement's JSON as the heading of a column.

    >>> in_words("largest_turn_degrees")
    'largest turn, °'
    """
    return key.replace("_cm", ", cm").replace("_degrees", ", °").replace("_", " ")


def told_table(
    name: str,
    records: Records,
    text: str,
    show: Mapping[str, Callable[[Any], str]] | None = None,
    **values: Any,
) -> Table:
    """A table with the title that captions.yaml has under the name `text`: "<entry>.<table>".

    There it may have headings, too: then it has `title` and `heads`. Columns of which no record has a value
    are left out. show: see `table`. values: see `words`.
    """
    found = told(text)
    found = {"title": found, "heads": None} if isinstance(found, str) else found
    heads = {
        key: head.format(**values)
        for key, head in (found["heads"] or {}).items()
        if any(record.get(key) is not None for record in records)
    }
    return table(name, records, heads, found["title"].format(**values), show)
