"""Compiled loops shared by the fast training steps and the optimiser, and their number of threads."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.core.compiled import njit

NUMBERS_PER_THREAD = 100_000  # a thread gets at least this many numbers, about 20 microseconds of work
# The state of the random number generator splitmix64 grows by this for each number.
SPLITMIX_STEP = np.uint64(0x9E3779B97F4A7C15)


def use_threads(values: int) -> None:
    """Set how many threads the next compiled loop over `values` numbers uses.

    A short loop uses fewer threads than PyTorch, because waking threads takes time.
    """
    threads = min(torch.get_num_threads(), numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    numba.set_num_threads(max(1, min(threads, values // NUMBERS_PER_THREAD)))


def as_numpy(array: Tensor) -> np.ndarray:
    """The tensor as a numpy array. bfloat16 becomes uint16 with the same bits: numpy has no bfloat16."""
    return array.view(torch.uint16).numpy() if array.dtype == torch.bfloat16 else array.numpy()


@njit(inline="always")
def to_bfloat16(value: Any) -> Any:
    """The bits of a float32 as bfloat16, rounded to nearest, ties to even."""
    word = np.float32(value).view(np.uint32)
    even = np.uint32(np.uint32(word >> np.uint32(16)) & np.uint32(1))
    return np.uint16(np.uint32(word + even + np.uint32(0x7FFF)) >> np.uint32(16))


@njit(inline="always")
def to_float32(half: Any) -> Any:
    """The float32 of a bfloat16. half: its bits."""
    return np.uint32(np.uint32(half) << np.uint32(16)).view(np.float32)


@njit(parallel=True, error_model="numpy")
def draw(mask: Any, counter: Any, keep: Any) -> None:
    """Fill a dropout mask (rows, width) with random 0 or 1 / keep, by splitmix64 (Steele et al. 2014).

    counter: state of the generator before the first number. keep: probability that an entry is 1 / keep.
    """
    rows, width = mask.shape
    scale = mask.dtype.type(1 / keep)
    bound = np.uint64(keep * 2.0**32)
    for row in numba.prange(rows):
        for i in range(width):
            z = counter + np.uint64(row * width + i + 1) * SPLITMIX_STEP
            z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            mask[row, i] = scale if (z >> np.uint64(32)) < bound else 0


def counter_after(counter: np.uint64, numbers: int) -> np.uint64:
    """The counter with which the next `draw` continues, after `numbers` numbers were drawn."""
    return np.uint64((int(counter) + numbers * int(SPLITMIX_STEP)) % 2**64)
