"""Filters over time for arrays (F, ...) of F frames. They return an array of the same shape.

Before the first frame and after the last one, the first and the last value are repeated. The filters use
NumPy only, because importing SciPy would slow the start of every job.
"""

import numpy as np

from hobble.core.quat import Array


def gaussian(values: Array, sigma: float) -> Array:
    """Mean around each frame, weighted by a Gaussian of `sigma` frames that is cut off at four sigma."""
    reach = int(4 * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    return _weighted_sum(values, weights / weights.sum())


def mean(values: Array, width: int) -> Array:
    """Mean over `width` frames (an odd number) around each frame."""
    return _weighted_sum(values, np.full(width, 1.0 / width))


def lowest(values: Array, width: int) -> Array:
    """Lowest value within `width` frames (an odd number) around each frame."""
    return _windows(values, width).min(axis=-1)


def median_of_three(values: Array) -> Array:
    """Median of the values before, at and after each frame. This removes spikes of one frame."""
    return np.median(_windows(values, 3), axis=-1)


def smooth_above(values: Array, frames: int) -> Array:
    """(F,) a smooth curve that is nowhere below `values` (F,).

    It is the maximum of the values around each frame, smoothed. The maximum and the smoothing both reach
    2 * `frames` frames before and after each frame. So all maxima that are averaged in a frame include its
    value.
    """
    highest = _windows(values, 4 * frames + 1).max(axis=-1)
    # Two moving means over 2 * `frames` + 1 frames, one after the other.
    kernel = np.convolve(np.ones(2 * frames + 1), np.ones(2 * frames + 1))
    return _weighted_sum(highest, kernel / kernel.sum())


def _weighted_sum(values: Array, weights: Array) -> Array:
    """Weighted sum of the values around each frame. The middle weight is that of the frame itself."""
    columns = np.reshape(values, (len(values), -1)).T
    reach = len(weights) // 2
    padded = np.pad(columns, ((0, 0), (reach, reach)), mode="edge")
    smooth = [np.convolve(column, weights, mode="valid") for column in padded]
    return np.stack(smooth, axis=1).reshape(np.shape(values))


def _windows(values: Array, width: int) -> Array:
    """(F, ..., width) the values in the `width` frames around each frame."""
    padding = [(width // 2, width // 2)] + [(0, 0)] * (np.ndim(values) - 1)
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, padding, mode="edge"), width, axis=0)


def true_runs(flags: np.ndarray) -> np.ndarray:
    """(n, 2) the first frame of each run of true frames in `flags` (F,), and the frame after its last.

    >>> true_runs(np.array([True, False, True, True])).tolist()
    [[0, 1], [2, 4]]
    """
    return np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]))).reshape(-1, 2)


def smoothstep(x: Array) -> Array:
    """A curve that rises from 0 at x = 0 to 1 at x = 1, with slope 0 at both ends and beyond them."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def interpolate_curve(curve: Array, when: Array | float) -> Array:
    """The values of a curve (F,) at the times `when`, in frames, interpolated linearly.

    They have the shape of `when`. Before frame 0 and after the last frame the curve is constant.

    >>> float(interpolate_curve(np.array([0.0, 10.0, 40.0]), 1.5))
    25.0
    """
    return np.asarray(np.interp(when, np.arange(len(curve)), curve))


def beside_chord(curve: Array, first: float, last: float, share: Array) -> tuple[Array, float]:
    """How far a curve (F, 2) is beside the straight line between two of its points, and this line's length.

    first, last: the frames of the two points, with fractions. share: (N,) shares of the time between them,
    from 0 to 1. The distances are vectors (N, 2) at right angles to the line.
    """
    when = first + (last - first) * np.array([0.0, 1.0, *share])
    start, end, *points = np.stack([interpolate_curve(column, when) for column in curve.T], axis=1)
    along = end - start
    length = max(float(np.linalg.norm(along)), 1e-9)
    across = np.array([along[1], -along[0]]) / length
    return ((np.array(points) - start) @ across)[:, None] * across, length
