"""With what the page opens: which part of the body is told something, and how much of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

SHARE = 0.7  # of the highest: enough that a visitor sees it, and not yet the most that there is


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """`part`: the label of the slider that opens, of the channel that lies in the body: the one that
    changes the
    walk most by what was `measured` of responses to it; the first one where that does not tell. `value`: how
    much."""
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
    return {"part": parts.get(best) if best else None, "value": round(SHARE * one["highest"], 6)}


def placed(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel of a character that lies in parts of the body and has a slider; None where
    none has."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)
