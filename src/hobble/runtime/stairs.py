"""Stairs with a badly hurt leg: the good leg goes first up, the bad one down, as people do it.

People slow down or hurry before a step, so that it comes as the right leg swings. So does the character:
before an edge of the ground its target speed and its pace change. Nothing else is needed: the network steps
over the edge with the leg that swings.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import smoothstep
from hobble.hurt.effects import JOIN_AT, JOIN_FROM, LEFT, LEG_PARTS, RIGHT, part_of_link

# An edge is looked for at this many points ahead, so many cm apart: the ground rises or falls by EDGE_CM or
# more from one point to the next.
POINTS, APART_CM, EDGE_CM = 32, 5.0, 4.0
OVER_CM = 20.0  # as the first foot lands beyond an edge, the edge is this far ahead of the body
CYCLE_FRAMES = 72.0  # length of a hurt body's gait cycle, about
SLOWEST = 0.3  # cm a frame: slower bodies count as this fast
# If the body should make f times as many cycles up to the edge, f is at most MOST or its inverse. Then the
# change of phase has the factor f ** PACE, and the target speed f ** (PACE - 1).
MOST, PACE = 2.5, 0.25
LANDS = {LEFT: 0.5, RIGHT: 0.0}  # the phase in which a foot lands


def leg_of_columns(skeleton: Skeleton, labels: Sequence[str]) -> np.ndarray:
    """(L,) which leg hurts by each column of the channels: 1 the left one, 2 the right one, 0 none.

    labels: of the columns. Those that are names of links say how much the link hurts.
    """
    links = dict(zip(skeleton.link_names, skeleton.links, strict=True))
    parts = [part_of_link(skeleton, links[label]) if label in links else None for label in labels]
    sides = [part.side if part and part.name in LEG_PARTS else None for part in parts]
    return np.array([0 if side is None else 1 + side for side in sides], np.uint8)


def joins(severity: Array, leg: np.ndarray) -> Array:
    """(C,) how much each body goes step by step, from 0 to 1 for the right leg and to -1 for the left one.

    severity: (C, L) values of the columns. leg: from `leg_of_columns`.
    """
    left, right = (
        smoothstep((severity[:, leg == k].max(axis=1, initial=0.0) - JOIN_FROM) / (JOIN_AT - JOIN_FROM))
        for k in (1, 2)
    )
    return np.asarray(right - left)


def more_cycles(
    ground: Callable[[Array, Array], Array],
    place: Array,
    velocity: Array,
    speed: Array,
    phase: Array,
    join: Array,
) -> Array:
    """(C,) the factor by which bodies should make more gait cycles up to the next edge; 1 without an edge.

    ground: function from x, z (N,) to heights (N,). place: (C, 2) of the bodies. velocity: (C, 2) targets.
    speed: (C,) present speeds, cm a frame. phase: (C,). join: (C,) from `joins`.
    """
    ahead = velocity / np.maximum(np.hypot(velocity[:, 0], velocity[:, 1]), 1e-6)[:, None]
    far = APART_CM * np.arange(POINTS)
    points = (place[:, None] + far[:, None] * ahead[:, None]).reshape(-1, 2)
    rise = np.diff(ground(points[:, 0], points[:, 1]).reshape(-1, POINTS), axis=1)
    edges = (np.abs(rise) >= EDGE_CM) & (far[1:] > OVER_CM)
    each, first = np.arange(len(place)), edges.argmax(axis=1)
    # The right leg leads down if it is the bad one, and up if the left leg is.
    right_leads = (rise[each, first] > 0) == (join < 0)
    lands = np.where(right_leads, LANDS[RIGHT], LANDS[LEFT])
    cycles = np.maximum((far[1 + first] - OVER_CM) / (np.maximum(speed, SLOWEST) * CYCLE_FRAMES), 0.05)
    # The foot should land after one of these numbers of cycles: the one that needs the smallest change.
    factors = np.maximum((lands - phase)[:, None] % 1.0 + np.arange(3.0), 1e-3) / cycles[:, None]
    best = factors[each, np.abs(np.log(factors)).argmin(axis=1)]
    return np.where(edges.any(axis=1), np.clip(best, 1 / MOST, MOST) ** np.abs(join), 1.0)
