"""With what the page opens: which part hurts, how much, and what is said where nothing can."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

SEVERITY = 7  # hard enough that a visitor sees it, and not yet the most that there is


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """`part`: the label of the part of the body that hurts first, the one that changes the walk most by what
    was `measured` of responses to it; the first one where that does not tell. `severity`: how much."""
    parts = {playable["links"][i]: label for label, i in (playable.get("parts") or {}).items()}
    seen = {
        row["link"]: row.get("from_healthy_cm") or 0.0
        for found in measured
        for row in found.get("responses") or ()
        if row.get("gait") == "walk" and row["link"] in parts
    }
    best = max(seen, key=lambda link: seen[link]) if seen else next(iter(parts), None)
    return {"part": parts.get(best) if best else None, "severity": SEVERITY}
