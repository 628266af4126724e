"""Means and standard deviations over all pairs of a frame and a terrain fit, without storing the pairs.

Below, a deviation is a standard deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.channel import CONSTANT, SILENT
from hobble.core.quat import Array
from hobble.rows.clip_rows import ClipRows
from hobble.rows.compose import TERRAIN, body_layout
from hobble.rows.layout import RowLayout

UNSEEN = 1e-10  # input weight of a joint that the network shall not see, as in Holden et al. (2017)
BATCH = 2048  # so many rows of a clip are converted to float64 at a time


@dataclass(frozen=True)
class Moments:
    """Moments of rows with C columns.

    weight: sum of the rows' weights. mean: (C,) weighted mean. squares: (C,) weighted sum of squared
    differences from the mean.
    """

    weight: float
    mean: Array = field(repr=False)
    squares: Array = field(repr=False)

    def __add__(self, other: Moments) -> Moments:
        """The moments of two sets of rows together (Chan, Golub, LeVeque, Updating formulae, 1979)."""
        weight = self.weight + other.weight
        if weight == 0:
            return self
        delta = other.mean - self.mean
        mean = self.mean + delta * (other.weight / weight)
        squares = self.squares + other.squares + delta**2 * (self.weight * other.weight / weight)
        return Moments(weight, mean, squares)

    def __mul__(self, times: float) -> Moments:
        """The moments of the same values with weights multiplied by `times`."""
        return Moments(self.weight * times, self.mean, self.squares * times)

    def columns(self, block: slice) -> Moments:
        """The moments of some of the columns."""
        return Moments(self.weight, self.mean[block], self.squares[block])

    @property
    def std(self) -> Array:
        """Population standard deviation (C,), as numpy's."""
        return np.sqrt(self.squares / max(self.weight, 1e-300))

    @classmethod
    def nothing(cls, columns: int) -> Moments:
        """The moments of no values."""
        return cls(0.0, np.zeros(columns), np.zeros(columns))

    @classmethod
    def of(cls, values: Array, weights: Array | None = None) -> Moments:
        """The moments of values (N, C). Each row has weight 1, or its entry in `weights` (N,)."""
        values = np.asarray(values, np.float64, order="C")
        if not len(values):
            return cls.nothing(values.shape[1])
        w = np.ones((len(values), 1)) if weights is None else np.asarray(weights, np.float64)[:, None]
        total = float(w.sum())
        # Sums, not matrix products: the last bits of a product depend on the arrays' memory addresses.
        mean = (w * values).sum(axis=0) / total
        return cls(total, mean, (w * (values - mean) ** 2).sum(axis=0))


@dataclass(frozen=True)
class Statistics:
    """The means and deviations by which rows are standardised, float32. No deviation is 0.

    x_mean, x_std: (X,). y_mean, y_std: (Y,).
    """

    x_mean: Array = field(repr=False)
    x_std: Array = field(repr=False)
    y_mean: Array = field(repr=False)
    y_std: Array = field(repr=False)


def clip_moments(rows: ClipRows, layout: RowLayout) -> tuple[Moments, Moments]:
    """Moments of X and of Y over the clip's (frame, fit) pairs, with columns as in `layout`.

    Each row has weight 1, shared equally by its fits. So the one fit of a flat row counts as much as the ten
    fits of another row together.
    """
    body = body_layout(layout)
    x, y = Moments.nothing(layout.x_size), Moments.nothing(layout.y_size)
    first = rows.first_fit
    for start in range(0, len(rows), BATCH):
        part = slice(start, min(start + BATCH, len(rows)))
        fits = rows.fits[part]
        span = slice(int(first[start]), int(first[part.stop - 1] + fits[-1]))
        of_row = np.repeat(np.arange(len(fits)), fits)
        share = 1.0 / fits[of_row]
        mean = rows.mean[span].astype(np.float64)
        row_mean: Array = np.bincount(of_row, share * mean, len(fits)).astype(np.float64)
        spread = float(np.sum(share * (mean - row_mean[of_row]) ** 2))
        heights = Moments.of(rows.heights[span], share)
        x_frame = _lowered(rows.x[part], body.x_joint_position, row_mean, spread)
        parts = {name: x_frame.columns(block) for name, block in body.blocks("x").items() if name != TERRAIN}
        parts |= {name: Moments.of(rows.channels[name][part]) for name, _ in layout.channels}
        x = x + _joined(*[({TERRAIN: heights} | parts)[name] for name in layout.blocks("x")])
        y = y + _lowered(rows.y[part], layout.y_joint_position, row_mean, spread)
    return x, y


