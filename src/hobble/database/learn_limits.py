"""Collect the speeds of clips with channel values while their rows are stored, to learn speed limits."""

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
    """For each channel of the layout whose values slow a body: what learns its speed limits."""
    slowing = [(one, columns) for name, columns in layout.channels if (one := channel(name)).slows]
    if not slowing:
        return {}
    rig = Skeleton.from_dict(skeleton)
    return {
        one.name: LimitLearner(one.highest, _other_side(one, columns, rig), len(GAITS))
        for one, columns in slowing
    }


def _other_side(one: Channel, columns: int, rig: Skeleton) -> np.ndarray:
    """(columns,) for each column of a channel, the column of the same part on the other side of the body.

    A column is its own partner if the rig does not pair left and right.
    """
    own = np.arange(columns, dtype=float)
    try:
        return one.mirror(own[None], rig)[0].astype(int)
    except HobbleError:  # each side is learnt separately
        return own.astype(int)


def add_rows(learners: Mapping[str, LimitLearner], rows: ClipRows, source: str | None) -> None:
    """Add the rows of a clip. source: the healthy clip that a hurt version was made from; None for others."""
    if not learners or not len(rows):
        return
    layout = rows.layout
    shares = rows.x[:, body_layout(layout).x_gait].reshape(len(rows), len(GAITS), layout.samples)
    active = {name: rows.channels[name].any(axis=1) for name, _ in layout.channels}
    for name, learner in learners.items():
        others = [on for other, on in active.items() if other != name]
        learner.add(
            rows.clip,
            gait=shares[:, :, layout.samples // 2],
            velocity=rows.y[:, layout.y_root_velocity],
            values=rows.channels[name],
            cycle=rows.cycle,
            others=np.any(others, axis=0) if others else np.zeros(len(rows), bool),
            source=source,
        )
