"""Speed limits of a hurt or sad body, learnt from the rows of a database and saved with the network.

A channel is a group of inputs of the network that tell how hurt or how sad a body is. Each of its columns has
a label, such as the name of a bone or mood, and values from 0 (no effect) to the channel's highest value. A
body is healthy if the values of all channels are 0.

A hurt body cannot go as fast as a healthy one. How fast it goes is measured in the rows of the database, one
for each frame of a clip. A hurt version is a clip that is computed from a healthy clip, as a hurt person
would walk it. Each gait cycle of a hurt version is compared with the same cycle of the healthy clip. Captured
hurt clips have no healthy counterpart, so their cycles are compared with the usual speed of their gait.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hobble.core.declared import ArrayOf, check_arrays
from hobble.core.errors import InputError
from hobble.core.quat import Array

UNLIMITED = 1e4  # cm a frame: limit of a gait if the database has no healthy forward cycle in this gait
LEVELS = 5  # the limits are stored for this many values of a column, evenly spaced from 0 to the highest
# Percentiles of the speeds of all healthy cycles in a gait: TOP gives the limit of a healthy body, USUAL its
# usual speed. The median would be too low for the usual speed, because clips also contain starts and stops.
TOP, USUAL = 95, 70
# A body that an injury slows to this share of the usual speed or less cannot hurry: its limit is the slowed
# speed. A body that keeps the whole usual speed can hurry up to the limit of a healthy one (TOP). Between
# these two shares the limit is interpolated.
CANNOT_HURRY = 0.85
AHEAD = 0.9  # a cycle counts as forward if at least this share of its speed is forward
STEADY = 0.35  # a cycle is left out if a value changes in it by more than this share of the highest value
FAINT = 0.05  # if the mean value in a cycle is below this share of the highest value, it counts as 0
MOVING = 0.1  # cm a frame: cycles in which a healthy body is slower are left out
# Where there are few cycles, a fitted curve should stay near an expected curve. So the expected curve counts
# as much as this many cycles at each level.
EXPECTED_WEIGHT = 2.0
# Several effects on one thing, such as those of two injuries on the speed, add up as a p-norm with this p:
# 1 would be the sum, infinity the largest effect alone. Hurt versions of clips use the same p.
SUM_NORM = 3.0
SLOWEST = 0.1  # lowest share of the healthy speed; lower shares are raised to it


@dataclass(frozen=True)
class Limits:
    """Speed limits of a channel with L labels in G gaits.

    levels: (K,) ascending values from 0 to the channel's highest. speeds: (G, L, K) highest speeds, cm a
    frame, for each gait, label and level; they never rise with the level. usual: (G,) usual speeds of a
    healthy body, cm a frame.
    """

    levels: Array = field(repr=False)
    speeds: Array = field(repr=False)
    usual: Array = field(repr=False)

    def highest_speeds(self, values: Array) -> Array:
        """(C, G) highest speeds of C characters in each gait, cm a frame, interpolated between the levels.

        values: (C, L) value of each label for each character. If several values are above 0, the shares
        of the healthy speed that they take add up as a p-norm (see SUM_NORM). If all are 0, the speed is inf.
        """
        below, weight = _between_levels(self.levels, values)
        label = np.arange(values.shape[1])
        speed_low, speed_high = self.speeds[:, label, below], self.speeds[:, label, below + 1]
        speeds = np.where(values > 0, speed_low + weight * (speed_high - speed_low), np.inf)
        lowest = np.min(speeds, axis=2, initial=np.inf).T
        healthy = self.speeds[:, :, 0].max(axis=1)  # (G,)
        lost = 1 - np.minimum(speeds / healthy[:, None, None], 1.0)  # shares of the healthy speed
        together = healthy * np.maximum(1 - (lost**SUM_NORM).sum(axis=2) ** (1 / SUM_NORM), SLOWEST).T
        several = ((values > 0).sum(axis=1) > 1)[:, None]
        return np.where(several, np.minimum(together, lowest), lowest)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a file."""
        speeds, usual = (np.round(values, 4).tolist() for values in (self.speeds, self.usual))
        return {"levels": self.levels.tolist(), "speeds": speeds, "usual": usual}

    @classmethod
    def from_dict(
        cls, path: str | Path, name: str, data: Mapping[str, Any], gaits: int, labels: int, highest: float
    ) -> Limits:
        """The inverse of `to_dict`.

        path, name: the file and the name of the channel, for messages. gaits, labels: how many there are.
        highest: the highest value of the channel. Raises InputError for limits that are not possible.
        """
        where = f"limits of {name}: "
        try:
            arrays = {where + key: np.array(data[key], float) for key in ("levels", "speeds", "usual")}
        except (KeyError, TypeError, ValueError, OverflowError):
            problem = f"{where}`levels`, `speeds` and `usual` have to be tables of numbers"
            raise InputError(path, problem) from None
        declared = {
            f"{where}levels": ArrayOf(("K",), low=0.0, high=highest),
            f"{where}speeds": ArrayOf((gaits, labels, "K"), low=1e-9, high=UNLIMITED),
            f"{where}usual": ArrayOf((gaits,), low=0.0, high=UNLIMITED),
        }
        check_arrays(path, arrays, declared)
        levels, speeds, usual = arrays.values()
        if levels.size < 2 or levels[0] != 0 or levels[-1] != highest or not (np.diff(levels) > 0).all():
            raise InputError(path, f"{where}levels do not rise from 0 to {highest:g}")
        if (np.diff(speeds, axis=2) > 0).any():
            raise InputError(path, f"{where}speeds rise with the level; they must stay the same or fall")
        return cls(levels, speeds, usual)


