"""How fast a body goes that is told something: learnt from the rows of a database, saved with the network.

A hurt body cannot do what the healthy one can. What it does stands in the rows: the speed of a cycle beside
that of the same cycle of the healthy clip of which it is a version, or beside the usual speed of the gait
where it has no healthy counterpart, as captured injuries have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.core.quat import Array

UNLIMITED = 1e4  # cm a frame: of a gait in which no healthy clip goes ahead
LEVELS = 5  # values for which a speed is kept, from 0 to the highest; between them it is interpolated
TOP = 95  # percentile of the speeds of healthy cycles in a gait: that of a body that is told nothing
USUAL = 65  # percentile of those, of which a hurt body keeps its share; clips start and stop, so no median
LAME = (
    0.85  # who keeps this share of the usual speed, or less, cannot hurry; who keeps all is as fast as ever
)
AHEAD = 0.9  # share of its speed that a cycle makes forward, of those that say how fast a gait is
STEADY = 0.35  # of the highest value: a cycle in which a value changes by more says nothing of either
FAINT = 0.05  # of the highest value: less, as a mean over a cycle, is nothing told
RESOLUTE = 0.1  # cm a frame; a slower cycle of a healthy body is no measure of anything
FIRM = 2.0  # cycles that the expectation counts as much as, where cycles are few
SLOWEST = 0.1  # share of the healthy speed that everybody keeps


@dataclass(frozen=True)
class Limits:
    """levels: (K,) values from 0 to a channel's highest; speeds: (G, L, K) cm a frame at those, for each gait
    and label: never rising with the value."""

    levels: Array = field(repr=False)
    speeds: Array = field(repr=False)

    def allowed(self, values: Array) -> Array:
        """(C, G) cm a frame at most in each gait, for values (C, L): the least over what is above 0.

        inf where nothing is told. Several values are as slow as the worst of them.
        """
        at = np.clip(np.searchsorted(self.levels, values, side="right") - 1, 0, len(self.levels) - 2)
        low, high = self.levels[at], self.levels[at + 1]
        share = (values - low) / (high - low)
        label = np.arange(values.shape[1])
        below, above = self.speeds[:, label, at], self.speeds[:, label, at + 1]
        speeds = np.where(values > 0, below + share * (above - below), np.inf)
        return np.min(speeds, axis=2, initial=np.inf).T

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a file."""
        return {"levels": self.levels.tolist(), "speeds": np.round(self.speeds, 4).tolist()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], gaits: int, labels: int, highest: float) -> Limits:
        """The inverse of `to_dict`. Raises ValueError for what is no table of so many gaits and labels."""
        try:
            levels, speeds = (np.array(data[key], float) for key in ("levels", "speeds"))
        except (KeyError, TypeError, ValueError, OverflowError):
            raise ValueError("no table of numbers: it has `levels` and `speeds`") from None
        if levels.ndim != 1 or len(levels) < 2 or speeds.shape != (gaits, labels, len(levels)):
            raise ValueError(
                f"levels {levels.shape}, speeds {speeds.shape} for {gaits} gaits, {labels} labels"
            )
        if levels[0] != 0 or levels[-1] != highest or not (np.diff(levels) > 0).all():
            raise ValueError(f"levels do not rise from 0 to {highest:g}")
        if not ((speeds > 0) & (speeds <= UNLIMITED)).all():
            raise ValueError(f"speeds are not all above 0 and at most {UNLIMITED:g}")
        if (np.diff(speeds, axis=2) > 0).any():
            raise ValueError("a higher value goes faster than a lower one")
        return cls(levels, speeds)


@dataclass(frozen=True)
class _Cycles:
    """N cycles of one clip. gait: (N,); speed, ahead: (N,) cm a frame; values: (N, L); number: (N,)."""

    gait: np.ndarray
    speed: Array
    ahead: Array
    values: Array
    number: np.ndarray


