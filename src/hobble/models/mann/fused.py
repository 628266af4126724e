"""The training step on a CPU: what `step` does before and after the matrix products, in compiled loops.

`hobble.models.mann.step` explains the letters c, da, dc and dblend. B is the number of rows of a batch.
"""

from __future__ import annotations

from typing import Any

import numba
from torch import Tensor

from hobble.core.compiled import njit
from hobble.models.fused_base import FusedBase
from hobble.models.kernels import as_numpy, to_bfloat16, to_float32, use_threads
from hobble.models.mann.step import MannStep


class FusedMannStep(FusedBase, MannStep):
    """Like `MannStep`, but several times faster outside the matrix products.

    The tensors that its methods return are buffers, which the next batch overwrites.
    """

    def prepare_inputs(self, number: int, x: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """As in `MannStep`, in one compiled loop."""
        inputs = self.buffer(f"inputs {number}", len(x), x.shape[1] + 1, self.factors.dtype)
        slope = self.buffer(f"slope {number}", *x.shape)
        use_threads(x.numel())
        _prepare_inputs(x.numpy(), mask.numpy(), as_numpy(inputs), slope.numpy())
        return inputs, slope

    def blend_experts(self, number: int, outputs: Tensor, c: Tensor) -> Tensor:
        """As in `MannStep`, in one compiled loop."""
        blend = self.buffer(f"blend {number}", len(c), outputs.shape[1] // c.shape[1])
        use_threads(outputs.numel())
        _blend_experts(as_numpy(outputs), c.numpy(), blend.numpy())
        return blend

    def gradient_by_experts(
        self, number: int, dblend: Tensor, outputs: Tensor, c: Tensor, dc: Tensor
    ) -> Tensor:
        """As in `MannStep`, in one compiled loop."""
        da = self.buffer(f"da {number}", len(c), outputs.shape[1], self.factors.dtype)
        use_threads(outputs.numel())
        _gradient_by_experts(dblend.numpy(), as_numpy(outputs), c.numpy(), as_numpy(da), dc.numpy())
        return da


@njit(parallel=True, error_model="numpy")
def _prepare_inputs(x: Any, mask: Any, inputs: Any, slope: Any) -> None:
    """Write inputs (B, n + 1) and slope (B, n), from x (B, n) and mask (B, n).

    See `MannStep.prepare_inputs`.
    """
    rows, width = x.shape
    is_bfloat16 = inputs.itemsize == 2
    one = slope.dtype.type(1)
    for row in numba.prange(rows):
        for i in range(width):
            slope[row, i] = mask[row, i] * min(x[row, i] + one, one)
        if is_bfloat16:
            for i in range(width):
                inputs[row, i] = to_bfloat16(mask[row, i] * x[row, i])
            inputs[row, width] = to_bfloat16(one)
        else:
            for i in range(width):
                inputs[row, i] = mask[row, i] * x[row, i]
            inputs[row, width] = one


@njit(parallel=True, error_model="numpy")
def _blend_experts(outputs: Any, c: Any, blend: Any) -> None:
    """Write blend (B, out), the sum over the experts of outputs (B, K out) times shares c (B, K)."""
    rows, width = blend.shape
    is_bfloat16 = outputs.itemsize == 2
    for row in numba.prange(rows):
        blend[row] = 0
        for k in range(c.shape[1]):
            start, share = k * width, c[row, k]
            if is_bfloat16:
                for i in range(width):
                    blend[row, i] += share * to_float32(outputs[row, start + i])
            else:
                for i in range(width):
                    blend[row, i] += share * outputs[row, start + i]


# `reassoc` lets the compiler change the order of a sum, so that it can add several terms at a time.
@njit(parallel=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _gradient_by_experts(dblend: Any, outputs: Any, c: Any, da: Any, dc: Any) -> None:
    """Write da (B, K out) from dblend (B, out), and add the layer's part to dc (B, K).

    See `MannStep.gradient_by_experts`.
    """
    rows, width = dblend.shape
    is_bfloat16 = outputs.itemsize == 2
    for row in numba.prange(rows):
        for k in range(c.shape[1]):
            start, share, total = k * width, c[row, k], c.dtype.type(0)
            if is_bfloat16:
                for i in range(width):
                    total += dblend[row, i] * to_float32(outputs[row, start + i])
                    da[row, start + i] = to_bfloat16(share * dblend[row, i])
            else:
                for i in range(width):
                    total += dblend[row, i] * outputs[row, start + i]
                    da[row, start + i] = share * dblend[row, i]
            dc[row, k] += total