def combine_limits(limits: Sequence[Array], usual: Array) -> Array:
    """(C, G) highest speeds of C characters in each gait under the limits of several channels, cm a frame.

    limits: for each channel, (C, G) `Limits.highest_speeds`. usual: (G,) usual speeds of a healthy body. Each
    channel leaves a share of the usual speed, and these shares are multiplied: a sad person who limps is
    slower than a person who is only sad or only limps. A channel that allows the usual speed has the share 1.
    If all channels allow the usual speed, the lowest of their limits counts.
    """
    shares = [
        np.minimum(1.0, np.divide(speed, usual, out=np.ones_like(speed), where=usual > 0)) for speed in limits
    ]
    lowest = np.min(limits, axis=0)
    return np.where(lowest < usual, usual * np.prod(shares, axis=0), lowest)


class _Cycles(NamedTuple):
    """N gait cycles of one clip.

    number: (N,) number of the cycle in the clip. gait: (N,) index of the main gait. speed: (N,) mean speed,
    cm a frame. ordinary: (N,) bool, whether the body moves forward and no other channel has a value above 0.
    values: (N, L) mean value of each label, 0 if it is below FAINT.
    """

    number: np.ndarray
    gait: np.ndarray
    speed: Array
    ordinary: np.ndarray
    values: Array


class LimitLearner:
    """Collects the gait cycles of clips, one clip at a time, and learns the limits of one channel from them.

    highest: the channel's highest value. counterparts: (L,) for each label, the index of its counterpart on
    the other side of the body, or its own index. Both sides get the same limits. gaits: number of gaits.
    """

    def __init__(self, highest: float, counterparts: np.ndarray, gaits: int) -> None:
        self.highest, self.counterparts, self.gaits = highest, counterparts, gaits
        # Name of a clip -> name of its source (as in `add`) or None, and the cycles of the clip.
        self._clips: dict[str, tuple[str | None, _Cycles]] = {}

    def add(
        self,
        clip: str,
        *,
        gait: Array,
        velocity: Array,
        values: Array,
        cycle: np.ndarray,
        others: np.ndarray,
        source: str | None = None,
    ) -> None:
        """Add a clip with R rows, one for each frame.

        gait: (R, G) shares of the gaits. velocity: (R, 2) of the root, to the side and forward in root
        coordinates, cm per frame. values: (R, L) values of this channel. cycle: (R,) number of the row's gait
        cycle in the clip. others: (R,) bool, whether another channel has a value above 0. source: if the clip
        is a hurt version, the name of the clip from which it was computed.
        """
        order = np.argsort(cycle, kind="stable")
        numbers, starts, count = np.unique(cycle[order], return_index=True, return_counts=True)
        table = np.column_stack([np.hypot(*velocity.T), velocity[:, 1], others, gait, values])[order]
        means = np.add.reduceat(table, starts) / count[:, None]
        speed, ahead, others = means[:, :3].T
        shares, value = np.split(means[:, 3:], [self.gaits], axis=1)
        cycles = _Cycles(
            number=numbers,
            gait=shares.argmax(axis=1),
            speed=speed,
            ordinary=(ahead >= AHEAD * speed) & (others == 0),
            values=np.where(value < FAINT * self.highest, 0.0, value),
        )
        highest, lowest = (f.reduceat(values[order], starts) for f in (np.maximum, np.minimum))
        # Only cycles with one main gait and with steady values.
        keep = (shares.max(axis=1) > 0.5) & ((highest - lowest).max(axis=1) <= STEADY * self.highest)
        self._clips[clip] = source, _Cycles(*(part[keep] for part in cycles))

    def learn(self) -> Limits | None:
        """The limits, or None if no cycle with a value above 0 can be compared with a healthy one.

        For each label, the share of the healthy speed is fitted as a function of the value, in three steps.
        First, a straight line is fitted to the cycles of all gaits. Second, a curve is fitted to the same
        cycles; where there are few, it stays near the line. Third, a curve is fitted to the cycles of each
        gait; where there are few, it stays near the curve of all gaits.
        """
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
            both_sides = _cycles_of_label(label, values, self.counterparts)
            value, shares, gaits = (
                np.concatenate(part)
                for part in zip(*((v, share[i], gait[i]) for i, v in both_sides), strict=True)
            )
            # Slope of the line 1 - fall * value, fitted to the shares by least squares.
            fall = float(value @ (1 - shares) / (value @ value)) if len(value) else 0.0
            line = np.maximum(1 - fall * levels, SLOWEST)
            curve = _fit_shares(levels, value, shares, line)
            for row in np.flatnonzero(top < UNLIMITED):
                in_gait = _fit_shares(levels, value[gaits == row], shares[gaits == row], curve)
                # How much the body can hurry: 0 not at all, 1 as much as a healthy one.
                hurry = np.maximum(in_gait - CANNOT_HURRY, 0.0) / (1 - CANNOT_HURRY)
                speeds[row, label] = usual[row] * in_gait + (top[row] - usual[row]) * hurry
        return Limits(levels, speeds, usual)

    def _healthy(self) -> Array:
        """(n, 2) index of the gait, and speed, of each forward cycle in which all channels are 0."""
        found = [np.zeros((0, 2))]
        for _, cycles in self._clips.values():
            kept = cycles.ordinary & ~cycles.values.any(axis=1) & (cycles.speed > MOVING)
            found.append(np.stack([cycles.gait[kept], cycles.speed[kept]], axis=1))
        return np.concatenate(found)

    def _shares(self, usual: Array) -> tuple[np.ndarray, Array, Array]:
        """Gait (n,), share of the healthy speed (n,) and values (n, L) of the cycles with a value above 0.

        usual: (G,) usual speed of each gait, cm a frame. A cycle of a hurt version is compared with the same
        cycle of its source, the clip from which it was computed. The cycle is left out if the source already
        has a value above 0 in this channel. For example, a sad clip and its hurt version are equally sad, so
        they say nothing about the limits of sadness.
        """
        parts = []
        for source, cycles in self._clips.values():
            changed = cycles.values.any(axis=1)
            if source is not None and source in self._clips:
                origin = self._clips[source][1]
                source_speed = np.where(origin.values.any(axis=1), 0.0, origin.speed)  # 0: left out below
                speed_of = dict(zip(origin.number.tolist(), source_speed.tolist(), strict=True))
                healthy_speed = np.array([speed_of.get(n, 0.0) for n in cycles.number.tolist()])
            else:  # without a source, only forward cycles without values in other channels can be compared
                healthy_speed = np.where(cycles.ordinary, usual[cycles.gait], 0.0)
            kept = changed & (healthy_speed > MOVING)
            share = np.clip(cycles.speed[kept] / healthy_speed[kept], SLOWEST, 1.0)
            parts.append((cycles.gait[kept], share, cycles.values[kept]))
        nothing = np.zeros(0, int), np.zeros(0), np.zeros((0, len(self.counterparts)))
        gait, share, values = (np.concatenate(column) for column in zip(nothing, *parts, strict=True))
        return gait, share, values


