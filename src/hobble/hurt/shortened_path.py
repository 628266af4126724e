"""Shortens the path of the healthy clip (the source), because a hurt person takes shorter steps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.curve_value import interpolate_curve
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.hurt.effects import Effects
from hobble.hurt.healthy_clip import HealthyClip

SLOPE_SECONDS = 0.3  # sigma of the Gaussian that smooths the height of the ground over time


@dataclass(frozen=True)
class ShortenedPath:
    """The path of the body before (old) and after (new) it is shortened, in each of F source frames, cm.

    old, new: (F, 2) horizontal path, x and z. old_ground, new_ground: (F,) height of the ground below the
    body. If the ground is flat, its height is 0. On other ground, climbs and descents shrink like the path,
    so that slopes keep their angle.
    """

    old: Array = field(repr=False)
    new: Array = field(repr=False)
    old_ground: Array = field(repr=False)
    new_ground: Array = field(repr=False)

    def move_point(self, point: Array, when: float) -> Array:
        """Move a point (3,) by as much as the body's path has moved in source frame `when`. Returns (3,)."""
        first = min(int(when), len(self.old) - 1)
        near = slice(first, first + 2)  # two frames; to read all frames for each footprint would take long
        shift = self.new[near] - self.old[near]
        curves = shift[:, 0], self.new_ground[near] - self.old_ground[near], shift[:, 1]
        return point + np.array([interpolate_curve(curve, when - first) for curve in curves])


def shorten(
    source: HealthyClip, effects: Effects, stride_ratio: Array, ground: Array | None
) -> ShortenedPath:
    """Shorten the path of the body so that its speed changes as `effects` says.

    stride_ratio: (F,) new duration of a stride / old duration. ground: (F,) height of the ground below the
    body; None if flat.
    """
    share = effects.ratio("speed") * stride_ratio  # length of a stride = speed * duration
    flat = np.zeros(len(source))
    return ShortenedPath(
        source.path,
        _shrink(source.path, share[:, None]),
        flat if ground is None else ground,
        flat if ground is None else _shrink(ground, share),
    )


def ground_below(source: HealthyClip, heights: list[list[tuple[float, float]]]) -> Array:
    """(F,) height of the ground below the body, cm, from the heights of the standing feet.

    heights: for each foot a list of (middle frame of a stance, height of the ankle). The median height of
    each foot counts as 0. Otherwise, if one ankle is higher than the other in stance, flat ground would seem
    to rise and fall with each step.
    """
    points = sorted(
        (when, y - float(np.median([h for _, h in of_foot]))) for of_foot in heights for when, y in of_foot
    )
    height = np.interp(np.arange(len(source)), [p[0] for p in points], [p[1] for p in points])
    return gaussian(height, SLOPE_SECONDS * source.clip.fps)


def _shrink(values: Array, share: Array) -> Array:
    """Multiply the changes of a curve from frame to frame by `share`. The first value stays the same."""
    steps = np.diff(values, axis=0) * (share[1:] + share[:-1]) / 2
    return values[:1] + np.concatenate([np.zeros_like(values[:1]), np.cumsum(steps, axis=0)])
