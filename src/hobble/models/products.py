"""Matrix products for training, computed in the fastest way that PyTorch's libraries offer on this CPU."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from time import perf_counter, thread_time

import torch
from torch import Tensor

from hobble.models import product_trial

# A function that computes the product a @ b.T of its first two arguments. The third is `out` of `product`.
Way = Callable[[Tensor, Tensor, Tensor], Tensor]

# For products with fewer multiplications and additions than this, a trial of WAYS is not worth its time. They
# take at most some 50 microseconds in any way.
WORTH_A_TRIAL = 8_000_000
TYPES = (torch.float32, torch.bfloat16)  # products in other types have no trial


def product(a: Tensor, b: Tensor, out: Tensor | None = None) -> Tensor:
    """a @ b.T for a (m, n) and b (k, n).

    out: (m, k) memory that the result may use, so that no memory has to be allocated. On a CPU, a short trial
    chooses one of WAYS for a large product. Later runs on the same machine use the same way for products of
    this shape, because the ways round differently (`hobble.models.product_trial`).
    """
    m, n, k = *a.shape, len(b)
    if a.device.type != "cpu" or a.dtype not in TYPES or 2 * m * n * k < WORTH_A_TRIAL:
        return _plain(a, b, out)
    way = WAYS[_chosen_way((m, n, k), (_is_by_rows(a), _is_by_rows(b)), a.dtype, torch.get_num_threads())]
    return way(a, b, torch.empty(m, k, dtype=a.dtype) if out is None else out)


def _plain(a: Tensor, b: Tensor, out: Tensor | None) -> Tensor:
    """The product by PyTorch's default library: MKL for float32, oneDNN for bfloat16."""
    return torch.mm(a, b.T, out=out)


def _turned(a: Tensor, b: Tensor, out: Tensor) -> Tensor:
    """The product as the transpose of b @ a.T, by PyTorch's default library. Faster if a has few rows."""
    return out.copy_(torch.mm(b, a.T).T)


def _linear(a: Tensor, b: Tensor, out: Tensor) -> Tensor:
    """The product by oneDNN, which has 512-bit kernels for all processors. MKL has them only for Intel."""
    return torch.ops.mkldnn._linear_pointwise(a, b, None, "none", [], "")


# Name of a way, as stored in the file of choices -> its function.
WAYS: dict[str, Way] = {"plain": _plain, "turned": _turned}
if torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise"):
    WAYS["linear"] = _linear


@cache
def working_ways(dtype: torch.dtype) -> tuple[str, ...]:
    """Names of the WAYS that this CPU has for a type. Without AVX-512, oneDNN refuses bfloat16."""
    names = []
    for name, way in WAYS.items():
        with suppress(RuntimeError):
            way(*(torch.ones(32, 32, dtype=dtype) for _ in range(3)))
            names.append(name)
    return tuple(names)


@cache
def _chosen_way(
    shape: tuple[int, int, int], by_rows: tuple[bool, bool], dtype: torch.dtype, threads: int
) -> str:
    """The name of the fastest way for a product, from a trial now or in an earlier run.

    shape: (m, n, k) of `product`. by_rows: for a and for b, True if it is stored row by row, False if column
    by column. threads: number of threads. The batch size is rounded up to a power of 2, so that similar
    batches share a choice.
    """
    # The batch size is m, the number of rows of `a`, with one exception: in the product that gives the
    # gradient of weights, it is n, the number of columns of `a`. Only this `a` is stored column by column.
    sizes = list(shape)
    batch = 0 if by_rows[0] else 1
    sizes[batch] = 1 << (sizes[batch] - 1).bit_length()
    m, n, k = sizes
    stored = "".join("r" if rows else "c" for rows in by_rows)
    name = f"{m} x {n} x {k} {stored} {str(dtype).removeprefix('torch.')}, {threads} threads"

    def trial() -> str:
        a, b = (_constant_matrix(rows, n, each, dtype) for rows, each in zip((m, k), by_rows, strict=True))
        out = torch.empty(m, k, dtype=dtype)
        clock = thread_time if threads == 1 else perf_counter
        return product_trial.fastest_way({way: partial(WAYS[way], a, b, out) for way in ways}, clock)

    ways = working_ways(dtype)
    default = "linear" if dtype == torch.float32 and "linear" in ways else "plain"
    return product_trial.choose_once(name, trial, ways, default)


def _is_by_rows(a: Tensor) -> bool:
    """Whether a matrix is stored row by row, so that neighbours in a row are neighbours in memory."""
    return a.stride(1) == 1


def _constant_matrix(rows: int, columns: int, by_rows: bool, dtype: torch.dtype) -> Tensor:
    """A (rows, columns) matrix of equal numbers. So the trial uses up no random numbers of the training."""
    shape = (rows, columns) if by_rows else (columns, rows)
    values = torch.full(shape, 0.01, dtype=dtype)
    return values if by_rows else values.T
