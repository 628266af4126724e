"""Charts as plotly specifications. Colours are names of the page's CSS colours, such as "@accent"."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Trace = dict[str, Any]


@dataclass(frozen=True)
class Chart:
    """A chart, with a caption that says how to read it.

    traces: plotly traces. options: option -> its traces, instead of `traces`; a menu with the label `choose`
    selects an option. option_layouts: option -> changes of the layout. height: pixels.
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
        """The data for the page's script."""
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
    """Small charts that share a title and a caption, and a menu of their options if `choose` is not empty."""

    name: str
    title: str
    caption: str
    charts: Sequence[Chart] = field(repr=False)
    choose: str = ""


def _escaped(value: Any) -> Any:
    """`value` with "<" and "&" of every text escaped, because plotly reads texts as HTML.

    Hover templates are left alone: they come from the code and only refer to data.
    """
    if isinstance(value, Mapping):
        return {k: v if k == "hovertemplate" else _escaped(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_escaped(item) for item in value]
    return value.replace("&", "&amp;").replace("<", "&lt;") if isinstance(value, str) else value


def axis(title: str, **more: Any) -> dict[str, Any]:
    """An axis with a title."""
    return {"title": {"text": title}, **more}


def log_axis(title: str, values: Iterable[float | None]) -> dict[str, Any]:
    """A logarithmic axis with ticks at 1, 2 and 5 times the powers of ten, as plain numbers."""
    found = [v for v in values if v is not None and v > 0]
    if not found:
        return axis(title, type="log")
    decades = range(math.floor(math.log10(min(found))) - 1, math.ceil(math.log10(max(found))) + 1)
    ticks = [float(f"{digit}e{decade}") for decade in decades for digit in (1, 2, 5)]
    return axis(title, type="log", tickvals=ticks, ticktext=[f"{tick:g}" for tick in ticks])


def line(name: str, x: Sequence, y: Sequence, colour: str, **more: Any) -> Trace:
    """A line. `dash` and `width` set its stroke; `more` goes to the trace."""
    stroke = {"color": colour, "width": more.pop("width", 2), "dash": more.pop("dash", "solid")}
    mode = more.pop("mode", "lines")
    return {"type": "scatter", "mode": mode, "name": name, "x": list(x), "y": list(y), "line": stroke, **more}


def mark(value: float, text: str, vertical: bool = True, colour: str = "@soft") -> tuple[dict, dict]:
    """A dotted line across the plot at `value`, and a text at its end, as plotly's (shape, annotation)."""
    across = {"type": "line", "line": {"color": colour, "width": 1, "dash": "dot"}}
    note = {"text": text, "showarrow": False, "font": {"size": 11, "color": colour}}
    if vertical:
        shape = {**across, "x0": value, "x1": value, "yref": "paper", "y0": 0, "y1": 1}
        return shape, {**note, "x": value, "yref": "paper", "y": 1, "yanchor": "bottom"}
    shape = {**across, "y0": value, "y1": value, "xref": "paper", "x0": 0, "x1": 1}
    return shape, {**note, "y": value, "xref": "paper", "x": 1, "xanchor": "right", "yanchor": "bottom"}
