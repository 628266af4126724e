"""The body that the figure wears: tubes of elliptical sections between joints, and which links colour each.

The tables here are all there is to its shape; `loft` turns them and a pose into a surface, as the page does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

# A section: at `t` of the way from one joint to another and `cm` further, `front` of it (for a leg: behind),
# with half its width and depth in cm; `turn` blends the direction of its width from the hips' (0) to the
# shoulders' (1).
Section = tuple[str, str, float, float, float, float, float, float]

TRUNK: tuple[Section, ...] = (
    ("hips", "chest", 0.00, -16.5, 0.4, 3.2, 4.2, 0.0),
    ("hips", "chest", 0.00, -15.0, 0.2, 7.0, 7.4, 0.0),
    ("hips", "chest", 0.00, -12.0, -0.2, 12.8, 10.2, 0.0),
    ("hips", "chest", 0.00, -7.5, -0.5, 16.2, 11.6, 0.0),
    ("hips", "chest", 0.00, -3.0, -0.4, 16.4, 11.4, 0.0),
    ("hips", "chest", 0.10, 0.0, 0.0, 15.4, 10.5, 0.0),
    ("hips", "chest", 0.33, 0.0, 0.4, 14.0, 9.6, 0.25),
    ("hips", "chest", 0.60, 0.0, 0.6, 13.8, 9.5, 0.5),
    ("hips", "chest", 0.85, 0.0, 0.8, 15.0, 10.3, 0.8),
    ("chest", "neck", 0.10, 0.0, 1.0, 16.4, 10.9, 1.0),
    ("chest", "neck", 0.34, 0.0, 0.8, 17.4, 11.0, 1.0),
    ("chest", "neck", 0.55, 0.0, 0.2, 17.6, 10.0, 1.0),
    ("chest", "neck", 0.70, 0.0, -0.4, 15.6, 8.6, 1.0),
    ("chest", "neck", 0.82, 0.0, -0.8, 11.2, 7.4, 1.0),
    ("chest", "neck", 0.92, 0.0, -0.8, 7.8, 6.6, 1.0),
    ("chest", "neck", 1.00, 0.0, -0.6, 6.3, 6.1, 1.0),
    ("neck", "head", 0.30, 0.0, 0.0, 5.6, 5.8, 1.0),
    ("neck", "head", 1.00, 0.0, 0.0, 5.4, 5.6, 1.0),
)
HEAD: tuple[Section, ...] = (
    ("neck", "head", 1.0, -4.2, 3.4, 1.6, 1.8, 1.0),
    ("neck", "head", 1.0, -3.6, 3.2, 3.6, 4.0, 1.0),
    ("neck", "head", 1.0, -2.0, 2.6, 5.3, 6.2, 1.0),
    ("neck", "head", 1.0, 1.0, 1.9, 6.5, 8.0, 1.0),
    ("neck", "head", 1.0, 4.5, 1.4, 7.2, 9.1, 1.0),
    ("neck", "head", 1.0, 8.5, 0.9, 7.6, 9.6, 1.0),
    ("neck", "head", 1.0, 12.0, 0.6, 7.3, 9.2, 1.0),
    ("neck", "head", 1.0, 15.0, 0.5, 6.3, 7.9, 1.0),
    ("neck", "head", 1.0, 17.0, 0.5, 4.8, 6.1, 1.0),
    ("neck", "head", 1.0, 18.4, 0.5, 2.9, 3.7, 1.0),
)
LEG: tuple[Section, ...] = (
    ("hip", "knee", 0.0, -6.5, 0.3, 5.0, 6.5, 0.0),
    ("hip", "knee", 0.0, -4.5, 0.3, 7.4, 8.9, 0.0),
    ("hip", "knee", 0.03, 0.0, 0.2, 9.0, 10.3, 0.0),
    ("hip", "knee", 0.20, 0.0, -0.2, 8.9, 9.7, 0.0),
    ("hip", "knee", 0.45, 0.0, -0.6, 7.7, 8.4, 0.0),
    ("hip", "knee", 0.72, 0.0, -0.4, 6.3, 6.8, 0.0),
    ("hip", "knee", 0.90, 0.0, -0.3, 5.6, 6.1, 0.0),
    ("knee", "heel", 0.0, 0.0, -0.3, 5.4, 5.9, 0.0),
    ("knee", "heel", 0.10, 0.0, 0.3, 5.2, 5.6, 0.0),
    ("knee", "heel", 0.26, 0.0, 1.3, 5.5, 6.0, 0.0),
    ("knee", "heel", 0.44, 0.0, 1.3, 5.1, 5.5, 0.0),
    ("knee", "heel", 0.64, 0.0, 0.8, 4.2, 4.5, 0.0),
    ("knee", "heel", 0.84, 0.0, 0.3, 3.3, 3.7, 0.0),
    ("knee", "heel", 1.0, -1.0, 0.0, 3.3, 3.8, 0.0),
    ("knee", "heel", 1.0, 2.2, 0.0, 3.0, 3.3, 0.0),
)
SHOULDER: tuple[Section, ...] = (
    ("chest", "shoulder", 0.30, 0.0, 0.0, 4.0, 4.4, 0.0),
    ("chest", "shoulder", 0.60, 0.0, 0.0, 5.0, 4.8, 0.0),
    ("chest", "shoulder", 0.85, 0.0, 0.0, 5.4, 4.9, 0.0),
    ("chest", "shoulder", 1.00, 0.0, 0.0, 5.2, 4.8, 0.0),
)
ARM: tuple[Section, ...] = (
    ("shoulder", "elbow", 0.00, -6.2, 0.0, 2.2, 2.2, 0.0),
    ("shoulder", "elbow", 0.00, -5.2, 0.0, 4.2, 4.0, 0.0),
    ("shoulder", "elbow", 0.00, -3.2, 0.0, 5.7, 5.3, 0.0),
    ("shoulder", "elbow", 0.00, 0.0, 0.0, 6.4, 6.0, 0.0),
    ("shoulder", "elbow", 0.14, 0.0, 0.0, 6.1, 5.7, 0.0),
    ("shoulder", "elbow", 0.32, 0.0, 0.0, 5.3, 5.0, 0.0),
    ("shoulder", "elbow", 0.60, 0.0, 0.0, 4.7, 4.5, 0.0),
    ("shoulder", "elbow", 0.86, 0.0, 0.0, 4.1, 4.0, 0.0),
    ("elbow", "wrist", 0.00, 0.0, 0.0, 4.0, 3.9, 0.0),
    ("elbow", "wrist", 0.20, 0.0, 0.0, 4.3, 4.0, 0.0),
    ("elbow", "wrist", 0.42, 0.0, 0.0, 4.0, 3.7, 0.0),
    ("elbow", "wrist", 0.72, 0.0, 0.0, 3.2, 2.9, 0.0),
    ("elbow", "wrist", 1.00, -1.0, 0.0, 2.8, 2.3, 0.0),
    ("elbow", "wrist", 1.00, 2.0, 0.0, 3.4, 2.2, 0.0),
    ("elbow", "wrist", 1.00, 5.5, 0.0, 4.3, 2.1, 0.0),
    ("elbow", "wrist", 1.00, 9.5, 0.0, 4.3, 1.9, 0.0),
    ("elbow", "wrist", 1.00, 13.5, 0.0, 3.6, 1.6, 0.0),
    ("elbow", "wrist", 1.00, 16.5, 0.0, 2.6, 1.3, 0.0),
    ("elbow", "wrist", 1.00, 18.0, 0.0, 1.5, 0.9, 0.0),
)
# A foot lies along its sole: `t` and `cm` along it from the ankle, half its width, its height above the sole.
FOOT: tuple[tuple[float, float, float, float], ...] = (
    (0.0, -6.4, 1.6, 3.4),
    (0.0, -6.0, 2.6, 5.4),
    (0.0, -4.4, 3.4, 7.6),
    (0.0, -1.0, 3.7, 9.4),
    (0.0, 2.5, 3.8, 9.2),
    (0.4, 0.5, 4.0, 7.6),
    (0.7, 0.5, 4.4, 6.0),
    (1.0, 0.0, 4.7, 4.8),
    (1.0, 3.5, 4.6, 3.8),
    (1.0, 6.5, 3.8, 3.0),
    (1.0, 8.2, 2.6, 2.4),
    (1.0, 9.0, 1.3, 1.8),
)
SOLE = (7.2, 2.7)  # of ankle and toe above the sole, where nothing better is known
THIN = (2.4, 1.8)  # of a bone of a body whose roles are not all known
SIDES = ("left", "right")
PARTS = ("hip", "knee", "heel", "toe", "shoulder", "elbow", "wrist")
MIDDLE = ("hips", "chest", "neck", "head")


def body(
    joints: Sequence[str],
    parents: Sequence[int],
    roles: Mapping[str, str],
    links: Sequence[str] = (),
    others: Sequence[int] = (),
) -> dict[str, Any]:
    """What `loft` and the page draw of a skeleton.

    `keep`: the joints that are drawn, the root and `others` among them; every other index is one into these,
    so that of a figure of 191 joints some twenty need to be known. `tubes`: `kind` (lateral, front, foot or
    bone) and `sections` (a, b, t, cm, front, half width, half depth, turn, part; of a foot t, cm, half width,
    height, part, with its `ends`); `parts`: the indices of the links that colour a part; `axes`: the joints
    that show where left, up and front are; `sole`: heights of ankle and toe above the sole.

    Where the roles of a body are not all known, every bone gets a thin tube instead.
    """
    at = {role: joints.index(name) for role, name in roles.items() if name in joints}
    wanted = {*MIDDLE, *(f"{side}_{part}" for side in SIDES for part in PARTS)}
    makers = _Dress(at, parents, _link_pairs(joints, links))
    tubes = makers.figure() if wanted <= set(at) else makers.bones()
    drawn = {at[role] for role in wanted if role in at} if wanted <= set(at) else set(range(len(joints)))
    keep = sorted({0, *others, *drawn}) if joints else []
    whole = wanted <= set(at)
    axes = {}
    if whole:
        pairs = {"hips": ("left_hip", "right_hip"), "shoulders": ("left_shoulder", "right_shoulder")}
        axes = {
            name: [keep.index(at[a]), keep.index(at[b])]
            for name, (a, b) in {**pairs, "up": ("neck", "hips")}.items()
        }
    for tube in tubes:
        if "ends" in tube:
            tube["ends"] = [keep.index(j) for j in tube["ends"]]
        else:
            tube["sections"] = [[keep.index(a), keep.index(b), *rest] for a, b, *rest in tube["sections"]]
    return {"keep": keep, "tubes": tubes, "parts": makers.parts, "axes": axes, "sole": list(SOLE)}


class _Dress:
    """The tubes of one skeleton, with indices into all its joints."""

    def __init__(
        self,
        at: Mapping[str, int],
        parents: Sequence[int],
        pairs: Sequence[tuple[int, int] | None],
    ) -> None:
        self._at, self._parents, self._pairs = at, parents, pairs
        self.parts: list[list[int]] = []

    def figure(self) -> list[dict[str, Any]]:
        """A human body."""
        tubes = [self._tube("lateral", TRUNK, ""), self._tube("lateral", HEAD, "")]
        for side in SIDES:
            heel, toe = self._at[f"{side}_heel"], self._at[f"{side}_toe"]
            foot, toes = self._part(self._between(heel, toe)), self._part(self._below(toe))
            tubes.append(self._tube("lateral", LEG, side))
            tubes += [self._tube("front", SHOULDER, side), self._tube("front", ARM, side)]
            sections = [
                [t, cm, width, height, toes if t == 1.0 and cm > 0 else foot] for t, cm, width, height in FOOT
            ]
            tubes.append({"kind": "foot", "ends": [heel, toe], "sections": sections})
        return tubes

    def bones(self) -> list[dict[str, Any]]:
        """A thin tube for every bone."""
        tubes = []
        for j, p in enumerate(self._parents):
            if p >= 0:
                part = self._part(self._between(p, j))
                ends = zip((0.0, 1.0), THIN, strict=True)
                rows = [[p, j, t, 0.0, 0.0, r, r, 0.0, part] for t, r in ends]
                tubes.append({"kind": "bone", "sections": rows})
        return tubes

    def _tube(self, kind: str, sections: Sequence[Section], side: str) -> dict[str, Any]:
        rows = []
        for a, b, t, cm, front, width, depth, turn in sections:
            first, last = (self._at[role if role in MIDDLE else f"{side}_{role}"] for role in (a, b))
            links = self._between(first, last)
            if b == "wrist" and cm > 0:
                links = self._below(last)
            if (a, b) == ("hips", "chest") and t == 0.0 and cm < 0:
                links = []  # the pelvis, whose links colour the tops of the legs
            if (a, b) == ("hip", "knee") and t < 0.1:
                links = self._between(self._at["hips"], first)
            rows.append([first, last, t, cm, front, width, depth, turn, self._part(links)])
        return {"kind": kind, "sections": rows}

    def _part(self, links: list[int]) -> int:
        if links not in self.parts:
            self.parts.append(links)
        return self.parts.index(links)

    def _between(self, a: int, b: int) -> list[int]:
        """Links that lie on the way between two joints."""
        up, down = self._chain(a), self._chain(b)
        common = next(j for j in up if j in down)
        way = {*up[: up.index(common) + 1], *down[: down.index(common) + 1]}
        return [i for i, pair in enumerate(self._pairs) if pair and pair[0] in way and pair[1] in way]

    def _below(self, joint: int) -> list[int]:
        """Links at or below a joint."""
        return [i for i, pair in enumerate(self._pairs) if pair and joint in self._chain(pair[0])]

    def _chain(self, joint: int) -> list[int]:
        chain = [joint]
        while self._parents[chain[-1]] >= 0:
            chain.append(self._parents[chain[-1]])
        return chain


def _link_pairs(joints: Sequence[str], links: Sequence[str]) -> list[tuple[int, int] | None]:
    """Ends of each link as indices; joint names may hold hyphens themselves, so every place is tried."""
    pairs: list[tuple[int, int] | None] = []
    for link in links:
        parts = link.split("-")
        splits = [("-".join(parts[:i]), "-".join(parts[i:])) for i in range(1, len(parts))]
        known = [(joints.index(a), joints.index(b)) for a, b in splits if a in joints and b in joints]
        pairs.append(known[0] if known else None)
    return pairs
