"""Chooses the slider that is set when the report page opens, and its value.

The top of the page shows a walking character with this value of a channel.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

# Value of the slider when the page opens, in tenths of the highest: easy to see, but not the maximum.
OPENING_VALUE = 7


def opening_slider(playable: Mapping[str, Any], measurements: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    playable: data of the character, from `playable_data` in `hobble.report.playable`. measurements: the
    results of each measurement.

    In the result, `part` is the label of a slider, or None if no channel has sliders. It is the slider that
    makes the walk limp most. If no limps were measured, it is the slider that changes the pose most. If poses
    were not measured either, it is the first slider. `value` is its value, in tenths of the highest.
    """
    channel = opening_channel(playable)
    if channel is None:
        return {"part": None, "value": 0}
    # Column -> label of its slider.
    labels = {channel["columns"][i]: label for label, i in channel["sliders"].items()}
    # Column -> its highest rank. A row of a table names its column under "link".
    ranks: dict[str, tuple[float, float]] = {}
    for results in measurements:
        # `responses`: how much the pose changes with severity. `sizes`: how large each limp is.
        for table, rank in (("responses", _pose_change_rank), ("sizes", _limp_rank)):
            for row in results.get(table) or ():
                if row.get("gait") == "walk" and row["link"] in labels:
                    ranks[row["link"]] = max(ranks.get(row["link"], (0.0, 0.0)), rank(row))
    best = max(ranks, key=lambda column: ranks[column]) if ranks else next(iter(labels))
    return {"part": labels[best], "value": OPENING_VALUE}


def _pose_change_rank(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how far severity 10 moves the joints, cm. It is below the rank of every walk that limps.

    Limps come first because people open the page to see a limp. If only the change of pose counted, the back
    would win, because a hurt back bends the whole figure.
    """
    return 0.0, row.get("from_healthy_cm") or 0.0


def _limp_rank(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how much the limp changes the walk: the changes of stance, step and knee, added up.

    `stance`: how much longer the sound leg stands than the hurt one, as a share of the cycle; the healthy
    walk has 0. `step_hurt`, `knee_hurt`: length of the step and range of the knee of the hurt leg, divided
    by those of the healthy walk.
    """
    ratios = [row.get(name) for name in ("step_hurt", "knee_hurt")]
    return abs(row.get("stance") or 0.0) + sum(abs(1 - ratio) for ratio in ratios if ratio is not None), 0.0


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with a slider and columns that stand for parts of the body, or None."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def opening_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: `body_channel`, or else the first with sliders, or None."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)
