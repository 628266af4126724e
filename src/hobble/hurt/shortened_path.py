"""Shortens the path of the healthy clip (the source) by as much as its steps get shorter."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.curve_value import value_at
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.hurt.effects import Effects
from hobble.hurt.healthy_clip import HealthyClip

SLOPE_SECONDS = 0.3  # sigma of the Gaussian that smooths the heights of the ground under the feet


@dataclass(frozen=True)
class ShortenedPath:
    """The path of the body before and after it is shortened, at each of F source frames, cm.

    old, new: (F, 2) horizontal path. old_ground, new_ground: (F,) height of the ground. Flat ground stays at
    0. On other ground, heights shrink like the path, so that slopes keep their angle.
    """

    old: Array = field(repr=False)
    new: Array = field(repr=False)
    old_ground: Array = field(repr=False)
    new_ground: Array = field(repr=False)

    def moved(self, point: Array, when: float) -> Array:
        """Where a point (3,) of source frame `when` is after the path has changed, (3,)."""
        first = min(int(when), len(self.old) - 1)
        near = slice(first, first + 2)  # reading all frames for each footprint would take long
        moved = self.new[near] - self.old[near]
        curves = moved[:, 0], self.new_ground[near] - self.old_ground[near], moved[:, 1]
        return point + np.array([value_at(curve, when - first) for curve in curves])


def shorten(source: HealthyClip, effects: Effects, slower: Array, ground: Array | None) -> ShortenedPath:
    """The path of a body that has the speed of `effects`.

    slower: (F,) factor of the stride time. ground: (F,) height of the ground below the body; None if flat.
    """
    share = effects.ratio("speed") * slower
    flat = np.zeros(len(source))
    return ShortenedPath(
        source.path,
        _shrunk(source.path, share[:, None]),
        flat if ground is None else ground,
        flat if ground is None else _shrunk(ground, share),
    )


def ground_below(source: HealthyClip, heights: list[list[tuple[float, float]]]) -> Array:
    """(F,) height of the ground below the body, cm, from the heights of the standing feet.

    heights: (middle frame, height) of each foot's stances. Heights are used relative to the foot's median, so
    that legs of different length make no waves.
    """
    points = sorted(
        (when, y - float(np.median([h for _, h in of_foot]))) for of_foot in heights for when, y in of_foot
    )
    line = np.interp(np.arange(len(source)), [p[0] for p in points], [p[1] for p in points])
    return gaussian(line, SLOPE_SECONDS * source.clip.fps)


def _shrunk(values: Array, share: Array) -> Array:
    """The curve, with the same first value, in which all changes are multiplied by `share`."""
    steps = np.diff(values, axis=0) * (share[1:] + share[:-1]) / 2
    return values[:1] + np.concatenate([np.zeros_like(values[:1]), np.cumsum(steps, axis=0)])
