"""While the rows of clips are stored, collects their speeds and channel values, to learn speed limits."""

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
from hobble.rows.compose import body_layout
from hobble.rows.layout import GAITS, RowLayout


def limit_learners(layout: RowLayout, skeleton: Mapping[str, Any]) -> dict[str, LimitLearner]:
    """Channel -> learner of its speed limits, for each channel of the layout whose values slow a body."""
    slowing = [(slow, columns) for name, columns in layout.channels if (slow := channel(name)).slows]
    if not slowing:
        return {}
    rig = Skeleton.from_dict(skeleton)
    return {
        slow.name: LimitLearner(slow.highest, _other_side(slow, columns, rig), len(GAITS))
        for slow, columns in slowing
    }


def _other_side(slow: Channel, columns: int, rig: Skeleton) -> np.ndarray:
    """(columns,) for each column of a channel, the column of the same part on the other side of the body.

    If the rig does not pair left and right, each column is its own other side.
    """
    numbers = np.arange(columns, dtype=float)
    try:
        return slow.mirror(numbers[None], rig)[0].astype(int)
    except HobbleError:  # then the limits of each side are learnt separately
        return numbers.astype(int)


def add_rows(learners: Mapping[str, LimitLearner], rows: ClipRows, source: str | None) -> None:
    """Add the rows of a clip to all learners.

    source: the healthy clip from which a hurt version was made; None for other clips.
    """
    if not learners or not len(rows):
        return
    layout = rows.layout
    shares = rows.x[:, body_layout(layout).x_gait].reshape(len(rows), len(GAITS), layout.samples)
    above_0 = {name: rows.channels[name].any(axis=1) for name, _ in layout.channels}
    for name, learner in learners.items():
        others = [rows_on for other, rows_on in above_0.items() if other != name]
        learner.add(
            rows.clip,
            gait=shares[:, :, layout.samples // 2],
            velocity=rows.y[:, layout.y_root_velocity],
            values=rows.channels[name],
            cycle=rows.cycle,
            others=np.any(others, axis=0) if others else np.zeros(len(rows), bool),
            source=source,
        )
