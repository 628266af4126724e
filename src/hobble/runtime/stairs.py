"""Stairs with a badly hurt leg: the good leg goes first up, the bad one down, as people do it.

People slow down or hurry before a step, so that it comes as the right leg swings. So does the character:
before an edge of the ground its target speed and its pace change. On stairs it goes about one tread a cycle,
so that both feet stand on each. Nothing else is needed: the network steps over the edge with the leg that
swings.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import smoothstep
from hobble.hurt.effects import JOIN_AT, JOIN_FROM, LEFT, LEG_PARTS, RIGHT, part_of_link

# Edges are looked for at POINTS points so many cm apart, EARLIER of them behind the body: the ground rises or
# falls by EDGE_CM or more from one point to the next. Edges at most NEAR_CM away tell how deep treads are.
POINTS, EARLIER, APART_CM, EDGE_CM, NEAR_CM = 44, 12, 5.0, 4.0, 80.0
OVER_CM = 20.0  # as the first foot lands beyond an edge, the edge is this far ahead of the body
FIRST_DOWN_CM = 14.0  # the same where stairs down begin: with 17 or 20 the leg landed before that edge
CYCLE_FRAMES = 80.0  # length of a hurt body's gait cycle on stairs, about
SLOWEST = 0.3  # cm a frame: slower bodies count as this fast
TREADS = 1.2  # a cycle, at most
# If the body should make f times as many cycles up to the edge (f is from 1 / MOST to MOST), the change of
# phase has the factor f ** PACE, and the target speed f ** -SPEED, at most FASTEST. That is more than f asks
# for, since a body follows its target speed slowly.
MOST, PACE, SPEED, FASTEST = 3.0, 0.5, 4.0, 3.0
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


def time_steps(
    ground: Callable[[Array, Array], Array],
    place: Array,
    velocity: Array,
    speed: Array,
    phase: Array,
    join: Array,
) -> tuple[Array, Array]:
    """Factors (C,) of the pace and (C,) of the target velocity: with them the leg that should lead does so.

    ground: function from x, z (N,) to heights (N,). place: (C, 2) of the bodies. velocity: (C, 2) targets.
    speed: (C,) present speeds, cm a frame. phase: (C,). join: (C,) from `joins`.
    """
    target = np.maximum(np.hypot(velocity[:, 0], velocity[:, 1]), 1e-6)
    far = APART_CM * np.arange(-EARLIER, POINTS - EARLIER)
    points = (place[:, None] + far[:, None] * (velocity / target[:, None])[:, None]).reshape(-1, 2)
    rise = np.diff(ground(points[:, 0], points[:, 1]).reshape(-1, POINTS), axis=1)
    far, edges, each = far[1:], np.abs(rise) >= EDGE_CM, np.arange(len(place))
    most = TREADS * _tread(far, edges & (far <= NEAR_CM)) / CYCLE_FRAMES
    begins = (rise < 0) & ~(edges & (far <= FIRST_DOWN_CM)).any(axis=1, keepdims=True)
    over = np.where(begins, FIRST_DOWN_CM, OVER_CM)
    ahead = edges & (far > over)
    first = ahead.argmax(axis=1)
    # The right leg leads down if it is the bad one, and up if the left leg is.
    right_leads = (rise[each, first] > 0) == (join < 0)
    lands = np.where(right_leads, LANDS[RIGHT], LANDS[LEFT])
    cycles = np.maximum((far[first] - over[each, first]) / (np.maximum(speed, SLOWEST) * CYCLE_FRAMES), 0.05)
    # The foot should land after one of these numbers of cycles: the one that needs the smallest change.
    factors = np.maximum((lands - phase)[:, None] % 1.0 + np.arange(3.0), 1e-3) / cycles[:, None]
    best = factors[each, np.abs(np.log(factors)).argmin(axis=1)]
    more = np.where(ahead.any(axis=1), np.clip(best, 1 / MOST, MOST) ** np.abs(join), 1.0)
    slower = np.minimum(most / target, 1.0) ** np.abs(join)
    return more**PACE, slower * np.minimum(more**-SPEED, FASTEST)


def _tread(far: Array, edges: np.ndarray) -> Array:
    """(C,) mean distance between edges, cm; infinite where there are fewer than two.

    far: (N,) places. edges: (C, N) whether an edge is at each.
    """
    between = np.maximum(edges.sum(axis=1) - 1, 0)
    deep = far[::-1][edges[:, ::-1].argmax(axis=1)] - far[edges.argmax(axis=1)]
    return np.where(between > 0, deep / np.maximum(between, 1), np.inf)
