"""Times of the hurt clip: the frame of the healthy clip (source) that body and legs show in a new frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from hobble.core.quat import Array
from hobble.hurt.body_parts import LEFT, RIGHT
from hobble.hurt.effects import Effects
from hobble.hurt.healthy_clip import HealthyClip

# The times from landing to leaving and from leaving to landing shrink at most to this share.
LEAST_SHARE = 0.57
JOG_STRIDE = 0.15  # a jog gets only this share of a change of stride time: flight cannot last longer
JOG_SHIFT = 0.6  # a jog gets only this share of the shifts of landing and leaving: its stances are short
MOST_SHIFT = 0.3  # cycles: shifts of landing and leaving stay below this


@dataclass(frozen=True)
class Timing:
    """Source frames, with fractions, that are shown in each of N new frames.

    body: (N,). legs: (N, 2) left and right. begins: (F,) the new frame that would show each of the F source
    frames if only the cadence changed. slower: (F,) factor of the stride time.
    """

    body: Array = field(repr=False)
    legs: Array = field(repr=False)
    begins: Array = field(repr=False)
    slower: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.body)

    def new_frames(self, when: Array, leg: int | None = None) -> Array:
        """The new frames (with fractions) that show source frames `when`, for the body or a leg."""
        shown = self.body if leg is None else self.legs[:, leg]
        return np.interp(when, shown, np.arange(len(shown)))


def retime(source: HealthyClip, effects: Effects) -> Timing:
    """Slow the cadence, and shift each foot's landing and leaving within the cycle."""
    stride = 1 + effects.body["stride"] * (1 - (1 - JOG_STRIDE) * source.jog)
    begins = np.concatenate([[0.0], np.cumsum((stride[1:] + stride[:-1]) / 2)])
    new_cycle = source.cycle * stride
    new = np.arange(int(begins[-1] + 1e-6) + 1, dtype=float)
    legs = []
    landings: list[tuple[float, float]] = []
    shares = 1 - (1 - JOG_SHIFT) * source.jog
    for side in (LEFT, RIGHT):
        land = _limited(effects.sided["land"][:, side]) * shares * new_cycle
        off = _limited(effects.sided["off"][:, side]) * shares * new_cycle
        events = []
        for stance in source.stances[side]:
            events += [(stance.land, land), (stance.off, off)]
        shifted = [(at, float(np.interp(at, np.arange(len(source)), shift))) for at, shift in events[1:-1]]
        landings += shifted[1::2]
        legs.append(_source_frames(shifted, begins, new))
    return Timing(_source_frames(sorted(landings), begins, new), np.stack(legs, axis=1), begins, stride)


def _limited(shift: Array) -> Array:
    return MOST_SHIFT * np.tanh(shift / MOST_SHIFT)


def _source_frames(events: list[tuple[float, float]], begins: Array, new: Array) -> Array:
    """(N,) source frames shown in the frames `new`. events: (source frame, delay in new frames)."""
    last = len(begins) - 1
    at, goal = [0.0], [0.0]
    for when, later in events:
        if at[-1] + 1.0 <= when <= last - 1.0:
            at.append(when)
            goal.append(float(np.interp(when, np.arange(last + 1), begins)) + later)
    at.append(float(last))
    goal.append(float(begins[-1]))
    least = LEAST_SHARE * np.diff(np.interp(at, np.arange(last + 1), begins))
    for i, gap in enumerate(least[:-1]):
        goal[i + 1] = max(goal[i + 1], goal[i] + gap)
    for i in range(len(at) - 2, 0, -1):
        goal[i] = min(goal[i], goal[i + 1] - least[i])
    if last < 1:
        return np.zeros(len(new))
    return np.clip(PchipInterpolator(goal, at)(new), 0.0, last)
