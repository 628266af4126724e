"""The state in which the page opens: which column of which channel has a value, and what value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

OPENING = 7  # tenths of the highest value: easy to see, but not the maximum


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    measured: the JSON of the measurements. In the result, `part` is the label of a slider: the one that makes
    the walk limp most according to `measured`; if no limps were measured, the one that changes the pose most;
    if that was not measured either, the first one. It is None if no channel has sliders. `value`: what the
    dial is set to, in tenths of the highest value.
    """
    one = first_shown(playable)
    if one is None:
        return {"part": None, "value": 0}
    parts = {one["columns"][i]: label for label, i in one["sliders"].items()}
    seen: dict[str, tuple[float, float]] = {}
    for found in measured:
        for key, size in (("responses", _pose_change), ("sizes", _limp)):
            for row in found.get(key) or ():
                if row.get("gait") == "walk" and row["link"] in parts:
                    seen[row["link"]] = max(seen.get(row["link"], (0.0, 0.0)), size(row))
    best = max(seen, key=lambda column: seen[column]) if seen else next(iter(parts))
    return {"part": parts[best], "value": OPENING}


def _pose_change(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how far severity 10 moves the joints, cm. It is below every rank by limp (`_limp`).

    A bent back changes the pose most, but a visitor looks for a limp.
    """
    return 0.0, row.get("from_healthy_cm") or 0.0


def _limp(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how uneven the walk is: the changes of stance, step and knee of the hurt leg, added up."""
    shares = [row.get(name) for name in ("step_hurt", "knee_hurt")]
    return abs(row.get("stance") or 0.0) + sum(abs(1 - share) for share in shares if share is not None), 0.0


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with parts of the body and a slider; None if there is none."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def first_shown(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: one with parts of the body, else the first with sliders."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)
