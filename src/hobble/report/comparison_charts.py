"""What the charts of the comparison page have in common: names, colours and dots of configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.report.charts import Trace

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
    """A plotly trace with a dot at each point x, y. name: the configuration. hover: template of the text that
    appears when the pointer is on a dot."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": list(x),
        "y": list(y),
        "marker": {"color": colour, "size": 9, "opacity": 0.85},
        "hovertemplate": f"{hover}<extra>%{{fullData.name}}</extra>",
    }
