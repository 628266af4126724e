"""What the charts of the comparison page have in common: names, colours and dots of configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.report.charts import Trace

Compared = Mapping[str, Any]  # the content of compare.json
# The page's CSS colours for the configurations.
PALETTE = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0", "@g1", "@predicted")
SPLITS = {"held_out": "held-out clips", "train": "training clips"}


def names(compared: Compared) -> list[str]:
    """The names of the configurations, in order."""
    return [entry["configuration"] for entry in compared["configurations"]]


def colours(compared: Compared) -> dict[str, str]:
    """Configuration -> its colour in all charts."""
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