def _cycles_of_label(label: int, values: Array, across: np.ndarray) -> Sequence[tuple[np.ndarray, Array]]:
    """The cycles that count for a label and for its counterpart on the other side of the body.

    values: (n, L) of all cycles. across: (L,) index of each label's counterpart, or its own index. A cycle
    counts for a label if only this label is above 0 in it. If neither label has such a cycle, a cycle counts
    if the label is above 0 and no other label has a higher value in it.

    Returns a pair for both labels, or for the label alone if it has no counterpart: the indices of its
    cycles, and its values in them.
    """
    sides = sorted({label, int(across[label])})
    cycles = [np.flatnonzero((values[:, k] > 0) & ((values > 0).sum(axis=1) == 1)) for k in sides]
    if not any(len(indices) for indices in cycles):
        highest = values.max(axis=1, initial=0.0)
        cycles = [np.flatnonzero((values[:, k] > 0) & (values[:, k] >= highest)) for k in sides]
    return [(indices, values[indices, k]) for indices, k in zip(cycles, sides, strict=True)]


def _between_levels(levels: Array, values: Array) -> tuple[np.ndarray, Array]:
    """The index of the level below each value, and how far the value is from it to the next level, 0 to 1."""
    below = np.clip(np.searchsorted(levels, values, side="right") - 1, 0, len(levels) - 2)
    return below, (values - levels[below]) / (levels[below + 1] - levels[below])


def _fit_shares(levels: Array, values: Array, shares: Array, expected: Array) -> Array:
    """(K,) shares of the healthy speed at `levels` (K,), fitted to n cycles by least squares.

    values, shares: (n,) value of the label and share of the healthy speed in each cycle. Shares between two
    levels are interpolated. The first share is 1, and the shares never rise with the level. expected: (K,)
    share at each level, which counts as much as EXPECTED_WEIGHT cycles there.
    """
    below, weight = _between_levels(levels, values)
    basis = np.zeros((len(values), len(levels)))  # basis @ (shares at the levels) = shares in the cycles
    rows = np.arange(len(values))
    basis[rows, below], basis[rows, below + 1] = 1 - weight, weight
    inner = basis[:, 1:]  # without the first level, whose share is known to be 1
    matrix = inner.T @ inner + EXPECTED_WEIGHT * np.eye(len(levels) - 1)
    vector = inner.T @ (shares - basis[:, 0]) + EXPECTED_WEIGHT * expected[1:]
    fitted = np.concatenate([[1.0], np.linalg.solve(matrix, vector)])
    return np.minimum.accumulate(np.clip(fitted, SLOWEST, 1.0))
