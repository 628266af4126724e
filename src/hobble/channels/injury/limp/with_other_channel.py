"""The limp of hurt legs while the values of another channel, such as a mood, are at their highest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.injury.crowd_severities import INJURY
from hobble.channels.injury.limp.crowd_walks import FigureWalk, walk_figures
from hobble.models.network import Network
from hobble.runtime.options import Runtime

SEVERITY = 10.0  # of the hurt leg
# A function (link, hurt walk, walk without injury) -> row with the effects of the injury.
RowOf = Callable[[str, FigureWalk, FigureWalk], dict[str, Any]]


def limps_together(
    network: Network, legs: Sequence[str], speed: float, seconds: float, runtime: Runtime, row_of: RowOf
) -> list[dict[str, Any]]:
    """A row for each trained column of another channel and each of the links `legs` at severity 10.

    The column, such as "sad", has its highest value. The effects are relative to the walk with that value and
    no injury. A column is left out if the character walks no whole cycle with that value and no injury.
    speed: target speed, cm a frame. row_of: makes a row.
    """
    names = [name for name in network.channels if name != INJURY]
    columns = [(name, column) for name in names for column in network.trained(name)]
    if not columns:
        return []
    cases = [(other, column, link) for other, column in columns for link in (None, *legs)]
    others = {
        name: [{column: channel(name).highest} if other == name else {} for other, column, _ in cases]
        for name in names
    }
    each = [{} if link is None else {link: SEVERITY} for *_, link in cases]
    figures = dict(
        zip(cases, walk_figures(network, each, speed, "walk", seconds, runtime, others), strict=True)
    )
    return [
        {"channel": other, "column": column, **row_of(link, figures[other, column, link], healthy)}
        for other, column in columns
        if (healthy := figures[other, column, None]).profile is not None
        for link in legs
    ]


def named_together(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each column of another channel, means over its rows: how the limps are recognised, and the speed.

    rows: from `limps_together`. impaired: share of windows in which the linear recogniser finds a limp.
    named: share in which the graded recogniser finds a limp, and not on the wrong side. wrong_side: share in
    which it finds a limp on the wrong side. speed_share: speed, divided by the speed without injury. walks:
    how many walks are judged; very slow ones may have no window with enough cycles.
    """
    out = []
    for other, column in dict.fromkeys((row["channel"], row["column"]) for row in rows):
        some = [row for row in rows if (row["channel"], row["column"]) == (other, column)]
        shares = {
            key: round(float(np.mean(values)), 5)
            for key in ("impaired", "named", "wrong_side", "speed_share")
            if (values := [row[key] for row in some if row[key] is not None])
        }
        answered = sum(row["named"] is not None for row in some)
        out.append({"channel": other, "column": column, "walks": answered, **shares})
    return out