def _lowered(values: Array, joints: slice, row_mean: Array, spread: float) -> Moments:
    """Moments of the pairs of R rows and their fits, with a fit's mean height subtracted from joint heights.

    values: (R, C) the rows without this subtraction. joints: columns of joint positions. row_mean: (R,) for
    each row, the average over its fits of their mean heights. spread: weighted sum of the squared differences
    between the mean heights of fits and the `row_mean` of their rows. By the law of total variance, `spread`
    is added to the squares of the rows after `row_mean` is subtracted.
    """
    values = values.astype(np.float64)
    heights = slice(joints.start + 1, joints.stop, 3)
    values[:, heights] -= row_mean[:, None]
    moments = Moments.of(values)
    moments.squares[heights] += spread
    return moments


def _joined(*parts: Moments) -> Moments:
    """Moments of the same rows with the columns of all parts, side by side."""
    mean = np.concatenate([part.mean for part in parts])
    return Moments(parts[0].weight, mean, np.concatenate([part.squares for part in parts]))


def x_groups(layout: RowLayout) -> list[slice]:
    """Groups of columns of X without channels. A group shares one deviation, as in Holden et al. (2017)."""
    half = layout.samples  # a trajectory block has so many columns of x, then as many of z
    split = [
        slice(start, start + half)
        for block in (layout.x_position, layout.x_direction)
        for start in (block.start, block.start + half)
    ]
    return [*split, layout.x_gait, layout.x_joint_position, layout.x_joint_velocity, layout.x_terrain]


def y_groups(layout: RowLayout) -> list[slice]:
    """Groups of columns of Y: the layout's blocks. The columns of a group share one deviation."""
    return list(layout.blocks("y").values())


def grouped(std: Array, groups: Iterable[slice], constant: float) -> Array:
    """(C,) for each column the mean of `std` (C,) over its group, or `constant` if the group never varies."""
    out = np.array(std, np.float64)
    for group in groups:
        mean = float(np.mean(std[group]))
        out[group] = mean if mean > CONSTANT else constant
    return out


def statistics_of_moments(
    layout: RowLayout, x: Moments, y: Moments, joint_weight: float, unseen: Sequence[int]
) -> Statistics:
    """Means, and deviations that are shared within groups of columns (`x_groups`, `y_groups`).

    The deviation of a joint's inputs is divided by w * joint_weight, where w is 1e-10 if the joint is one of
    `unseen`, which the network shall not see, else 1. Each channel defines the deviations of its own columns.
    """
    x_std = grouped(x.std, x_groups(layout), SILENT)
    w = np.ones(layout.joints)
    w[list(unseen)] = UNSEEN
    for block in (layout.x_joint_position, layout.x_joint_velocity):
        # at most 1e30, to stay finite in float32
        x_std[block] = np.minimum(x_std[block] / np.repeat(w * joint_weight, 3), 1e30)
    for name, _ in layout.channels:
        block = layout.x_channel(name)
        x_std[block] = channel(name).deviation(x.std[block])
    y_std = grouped(y.std, y_groups(layout), 1.0)
    f32 = [np.asarray(v, np.float32) for v in (x.mean, x_std, y.mean, y_std)]
    return Statistics(*f32)


def unseen_joints(skeleton: Mapping[str, Any]) -> list[int]:
    """Indices of the skeleton's joints that the network shall not see in its input."""
    joints = list(skeleton["joints"])
    return [joints.index(name) for name in skeleton.get("unseen", ())]
