"""The body that the page's figure wears: capsules between joints, and which links colour each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

# Capsules between the joints that play two roles, with radii in cm at both ends.
LIMBS = (
    ("left_hip", "right_hip", 9.0, 9.0),
    ("hips", "chest", 10.5, 12.0),
    ("chest", "neck", 12.0, 8.5),
    ("chest", "left_shoulder", 7.6, 5.3),
    ("chest", "right_shoulder", 7.6, 5.3),
    ("neck", "head", 4.6, 4.6),
    ("left_shoulder", "left_elbow", 4.8, 3.8),
    ("left_elbow", "left_wrist", 3.8, 2.9),
    ("right_shoulder", "right_elbow", 4.8, 3.8),
    ("right_elbow", "right_wrist", 3.8, 2.9),
    ("left_hip", "left_knee", 8.4, 5.6),
    ("left_knee", "left_heel", 5.4, 3.7),
    ("left_heel", "left_toe", 3.7, 2.9),
    ("right_hip", "right_knee", 8.4, 5.6),
    ("right_knee", "right_heel", 5.4, 3.7),
    ("right_heel", "right_toe", 3.7, 2.9),
)
# Capsules that go on past a joint: (from, joint, cm beyond, radius, kept above the ground).
ENDS = (
    ("left_heel", "left_toe", 6.0, 2.6, True),
    ("right_heel", "right_toe", 6.0, 2.6, True),
    ("left_elbow", "left_wrist", 9.0, 2.8, False),
    ("right_elbow", "right_wrist", 9.0, 2.8, False),
)
SKULL = ("neck", "head", 5.0, 9.6)


def capsules(
    joints: Sequence[str], parents: Sequence[int], roles: Mapping[str, str], links: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Capsules as the page draws them.

    Each has `a` and `b` (indices of joints), `ra` and `rb` (cm), `links` (indices of the links between a and
    b). A capsule that goes on past b has `from` and `beyond`; `centre` makes it a ball. Where the roles of a
    body are not all known, every bone gets a thin capsule instead.
    """
    at = {role: joints.index(name) for role, name in roles.items() if name in joints}
    pairs = _link_pairs(joints, links)
    if not all(a in at and b in at for a, b, *_ in LIMBS):
        return [
            {"a": p, "b": j, "ra": 2.5, "rb": 2.0, "links": _between(parents, p, j, pairs)}
            for j, p in enumerate(parents)
            if p >= 0
        ]
    out = [
        {"a": at[a], "b": at[b], "ra": ra, "rb": rb, "links": _between(parents, at[a], at[b], pairs)}
        for a, b, ra, rb in LIMBS
    ]
    for start, end, beyond, radius, flat in ENDS:
        tip = {"a": at[end], "b": at[end], "from": at[start], "beyond": beyond, "ra": radius, "rb": radius}
        out.append({**tip, "flat": flat, "links": _below(parents, at[end], pairs)})
    start, end, beyond, radius = SKULL
    skull = {"a": at[end], "b": at[end], "from": at[start], "beyond": beyond, "ra": radius, "rb": radius}
    out.append({**skull, "centre": True, "links": _between(parents, at[start], at[end], pairs)})
    return out


def _link_pairs(joints: Sequence[str], links: Sequence[str]) -> list[tuple[int, int] | None]:
    """Ends of each link as indices; joint names may hold hyphens themselves, so every place is tried."""
    pairs: list[tuple[int, int] | None] = []
    for link in links:
        parts = link.split("-")
        splits = [("-".join(parts[:i]), "-".join(parts[i:])) for i in range(1, len(parts))]
        known = [(joints.index(a), joints.index(b)) for a, b in splits if a in joints and b in joints]
        pairs.append(known[0] if known else None)
    return pairs


def _chain(parents: Sequence[int], joint: int) -> list[int]:
    chain = [joint]
    while parents[chain[-1]] >= 0:
        chain.append(parents[chain[-1]])
    return chain


def _between(parents: Sequence[int], a: int, b: int, pairs: Sequence[tuple[int, int] | None]) -> list[int]:
    """Links that lie on the way between two joints."""
    up, down = _chain(parents, a), _chain(parents, b)
    common = next(j for j in up if j in down)
    way = {*up[: up.index(common) + 1], *down[: down.index(common) + 1]}
    return [i for i, pair in enumerate(pairs) if pair and pair[0] in way and pair[1] in way]


def _below(parents: Sequence[int], joint: int, pairs: Sequence[tuple[int, int] | None]) -> list[int]:
    """Links at or below a joint."""
    return [i for i, pair in enumerate(pairs) if pair and joint in _chain(parents, pair[0])]
