"""The training step on a CPU: compiled loops over rows between the experts' matrix products."""

from __future__ import annotations

from typing import Any

import numba
from torch import Tensor

from hobble.core.compiled import njit
from hobble.models.fused_base import FusedBase
from hobble.models.kernels import as_numpy, to_bfloat16, to_float32, use_threads
from hobble.models.mann.step import MannStep


class FusedMannStep(FusedBase, MannStep):
    """Like `MannStep`, but several times faster outside the matrix products. The buffers are reused."""

    def prepared(self, number: int, x: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """As in `MannStep`, in one sweep."""
        inputs = self.buffer(f"inputs {number}", len(x), x.shape[1] + 1, self.factors.dtype)
        slope = self.buffer(f"slope {number}", *x.shape)
        use_threads(x.numel())
        _prepare(x.numpy(), mask.numpy(), as_numpy(inputs), slope.numpy())
        return inputs, slope

    def blended(self, number: int, outputs: Tensor, c: Tensor) -> Tensor:
        """As in `MannStep`, in one sweep."""
        h = self.buffer(f"h {number}", len(c), outputs.shape[1] // c.shape[1])
        use_threads(outputs.numel())
        _blend(as_numpy(outputs), c.numpy(), h.numpy())
        return h

    def spread(self, number: int, d: Tensor, outputs: Tensor, c: Tensor, dc: Tensor) -> Tensor:
        """As in `MannStep`, in one sweep."""
        da = self.buffer(f"da {number}", len(c), outputs.shape[1], self.factors.dtype)
        use_threads(outputs.numel())
        _spread(d.numpy(), as_numpy(outputs), c.numpy(), as_numpy(da), dc.numpy())
        return da


@njit(parallel=True, error_model="numpy")
def _prepare(x: Any, mask: Any, inputs: Any, slope: Any) -> None:
    """Write inputs (B, n + 1) and slope (B, n) of x (B, n); see `MannStep.prepared`."""
    rows, width = x.shape
    half = inputs.itemsize == 2
    one = slope.dtype.type(1)
    for row in numba.prange(rows):
        for i in range(width):
            slope[row, i] = mask[row, i] * min(x[row, i] + one, one)
        if half:
            for i in range(width):
                inputs[row, i] = to_bfloat16(mask[row, i] * x[row, i])
            inputs[row, width] = to_bfloat16(one)
        else:
            for i in range(width):
                inputs[row, i] = mask[row, i] * x[row, i]
            inputs[row, width] = one


@njit(parallel=True, error_model="numpy")
def _blend(outputs: Any, c: Any, h: Any) -> None:
    """Write h (B, out): the sum over the experts of their outputs (B, K out) times their shares c (B, K)."""
    rows, width = h.shape
    half = outputs.itemsize == 2
    for row in numba.prange(rows):
        h[row] = 0
        for k in range(c.shape[1]):
            start, share = k * width, c[row, k]
            if half:
                for i in range(width):
                    h[row, i] += share * to_float32(outputs[row, start + i])
            else:
                for i in range(width):
                    h[row, i] += share * outputs[row, start + i]


# With `reassoc` the compiler can sum several terms at a time.
@njit(parallel=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _spread(d: Any, outputs: Any, c: Any, da: Any, dc: Any) -> None:
    """Write da (B, K out) from d (B, out), and add the layer's part to dc (B, K); see `MannStep.spread`."""
    rows, width = d.shape
    half = outputs.itemsize == 2
    for row in numba.prange(rows):
        for k in range(c.shape[1]):
            start, share, total = k * width, c[row, k], c.dtype.type(0)
            if half:
                for i in range(width):
                    total += d[row, i] * to_float32(outputs[row, start + i])
                    da[row, start + i] = to_bfloat16(share * d[row, i])
            else:
                for i in range(width):
                    total += d[row, i] * outputs[row, start + i]
                    da[row, start + i] = share * d[row, i]
            dc[row, k] += total
