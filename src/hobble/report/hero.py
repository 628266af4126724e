"""The state in which the page opens: which part of the body hurts, and how much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

OPENING_SHARE = 0.7  # of the highest value: easy to see, but not the maximum


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    `part`: the label of the slider whose column changes the walk most according to `measured`, the JSON of
    the measurements; the first slider if they do not say; None if no channel has parts of the body. `value`:
    what the slider is set to.
    """
    one = placed(playable)
    if one is None:
        return {"part": None, "value": 0}
    parts = {one["columns"][i]: label for label, i in one["sliders"].items()}
    seen = {
        row["link"]: row.get("from_healthy_cm") or 0.0
        for found in measured
        for row in found.get("responses") or ()
        if row.get("gait") == "walk" and row["link"] in parts
    }
    best = max(seen, key=lambda column: seen[column]) if seen else next(iter(parts), None)
    return {"part": parts.get(best) if best else None, "value": round(OPENING_SHARE * one["highest"], 6)}


def placed(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with parts of the body and a slider; None if there is none."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)
