"""Charts as plotly specifications.

A colour such as "@accent" stands for the CSS variable --accent of the page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Trace = dict[str, Any]


@dataclass(frozen=True)
class Chart:
    """A chart, with a caption that says how to read it.

    name: the chart's id in the page. traces, layout: as plotly takes them. height: pixels.

    A chart with a menu has `options` instead of `traces`: text in the menu -> the traces to show. choose:
    the menu's label. option_layouts: text in the menu -> changes of the layout.
    """

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
        """What the page's script needs to draw the chart: its id, traces, layout and menu."""
        traces = list(self.traces) or list(next(iter(self.options.values()), ()))
        return {
            "name": self.name,
            "traces": _escaped(traces),
            "layout": _escaped({"height": self.height, **self.layout}),
            "options": [
                {"label": key, "traces": _escaped(list(value)), "layout": self.option_layouts.get(key)}
                for key, value in self.options.items()
            ],
        }


@dataclass(frozen=True)
class ChartGroup:
    """Small charts that share a title and a caption.

    name: the group's id in the page. choose: label of a menu that selects one of the `options` of all charts;
    "" for no menu.
    """

    name: str
    title: str
    caption: str
    charts: Sequence[Chart] = field(repr=False)
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


def reference_line(
    value: float, text: str, vertical: bool = True, colour: str = "@soft"
) -> tuple[dict, dict]:
    """A dotted line across the whole plot at `value`, with a text at its end.

    vertical: whether the line is vertical. `value` is on the x axis for a vertical line, otherwise on the y
    axis. Returns the line as a plotly shape and the text as a plotly annotation.
    """
    dotted = {"type": "line", "line": {"color": colour, "width": 1, "dash": "dot"}}
    note = {"text": text, "showarrow": False, "font": {"size": 11, "color": colour}}
    if vertical:
        shape = {**dotted, "x0": value, "x1": value, "yref": "paper", "y0": 0, "y1": 1}
        return shape, {**note, "x": value, "yref": "paper", "y": 1, "yanchor": "bottom"}
    shape = {**dotted, "y0": value, "y1": value, "xref": "paper", "x0": 0, "x1": 1}
    return shape, {**note, "y": value, "xref": "paper", "x": 1, "xanchor": "right", "yanchor": "bottom"}
