"""The state in which the page opens: which value of which channel the figure has, and how much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

OPENING = 7  # tenths of the highest value: easy to see, but not the maximum


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    `part`: the label of the slider whose column changes the walk most according to `measured`, the JSON of
    the measurements; the first slider if they do not say; None if no channel has sliders. `value`: what the
    dial is set to, in tenths of the highest value.
    """
    one = first_shown(playable)
    if one is None:
        return {"part": None, "value": 0}
    parts = {one["columns"][i]: label for label, i in one["sliders"].items()}
    seen = {
        row["link"]: row.get("from_healthy_cm") or 0.0
        for found in measured
        for row in found.get("responses") or ()
        if row.get("gait") == "walk" and row["link"] in parts
    }
    best = max(seen, key=lambda column: seen[column]) if seen else next(iter(parts))
    return {"part": parts[best], "value": OPENING}


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with parts of the body and a slider; None if there is none."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def first_shown(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: one with parts of the body, else the first with sliders."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)
