"""Charts and tables of measurements, as parts of pages.

Titles and captions are in report/captions.yaml, each under the name of its chart.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.report.gather import PUBLISHED
from hobble.report.parts import Chart, Column, Table, Trace, line_trace, marker_trace

CAPTIONS = PUBLISHED.with_name("captions.yaml")
STRIP_WIDTH, STRIP_HEIGHT = 110.0, 205.0  # cm between the figures of a strip
# Of a strip, whose figures stand for themselves.
BARE = {"showgrid": False, "zeroline": False, "showticklabels": False}
Records = Sequence[Mapping[str, Any]]  # rows of a measurement's JSON


@functools.cache
def _captions(path: Path) -> dict[str, Any]:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def words(name: str, *more: str, **values: Any) -> str:
    """A text of captions.yaml, with `values` in place of the names in braces.

    name: of a text, or of an entry that has several: "<entry>.<text>". more: further texts that follow it.
    """
    found = []
    for one in (name, *more):
        entry, _, key = one.partition(".")
        text = _captions(CAPTIONS)[entry]
        found.append((text[key] if key else text).format(**values))
    return " ".join(found)


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
    title = words(f"{entry}.title")
    caption = words(*(f"{entry}.{key}" for key in ("caption", *more)), **values)
    menu = choose, options or {}, option_layouts or {}
    return Chart(name, title, caption, list(traces), layout or {}, height, *menu)


def table(
    name: str,
    records: Records,
    heads: Mapping[str, str] | None = None,
    title: str = "",
    show: Mapping[str, Callable[[Any], str]] | None = None,
    long: Collection[str] = (),
) -> Table:
    """A table with a row for each record. Whole numbers are shown in full, others with three digits.

    heads: key of a record -> heading of its column; by default all keys of the first record, in words.
    show: key -> function from a value to its text. long: keys of long texts.
    """
    heads = heads or {key: in_words(key) for key in (records[0] if records else ())}
    columns = {}
    for key, head in heads.items():
        value = next((r[key] for r in records if r.get(key) is not None), 0.0)
        if show and key in show:
            columns[key] = Column(head, show[key])
        elif isinstance(value, str | bool):
            columns[key] = Column(head, kind="long" if key in long else "text")
        else:
            columns[key] = Column.count(head) if isinstance(value, int) else Column.number(head)
    return Table.of(name, columns, records, title or "Table of the values")


def in_words(key: str) -> str:
    """A key of a measurement's JSON as the heading of a column.

    >>> in_words("largest_turn_degrees")
    'largest turn, °'
    """
    return key.replace("_cm", ", cm").replace("_degrees", ", °").replace("_", " ")


def boxes(name: str, colour: str, **values: Any) -> Trace:
    """The trace of boxes over values `y`, or with their edges given. values: as plotly takes them."""
    return {
        "type": "box",
        "name": name,
        "line": {"width": 1.6, "color": colour},
        "boxpoints": False,
        **values,
    }


def ours_and_published(
    names: Sequence[str],
    ours: Mapping[str, Sequence[float]],
    published: Mapping[str, Sequence[float]],
    **more: Any,
) -> list[Trace]:
    """The traces of a box over our values of each configuration, and beside it of one over published ones."""
    return [
        boxes(f"{name}, {whose}", colour, y=list(values[name]), boxmean=True, **more)
        for name in names
        for whose, values, colour in (("ours", ours, "@accent"), ("published", published, "@muted"))
        if len(values.get(name, ()))
    ]


def stick_figures(skeleton: Json, poses: Array, colour: str, view: str = "side", up: float = 0.0) -> Trace:
    """The trace of figures side by side, STRIP_WIDTH apart.

    skeleton: the content of its file. poses: (N, J, 3) cm. view: from the "side" (walking to the right), the
    "front" or "behind". up: how far they stand above the strip's ground, cm.
    """
    joints = list(skeleton["joints"])
    bones = [(joints.index(j["parent"]), i) for i, j in enumerate(skeleton["joints"].values()) if j["parent"]]
    across = {"side": poses[..., 2], "front": poses[..., 0], "behind": -poses[..., 0]}[view]
    x, y = across + STRIP_WIDTH * np.arange(len(poses))[:, None], poses[..., 1] + up
    xs, ys = ([v for pose in axis for a, b in bones for v in (pose[a], pose[b], None)] for axis in (x, y))
    return line_trace("", xs, ys, colour, width=3, showlegend=False, hoverinfo="skip")


def strip_texts(texts: Sequence[str], places: Sequence[tuple[float, float]]) -> Trace:
    """The trace of texts at some places of a strip."""
    x, y = [x for x, _ in places], [y for _, y in places]
    trace = marker_trace("", x, y, {"size": 1}, mode="text", text=list(texts))
    return {**trace, "showlegend": False, "hoverinfo": "skip"}
