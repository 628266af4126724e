"""Measures the limp of hurt legs while a column of another channel, such as a mood, has its highest value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.injury.crowd_severities import INJURY
from hobble.channels.injury.limp.crowd_walks import FigureWalk, walk_figures
from hobble.models.network import Network
from hobble.runtime.options import Runtime

SEVERITY = 10.0  # of the link of a leg that hurts
# A function with the arguments link, hurt walk and walk without injury. It returns a row (name -> value) with
# the effects of the injury.
RowOf = Callable[[str, FigureWalk, FigureWalk], dict[str, Any]]


def limps_together(
    network: Network, legs: Sequence[str], speed: float, seconds: float, runtime: Runtime, row_of: RowOf
) -> list[dict[str, Any]]:
    """The rows of walks with one hurt link and one column of another channel at its highest value.

    There is a row for each pair of a column, such as "sad", and a link in `legs`, which hurts at severity 10.
    Only columns that were above 0 in training are used (all columns if none was). The row's effects are
    relative to the walk with the same value of the column and no injury. A column is left out if this walk
    has no whole cycle.

    legs: names of the links of legs. speed: target speed, cm a frame. seconds: length of each walk. row_of:
    makes a row.
    """
    names = [name for name in network.channels if name != INJURY]
    columns = [(name, column) for name in names for column in network.trained_labels(name)]
    if not columns:
        return []
    # A figure walks for each case. Its link is None if it has no injury.
    cases = [(other, column, link) for other, column in columns for link in (None, *legs)]
    other_channels = {
        name: [{column: channel(name).highest} if other == name else {} for other, column, _ in cases]
        for name in names
    }
    injuries = [{} if link is None else {link: SEVERITY} for *_, link in cases]
    figures = dict(
        zip(
            cases,
            walk_figures(network, injuries, speed, "walk", seconds, runtime, other_channels),
            strict=True,
        )
    )
    return [
        {"channel": other, "column": column, **row_of(link, figures[other, column, link], healthy)}
        for other, column in columns
        if (healthy := figures[other, column, None]).profile is not None
        for link in legs
    ]


def named_together(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each column of another channel, with means over the rows of `limps_together`.

    A window is a stretch of four seconds of a walk. impaired: share of windows in which the linear recogniser
    finds a limp. named: share of windows in which the graded recogniser finds a limp, and not on the wrong
    side. wrong_side: share of windows in which the graded recogniser finds a limp on the wrong side.
    speed_share: speed, divided by the speed without injury. walks: number of walks that are judged. A very
    slow walk is not judged if no window has enough cycles.
    """
    out = []
    for other, column in dict.fromkeys((row["channel"], row["column"]) for row in rows):
        of_column = [row for row in rows if (row["channel"], row["column"]) == (other, column)]
        shares = {
            key: round(float(np.mean(values)), 5)
            for key in ("impaired", "named", "wrong_side", "speed_share")
            if (values := [row[key] for row in of_column if row[key] is not None])
        }
        judged = sum(row["named"] is not None for row in of_column)
        out.append({"channel": other, "column": column, "walks": judged, **shares})
    return out
