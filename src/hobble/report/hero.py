"""The state in which the page opens: which column of which channel has a value, and what value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

OPENING = 7  # value when the page opens, in tenths of the highest: easy to see, but not the maximum


def opening(playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    playable: from `hobble.report.playable`. measured: the JSON of the measurements.

    In the result, `part` is the label of the slider that makes the walk limp most according to `measured`; if
    no limps were measured, of the slider that changes the pose most; if poses were not measured either, of
    the first slider. It is None if no channel has sliders. `value` is the slider's value, in tenths of the
    highest.
    """
    channel = first_shown(playable)
    if channel is None:
        return {"part": None, "value": 0}
    labels = {channel["columns"][i]: label for label, i in channel["sliders"].items()}
    ranks: dict[str, tuple[float, float]] = {}
    for results in measured:
        for table, rank in (("responses", _pose_change), ("sizes", _limp)):
            for row in results.get(table) or ():
                if row.get("gait") == "walk" and row["link"] in labels:
                    ranks[row["link"]] = max(ranks.get(row["link"], (0.0, 0.0)), rank(row))
    best = max(ranks, key=lambda column: ranks[column]) if ranks else next(iter(labels))
    return {"part": labels[best], "value": OPENING}


def _pose_change(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how far severity 10 moves the joints, cm. It is below every rank that `_limp` gives.

    The limp comes first because a bent back changes the pose most, but a visitor looks for a limp.
    """
    return 0.0, row.get("from_healthy_cm") or 0.0


def _limp(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how uneven the walk is: the changes of stance, step and knee of the hurt leg, added up."""
    ratios = [row.get(name) for name in ("step_hurt", "knee_hurt")]
    return abs(row.get("stance") or 0.0) + sum(abs(1 - ratio) for ratio in ratios if ratio is not None), 0.0


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with parts of the body and a slider; None if there is none."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def first_shown(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: one with parts of the body, else the first with sliders."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)