class Pace:
    """Gathers the cycles of clips, one clip at a time, and learns the limits of a channel from them.

    highest: of the channel's values. across: (L,) for each label its counterpart on the body's other side:
    both sides are taken to be alike.
    """

    def __init__(self, highest: float, across: np.ndarray, gaits: int) -> None:
        self.highest, self.across, self.gaits = highest, across, gaits
        self._clips: dict[str, tuple[str | None, _Cycles]] = {}

    def add(
        self,
        clip: str,
        *,
        gait: Array,
        velocity: Array,
        values: Array,
        cycle: np.ndarray,
        source: str | None = None,
    ) -> None:
        """A clip's rows. gait: (R, G) shares; velocity: (R, 2) of the root, seen from itself, cm a frame;
        values: (R, L); cycle: (R,) their numbers; source: the healthy clip that it is a version of."""
        numbers, of_row, count = np.unique(cycle, return_inverse=True, return_counts=True)

        def mean(rows: Array) -> Array:
            return np.asarray(np.bincount(of_row, rows, len(numbers)) / np.maximum(count, 1))

        order = np.argsort(of_row, kind="stable")
        starts = np.cumsum(count) - count
        highest = np.maximum.reduceat(values[order], starts) if len(order) else values
        lowest = np.minimum.reduceat(values[order], starts) if len(order) else values
        shares = np.stack([mean(column) for column in gait.T], axis=1)
        means = np.stack([mean(column) for column in values.T], axis=1)
        cycles = _Cycles(
            shares.argmax(axis=1),
            mean(np.hypot(velocity[:, 0], velocity[:, 1])),
            mean(velocity[:, 1]),
            np.where(means < FAINT * self.highest, 0.0, means),
            numbers,
        )
        keep = (shares.max(axis=1) > 0.5) & ((highest - lowest).max(axis=1) <= STEADY * self.highest)
        kept = _Cycles(**{name: getattr(cycles, name)[keep] for name in vars(cycles)})
        self._clips[clip] = (source, kept)

    def to_arrays(self, clip: str) -> dict[str, np.ndarray]:
        """The cycles of a clip that was added, for a file; nothing where it was not."""
        if clip not in self._clips:
            return {}
        source, cycles = self._clips[clip]
        return {"source": np.array(source or ""), **vars(cycles)}

    def add_arrays(self, clip: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Add a clip by what `to_arrays` gave of it."""
        named = {name: values for name, values in arrays.items() if name != "source"}
        self._clips[clip] = (str(arrays["source"]) or None, _Cycles(**named))

    def learn(self) -> Limits | None:
        """The limits; None where nothing is told in any cycle."""
        levels = np.linspace(0, self.highest, LEVELS)
        healthy = self._healthy()
        top = np.full(self.gaits, UNLIMITED)
        usual = np.zeros(self.gaits)
        for g in range(self.gaits):
            if len(speeds := healthy[healthy[:, 0] == g, 1]):
                top[g], usual[g] = np.percentile(speeds, [TOP, USUAL])
        gait, share, values = self._shares(usual)
        if not len(share):
            return None
        labels = values.shape[1]
        speeds = np.repeat(top[:, None, None], labels, axis=1).repeat(LEVELS, axis=2)
        for label in range(labels):
            of = _of_label(label, values, self.across)
            s, r, gaits = (
                np.concatenate(part) for part in zip(*((v, share[i], gait[i]) for i, v in of), strict=True)
            )
            fall = float(s @ (1 - r) / (s @ s)) if len(s) else 0.0
            expected = _fitted(levels, s, r, np.maximum(1 - fall * levels, SLOWEST))
            for k in np.flatnonzero(top < UNLIMITED):
                own = _fitted(levels, s[gaits == k], r[gaits == k], expected)
                hurries = np.maximum(own - LAME, 0.0) / (1 - LAME)
                speeds[k, label] = usual[k] * own + (top[k] - usual[k]) * hurries
        return Limits(levels, speeds)

    def _healthy(self) -> Array:
        """(n, 2) gait and speed of the cycles in which nothing is told and the body goes ahead."""
        found = [np.zeros((0, 2))]
        for _, cycles in self._clips.values():
            on = (
                ~cycles.values.any(axis=1)
                & (cycles.ahead >= AHEAD * cycles.speed)
                & (cycles.speed > RESOLUTE)
            )
            found.append(np.stack([cycles.gait[on], cycles.speed[on]], axis=1))
        return np.concatenate(found)

    def _shares(self, usual: Array) -> tuple[np.ndarray, Array, Array]:
        """Of cycles in which something is told: gait (n,), share of the healthy speed (n,), values (n, L)."""
        parts = []
        for source, cycles in self._clips.values():
            told = cycles.values.any(axis=1)
            if source is not None and source in self._clips:
                own = self._clips[source][1]
                speed_of = dict(zip(own.number.tolist(), own.speed.tolist(), strict=True))
                beside = np.array([speed_of.get(n, 0.0) for n in cycles.number.tolist()])
            else:  # captured: only what goes ahead can be set beside the usual speed
                ahead = cycles.ahead >= AHEAD * cycles.speed
                beside = np.where(ahead, usual[cycles.gait], 0.0)
            on = told & (beside > RESOLUTE)
            share = np.clip(cycles.speed[on] / beside[on], SLOWEST, 1.0)
            parts.append((cycles.gait[on], share, cycles.values[on]))
        if not parts:
            return np.zeros(0, int), np.zeros(0), np.zeros((0, len(self.across)))
        gait, share, values = (np.concatenate(column) for column in zip(*parts, strict=True))
        return gait, share, values


def _of_label(label: int, values: Array, across: np.ndarray) -> Sequence[tuple[np.ndarray, Array]]:
    """Which cycles tell of a label, and its values there: of either side, those that tell nothing else.

    Where there are none, those in which nothing else is told more of.
    """
    sides = sorted({label, int(across[label])})
    alone = [np.flatnonzero((values[:, k] > 0) & ((values > 0).sum(axis=1) == 1)) for k in sides]
    if not any(len(found) for found in alone):
        worst = values.max(axis=1, initial=0.0)
        alone = [np.flatnonzero((values[:, k] > 0) & (values[:, k] >= worst)) for k in sides]
    return [(found, values[found, k]) for found, k in zip(alone, sides, strict=True)]


def _fitted(levels: Array, values: Array, shares: Array, expected: Array) -> Array:
    """(K,) the shares at `levels` whose interpolation is nearest to the shares (n,) at values (n,).

    1 at 0, never rising; `expected` (K,) counts as FIRM cycles at each level.
    """
    at = np.clip(np.searchsorted(levels, values, side="right") - 1, 0, len(levels) - 2)
    far = (values - levels[at]) / (levels[at + 1] - levels[at])
    basis = np.zeros((len(values), len(levels)))
    rows = np.arange(len(values))
    basis[rows, at], basis[rows, at + 1] = 1 - far, far
    inner = basis[:, 1:]
    left = inner.T @ inner + FIRM * np.eye(len(levels) - 1)
    right = inner.T @ (shares - basis[:, 0]) + FIRM * expected[1:]
    found = np.concatenate([[1.0], np.linalg.solve(left, right)])
    return np.minimum.accumulate(np.clip(found, SLOWEST, 1.0))
