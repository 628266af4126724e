"""Collects the speeds and channel values of clips while a shard is written, to learn speed limits.

A channel is a group of inputs of the network, such as how severely each bone hurts. A shard is a part of the
database with the rows of some clips. The limits say how fast a body with certain channel values can go.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.channel import Channel
from hobble.channels.speed_limits import LimitLearner
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import GAITS, RowLayout, body_layout


def make_limit_learners(layout: RowLayout, skeleton: Mapping[str, Any]) -> dict[str, LimitLearner]:
    """For each channel of the layout whose values slow a body: its name -> a learner of its speed limits.

    skeleton: see `Skeleton.to_dict`.
    """
    slowing = [(slow, columns) for name, columns in layout.channels if (slow := channel(name)).slows]
    if not slowing:
        return {}
    rig = Skeleton.from_dict(skeleton)
    return {
        slow.name: LimitLearner(slow.highest, _other_side(slow, columns, rig), len(GAITS))
        for slow, columns in slowing
    }


def _other_side(slow: Channel, columns: int, rig: Skeleton) -> np.ndarray:
    """(columns,) for each column of a channel, the index of the column for the other side of the body.

    If the rig does not pair left and right, each column gets its own index, so that the limits of both sides
    are learnt separately.
    """
    # The channel mirrors values, so a row with the indices of the columns shows which columns swap.
    numbers = np.arange(columns, dtype=float)
    try:
        return slow.mirror(numbers[None], rig)[0].astype(int)
    except HobbleError:
        return numbers.astype(int)


def add_rows(learners: Mapping[str, LimitLearner], rows: ClipRows, source: str | None) -> None:
    """Add the rows of a clip to all learners.

    source: for a hurt version (a clip computed from a healthy clip), the name of the healthy clip; else None.
    """
    if not learners or not len(rows):
        return
    layout = rows.layout
    shares = rows.x[:, body_layout(layout).x_gait].reshape(len(rows), len(GAITS), layout.samples)
    is_above_0 = {name: rows.channels[name].any(axis=1) for name, _ in layout.channels}
    for name, learner in learners.items():
        others = [above_0 for other, above_0 in is_above_0.items() if other != name]
        learner.add(
            rows.clip,
            gait=shares[:, :, layout.samples // 2],  # the sample in the middle is the present frame
            velocity=rows.y[:, layout.y_root_velocity],
            values=rows.channels[name],
            cycle=rows.cycle,
            others=np.any(others, axis=0) if others else np.zeros(len(rows), bool),
            source=source,
        )
