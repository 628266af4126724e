"""Matrix products for training, computed in the fastest way that PyTorch's libraries offer on this CPU."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from time import perf_counter, thread_time

import torch
from torch import Tensor

from hobble.models import product_trial

Way = Callable[[Tensor, Tensor, Tensor], Tensor]

# A trial of the ways is worth its time from this number of multiplications and additions on. A smaller
# product takes some 50 microseconds in any of them.
WORTH_A_TRIAL = 8_000_000
TYPES = (torch.float32, torch.bfloat16)


def product(a: Tensor, b: Tensor, out: Tensor | None = None) -> Tensor:
    """a @ b.T for a (m, n) and b (k, n).

    out: (m, k) memory that the result may use, so that none has to be allocated. On a CPU the way is chosen
    by a trial, once for each machine and shape, because the ways round differently
    (`hobble.models.product_trial`).
    """
    m, n, k = *a.shape, len(b)
    if a.device.type != "cpu" or a.dtype not in TYPES or 2 * m * n * k < WORTH_A_TRIAL:
        return _plain(a, b, out)
    shape = (m, n, k), (_by_rows(a), _by_rows(b)), a.dtype, torch.get_num_threads()
    return WAYS[_chosen(*shape)](a, b, torch.empty(m, k, dtype=a.dtype) if out is None else out)


def _plain(a: Tensor, b: Tensor, out: Tensor | None) -> Tensor:
    """The product by PyTorch's default library: MKL for float32, oneDNN for bfloat16."""
    return torch.mm(a, b.T, out=out)


def _turned(a: Tensor, b: Tensor, out: Tensor) -> Tensor:
    """The transpose of b @ a.T, by PyTorch's default library. It is faster for few rows."""
    return out.copy_(torch.mm(b, a.T).T)


def _linear(a: Tensor, b: Tensor, out: Tensor) -> Tensor:
    """The product by oneDNN. MKL has no 512-bit kernels for processors of other makers than Intel."""
    return torch.ops.mkldnn._linear_pointwise(a, b, None, "none", [], "")


WAYS: dict[str, Way] = {"plain": _plain, "turned": _turned}
if torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise"):
    WAYS["linear"] = _linear


@cache
def _chosen(shape: tuple[int, int, int], by_rows: tuple[bool, bool], dtype: torch.dtype, threads: int) -> str:
    """The name of the way for a product. Batches of nearly the same size share a choice.

    shape: (m, n, k). by_rows: whether a and b are stored row by row, or else column by column.
    """
    # The rows of a batch are the rows of a, or, for the gradient of weights, its columns.
    sizes = list(shape)
    batch = 0 if by_rows[0] else 1
    sizes[batch] = 1 << (sizes[batch] - 1).bit_length()
    m, n, k = sizes
    stored = "".join("r" if rows else "c" for rows in by_rows)
    name = f"{m} x {n} x {k} {stored} {str(dtype).removeprefix('torch.')}, {threads} threads"

    def trial() -> str:
        a, b = (_filled(rows, n, each, dtype) for rows, each in zip((m, k), by_rows, strict=True))
        out = torch.empty(m, k, dtype=dtype)
        clock = thread_time if threads == 1 else perf_counter
        return product_trial.fastest({name: partial(way, a, b, out) for name, way in WAYS.items()}, clock)

    without = "linear" if dtype == torch.float32 and "linear" in WAYS else "plain"
    return product_trial.kept_choice(name, trial, WAYS, without)


def _by_rows(a: Tensor) -> bool:
    return a.stride(1) == 1


def _filled(rows: int, columns: int, by_rows: bool, dtype: torch.dtype) -> Tensor:
    """(rows, columns) filled with one number, so that no random numbers are drawn."""
    shape = (rows, columns) if by_rows else (columns, rows)
    values = torch.full(shape, 0.01, dtype=dtype)
    return values if by_rows else values.T
