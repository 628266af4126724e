"""Compiled functions for the fused training steps and the optimiser: threads, bfloat16, dropout masks."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.core.compiled import njit

NUMBERS_PER_THREAD = 100_000  # a thread gets at least this many numbers, about 20 microseconds of work
# The random number generator splitmix64 adds this to its state for each number that it draws.
SPLITMIX_STEP = np.uint64(0x9E3779B97F4A7C15)


def use_threads(values: int) -> None:
    """Set how many threads the next compiled loop over `values` numbers uses.

    A short loop uses fewer threads than PyTorch, because waking threads takes time.
    """
    threads = min(torch.get_num_threads(), numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    numba.set_num_threads(max(1, min(threads, values // NUMBERS_PER_THREAD)))


def as_numpy(array: Tensor) -> np.ndarray:
    """The tensor as a numpy array on the same memory.

    A bfloat16 tensor becomes uint16 with the same bits, because numpy has no bfloat16.
    """
    return array.view(torch.uint16).numpy() if array.dtype == torch.bfloat16 else array.numpy()


@njit(inline="always")
def to_bfloat16(value: Any) -> Any:
    """The bits (uint16) of a float32 rounded to the nearest bfloat16, ties to even.

    bfloat16 keeps the upper 16 bits. Adding 0x7FFF, or 0x8000 if the last of these bits is 1, carries into
    them exactly where the number has to be rounded up.
    """
    bits = np.float32(value).view(np.uint32)
    last_bit = np.uint32(np.uint32(bits >> np.uint32(16)) & np.uint32(1))
    return np.uint16(np.uint32(bits + last_bit + np.uint32(0x7FFF)) >> np.uint32(16))


@njit(inline="always")
def to_float32(bits: Any) -> Any:
    """The float32 with the value of a bfloat16, given as its bits (uint16)."""
    return np.uint32(np.uint32(bits) << np.uint32(16)).view(np.float32)


@njit(parallel=True, error_model="numpy")
def draw_mask(mask: Any, counter: Any, keep: Any) -> None:
    """Fill a dropout mask (rows, width) at random with 0 and 1 / keep.

    The random numbers are those of splitmix64 (Steele et al. 2014). counter: state of this generator before
    the first number. keep: probability that an entry is 1 / keep.
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
    """The state of splitmix64 after `numbers` more numbers, for the next call of `draw_mask`.

    counter: the state before these numbers.
    """
    return np.uint64((int(counter) + numbers * int(SPLITMIX_STEP)) % 2**64)
