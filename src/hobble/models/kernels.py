"""Compiled loops that the fast steps and the optimiser share, and how many threads each is worth."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.core.compiled import njit

WORTH_A_THREAD = 100_000  # numbers, some 20 microseconds of work
ODD = np.uint64(0x9E3779B97F4A7C15)


def team(values: int) -> None:
    """Give the next compiled loop as many threads as pay for `values` numbers: waking one takes a while."""
    most = min(torch.get_num_threads(), numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    numba.set_num_threads(max(1, min(most, values // WORTH_A_THREAD)))


def bits(array: Tensor) -> np.ndarray:
    """An array that compiled loops can use: numpy has no bfloat16, so its bits as uint16."""
    return array.view(torch.uint16).numpy() if array.dtype == torch.bfloat16 else array.numpy()


@njit(inline="always")
def rounded(value: Any) -> Any:
    """The bits of a float32 as bfloat16, rounded to even."""
    word = np.float32(value).view(np.uint32)
    even = np.uint32(np.uint32(word >> np.uint32(16)) & np.uint32(1))
    return np.uint16(np.uint32(word + even + np.uint32(0x7FFF)) >> np.uint32(16))


@njit(inline="always")
def widened(half: Any) -> Any:
    """The float32 whose bfloat16 bits these are."""
    return np.uint32(np.uint32(half) << np.uint32(16)).view(np.float32)


@njit(parallel=True, error_model="numpy")
def draw(mask: Any, counter: Any, keep: Any) -> None:
    """Fill `mask` (rows, width) from a counter (splitmix64: Steele et al. 2014)."""
    rows, width = mask.shape
    scale = mask.dtype.type(1 / keep)
    bound = np.uint64(keep * 2.0**32)
    for row in numba.prange(rows):
        for i in range(width):
            z = counter + np.uint64(row * width + i + 1) * ODD
            z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            mask[row, i] = scale if (z >> np.uint64(32)) < bound else 0


def further(counter: np.uint64, numbers: int) -> np.uint64:
    """The counter of `draw` after so many numbers."""
    return np.uint64((int(counter) + numbers * int(ODD)) % 2**64)
