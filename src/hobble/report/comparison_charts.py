"""What the charts of the comparison page share: names, colours, dots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.report.charts import Trace

Compared = Mapping[str, Any]
PALETTE = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0", "@g1", "@predicted")
SPLITS = {"held_out": "held-out clips", "train": "training clips"}


def names(compared: Compared) -> list[str]:
    """The names of the configurations, in order."""
    return [entry["configuration"] for entry in compared["configurations"]]


def colours(compared: Compared) -> dict[str, str]:
    """A colour for each configuration, the same in every chart."""
    return {name: PALETTE[i % len(PALETTE)] for i, name in enumerate(names(compared))}


def dots(name: str, x: Sequence, y: Sequence, colour: str, hover: str) -> Trace:
    """Dots of one configuration. hover: plotly template of the text that the pointer shows."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": list(x),
        "y": list(y),
        "marker": {"color": colour, "size": 9, "opacity": 0.85},
        "hovertemplate": f"{hover}<extra>%{{fullData.name}}</extra>",
    }
