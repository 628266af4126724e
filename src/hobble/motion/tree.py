"""Paths between joints in the tree of a rig. `parents`: the index of each joint's parent, or -1."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def path_to_root(parents: Sequence[int], joint: int) -> list[int]:
    """The joint and all its ancestors, the root last."""
    chain = [joint]
    while parents[chain[-1]] >= 0:
        chain.append(parents[chain[-1]])
    return chain


def lowest_common_ancestor(parents: Sequence[int], joints: Iterable[int]) -> int:
    """The lowest common ancestor of `joints`. A joint counts as its own ancestor here."""
    first, *others = (path_to_root(parents, j) for j in joints)
    return next(j for j in first if all(j in other for other in others))


def path_between(parents: Sequence[int], start: int, end: int) -> list[int]:
    """The joints from `start` to `end`, both included: up to their lowest common ancestor, then down."""
    meet = lowest_common_ancestor(parents, (start, end))
    up = path_to_root(parents, start)
    down = path_to_root(parents, end)
    return up[: up.index(meet) + 1] + down[: down.index(meet)][::-1]
