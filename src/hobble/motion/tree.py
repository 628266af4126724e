"""Paths between joints in the tree of a rig. Argument `parents`: each joint's parent, -1 for the root."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def above(parents: Sequence[int], joint: int) -> list[int]:
    """The joint and all joints above it, the root last."""
    out = [joint]
    while parents[out[-1]] >= 0:
        out.append(parents[out[-1]])
    return out


def common(parents: Sequence[int], joints: Iterable[int]) -> int:
    """The nearest joint that is above all `joints`; it may be one of them."""
    first, *others = (above(parents, j) for j in joints)
    return next(j for j in first if all(j in other for other in others))


def path(parents: Sequence[int], start: int, end: int) -> list[int]:
    """The joints from `start` to `end`, both included: up to their common joint, then down."""
    meet = common(parents, (start, end))
    up = above(parents, start)
    down = above(parents, end)
    return up[: up.index(meet) + 1] + down[: down.index(meet)][::-1]
