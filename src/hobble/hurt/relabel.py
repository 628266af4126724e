"""Moves the labels of the healthy clip to the times of the hurt clip, whose steps are slower and uneven."""

from __future__ import annotations

import numpy as np

from hobble.hurt.body_parts import LEFT, RIGHT
from hobble.hurt.interpolate import interpolate_values
from hobble.hurt.timing import Timing
from hobble.labels.clip_labels import Labels
from hobble.labels.phase import dropped_frames, find_cycles, phase_of_footsteps


def relabel(labels: Labels, timing: Timing, zero: str, margins: str) -> Labels:
    """The labels of the hurt clip. A limping walk still has the gait "walk".

    labels: of the healthy clip. timing: which of its frames the hurt clip shows, and when. zero: the foot
    that lands at phase 0, "left" or "right". margins: which cycles are used, a key of MARGINS in
    `hobble.labels.phase`.
    """
    frames = len(timing)
    last = len(labels) - 1
    nearest = [np.clip(np.round(timing.leg_frames[:, side]).astype(int), 0, last) for side in (LEFT, RIGHT)]
    # Columns of contacts: left heel, left toe, right heel, right toe. So `column // 2` is the side.
    contacts = np.stack([labels.contacts[nearest[column // 2], column] for column in range(4)], axis=1)
    footsteps = labels.footsteps.copy()  # a row holds a right landing, a left landing and a mark
    for column, side in ((0, RIGHT), (1, LEFT)):
        footsteps[:, column] = timing.new_frames(footsteps[:, column], side)
    phase, known = phase_of_footsteps(footsteps, frames)
    known &= ~dropped_frames(footsteps, frames)
    body = np.clip(np.round(timing.body_frames).astype(int), 0, last)
    cycles, _ = find_cycles(footsteps, frames, zero, margins)
    return Labels(
        contacts=contacts,
        phase=phase if zero == "right" else (phase + 0.5) % 1.0,
        phase_known=known & labels.phase_known[body],
        gait=interpolate_values(labels.gait, timing.body_frames),
        footsteps=footsteps,
        cycles=cycles,
    )
