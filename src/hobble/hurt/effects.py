"""How strongly each frame of a clip is changed, by severities of several links at once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian
from hobble.hurt.amounts import amounts
from hobble.hurt.parts import LEFT, RIGHT, part_of_link

HIGHEST = 10.0
POWER = 0.75  # of the strength over severity: 3 is .41, 5 is .59, 7 is .77
LEAST = 0.02  # a ratio
SETTLING = 0.3  # seconds, of the Gaussian over which a change of severity sets in
UNFELT = 0.05  # a severity
TOGETHER = 3.0  # how two injuries add: 1 would be their sum, infinity the worse one
WHOLE = ("speed", "stride", "back", "head", "forward", "nod")  # of the body, not of a side
SIDED = (
    *(
        "land",
        "off",
        "step",
        "push",
        "lift",
        "strike",
        "out",
        "width",
        "toe_out",
        "crouch",
        "arm",
        "side",
        "list",
    ),
    *("upper", "fore", "carry"),
)
OTHER = "_sound"
FLIPPED = np.array([1.0, -1.0, -1.0, -1.0, -1.0])  # of CURVES: all but the trunk forward change sign
LATER = np.array([1.0, -1.0, -1.0, 1.0, 1.0])  # of a curve's factors: half a cycle on
GUARD = {"shoulder": "upper", "upper arm": "upper", "forearm": "fore", "hand": "carry"}


@dataclass(frozen=True)
class Effects:
    """What changes in each of F frames of a clip, in the terms of `hobble.hurt.amounts`.

    whole: (F,) by name. sided: (F, 2), left and right, by name. curves: (F, 5, 5). strength: (F,) of the
    worst link, 0 to 1. felt: (F, L) severities that the frames show: those given, but a change sets in over
    about a second.
    """

    whole: dict[str, Array] = field(repr=False)
    sided: dict[str, Array] = field(repr=False)
    curves: Array = field(repr=False)
    strength: Array = field(repr=False)
    felt: Array = field(repr=False)

    def ratio(self, name: str) -> Array:
        """(F,) or (F, 2) factor that a ratio is."""
        return np.maximum(1.0 + (self.whole[name] if name in self.whole else self.sided[name]), LEAST)


def effects(skeleton: Skeleton, severity: Array, fps: float) -> Effects:
    """The effects of severities (F, L), 0 to 10, of the skeleton's links.

    Where links are hurt together the effect of each kind is at least that of the worst, and less than the
    sum.
    """
    frames = len(severity)
    strength = gaussian((np.clip(severity, 0, HIGHEST) / HIGHEST) ** POWER, SETTLING * fps)
    whole = {name: _Sum(np.zeros(frames)) for name in WHOLE}
    sided = {name: _Sum(np.zeros((frames, 2))) for name in SIDED}
    curves = _Sum(np.zeros((frames, 5, 5)))
    parts: dict[tuple[str, int | None], Array] = {}
    for link, column in zip(skeleton.links, strength.T, strict=True):
        where = part_of_link(skeleton, link)
        # Links of one part, fingers say, hurt it once, as much as the worst.
        key = (where.name, where.side)
        parts[key] = np.maximum(parts.get(key, 0.0), column)
    for (part, side), own in parts.items():
        if not own.any():
            continue
        for name, amount in amounts(part).items():
            if name == "curves":
                curves.add(own[:, None, None] * _of_side(np.asarray(amount), side))
            elif name in WHOLE:
                whole[name].add(own * amount)
            else:
                _add_sided(sided, name, own * amount, side)
        if part in GUARD and side is not None:
            _add_sided(sided, GUARD[part], own, side)
    return Effects(
        {name: total.value() for name, total in whole.items()},
        {name: total.value() for name, total in sided.items()},
        curves.value(),
        strength.max(axis=1, initial=0.0),
        _felt(strength),
    )


def _felt(strength: Array) -> Array:
    """The severities (F, L) that go with strengths, none where next to nothing shows."""
    severity = np.round(HIGHEST * np.clip(strength, 0.0, 1.0) ** (1 / POWER), 3)
    return np.where(severity < UNFELT, 0.0, severity)


def _add_sided(sided: dict[str, _Sum], name: str, values: Array, side: int | None) -> None:
    if name == "arms":
        sided["arm"].add(np.stack([values, values], axis=1))
        return
    hurt = RIGHT if side is None else side
    at = 1 - hurt if name.endswith(OTHER) else hurt
    both = np.zeros((len(values), 2))
    both[:, at] = values
    sided[name.removesuffix(OTHER)].add(both)


def _of_side(curves: Array, side: int | None) -> Array:
    return curves * FLIPPED[:, None] * LATER if side == LEFT else curves


class _Sum:
    """A sum in which the greatest term counts most, separately of what is added and what is taken away."""

    def __init__(self, zero: Array) -> None:
        self.more, self.less = zero.copy(), zero.copy()

    def add(self, term: Array) -> None:
        self.more += np.maximum(term, 0.0) ** TOGETHER
        self.less += np.maximum(-term, 0.0) ** TOGETHER

    def value(self) -> Array:
        return self.more ** (1 / TOGETHER) - self.less ** (1 / TOGETHER)
