"""Training steps of a blended stack: loss and gradient of one batch.

A batch has B rows. For each layer, x (B, in) are the inputs and a (B, out) the outputs. c (B, K) are the
shares of the K sets of weights. e (B, K (in + 1)) are the inputs with a 1 appended, times each of the K
shares. W (out, K (in + 1)) are weights and biases of all sets. da, dW, de, dx and dc are the gradients of the
loss by these arrays, de_k is the part of de for set k, with and without the column of the 1, and ' transposes
a matrix:

    a = e W'        dW = da' e        de = da W        dx = sum_k c_k de_k        dc_k = de_k . (x, 1)

Blending the weights for each sample would give the same result, because sum_k c_k (W_k x) = (sum_k c_k W_k)
x, but it would take several times the memory traffic.
"""

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import elu

from hobble.core.compiled import njit

# oneDNN's product of float32 matrices has 512-bit kernels for all processors. PyTorch's default, MKL, has
# them only for Intel's. For products with fewer multiplications and additions than this, calling it takes
# longer.
LARGE_PRODUCT = 8_000_000
HAS_ONEDNN = torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise")
NUMBERS_PER_THREAD = 100_000  # a thread gets at least this many numbers, about 20 microseconds of work
# The random number generator splitmix64 adds this to its state for each number that it draws.
SPLITMIX_STEP = np.uint64(0x9E3779B97F4A7C15)
ALL_ROWS = slice(None)


def product(a: Tensor, b: Tensor) -> Tensor:
    """a @ b.T for a (m, n) and b (k, n)."""
    large = 2 * a.shape[0] * a.shape[1] * b.shape[0] >= LARGE_PRODUCT
    if HAS_ONEDNN and large and a.device.type == "cpu" and a.dtype == torch.float32 and not b.requires_grad:
        return torch.ops.mkldnn._linear_pointwise(a, b, None, "none", [], "")
    return torch.mm(a, b.T)


def evaluate(
    network: Any,
    layers: list[Tensor],
    x: Tensor,
    p: Tensor,
    masks: list[Tensor] | None = None,
    half: bool = False,
) -> Tensor:
    """Standardised outputs (B, Y) of x (B, X) at phases p (B,), in PyTorch.

    network: a `TrainableBlend`. layers: its layers, or copies of them. masks: see `AutogradStep.masks`; None
    without dropout. half: round the factors of the products to bfloat16.
    """
    gates = network.gate_layers
    c = network.shares(layers[:gates], x, p, masks and masks[:gates])
    x = network.extended(x, p)
    for number, layer in enumerate(layers[gates:]):
        x = elu(x) if number else x
        x = x * masks[gates + number] if masks else x
        e, weights = (
            torch.cat([c[:, :, None] * x[:, None, :], c[:, :, None]], dim=2).flatten(1),
            layer.flatten(1),
        )
        x = product(e.bfloat16(), weights.bfloat16()).to(x.dtype) if half else product(e, weights)
    return x


class AutogradStep:
    """Computes the gradient of the mean squared error on one batch, on any device, by PyTorch.

    gradients: result of the last call, one gradient for each layer, with its numbers in the order of the
    layer's parameters. error: (B, Y) prediction minus y in the last call. input_mask: index of the mask for
    the network's inputs in the list that `masks` returns.

    network: a `TrainableBlend`. dropout: share of units dropped before each layer, inputs included. The other
    units are scaled up. half: round the factors of the products to bfloat16. Sums and everything else stay
    float32.
    """

    def __init__(self, network: Any, dropout: float, half: bool = False) -> None:
        self.network, self.keep, self.half = network, 1.0 - dropout, half
        self.generator = torch.Generator(network.flat.device)
        self.gradients: list[Tensor] = []
        self.error = torch.empty(0, network.outputs, device=network.flat.device)
        self.widths = [shape[2] - 1 for shape in network.shapes]  # number of inputs of each layer
        self.input_mask = network.gate_layers

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` and `error`, and return the mean squared error.

        x: (B, X). y: (B, Y). p: (B,) phases. masks: the dropout masks of this batch, from the method `masks`.
        """
        layers = [layer.detach().requires_grad_() for layer in self.network.layers]
        with torch.enable_grad():
            error = evaluate(self.network, layers, x, p, masks, self.half) - y
            loss = torch.mean(torch.square(error))
        self.gradients = list(torch.autograd.grad(loss, layers))
        self.error = error.detach()
        return loss.detach()

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return the part for the rows `own`.

        If several processes share a batch, each draws the same masks and gets the part for its own rows. The
        result is a mask (own rows, in) for each layer, the gate's first. It is 0 where an input is dropped,
        else 1 / keep. Inputs that are not columns of X are never dropped.
        """
        flat = self.network.flat
        drawn = torch.rand(rows, sum(self.widths), generator=self.generator, device=flat.device)[own]
        masks = (drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(self.widths, dim=1)
        return self._keep_extra_inputs(list(masks))

    def _keep_extra_inputs(self, masks: list[Tensor]) -> list[Tensor]:
        masks[self.input_mask][:, self.network.inputs :] = 1
        return masks


class FusedStep(AutogradStep):
    """The step on a CPU. One compiled loop does the work of several of PyTorch's operations.

    At batch 32 of `holden` it takes .54 of the time of `AutogradStep`.
    """

    counter = np.uint64(0)  # state of the random number generator for the masks

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """As in `AutogradStep`."""
        network, gates = self.network, self.network.gate_layers
        gate = [layer.detach().requires_grad_() for layer in network.layers[:gates]]
        with torch.enable_grad():
            shares = network.shares(gate, x, p, masks[:gates])
        c, masks = shares.detach(), masks[gates:]
        weights = [self._factor(layer.flatten(1)) for layer in network.layers[gates:]]
        inputs, expanded, slopes = [], [], []
        x = network.extended(x, p)
        for number, (weight, mask) in enumerate(zip(weights, masks, strict=True)):
            inputs.append(elu(x) if number else x)
            e, slope = _expand(inputs[-1], c, mask)
            expanded.append(self._factor(e))
            slopes.append(slope)
            if gates and not number:
                # The outputs of each set, of which dc is made below. By de it would take one more product.
                h = self._factor(_expand(x, torch.ones_like(c[:, :1]), mask)[0])
                each = self._product(h, weight.view(-1, h.shape[1])).view(len(x), -1, c.shape[1])
                x = torch.bmm(each, c[:, :, None])[:, :, 0]
            else:
                x = self._product(expanded[-1], weight)
        self.error = x.sub_(y)
        d = self.error * (2.0 / y.numel())  # gradient of the mean square by the prediction
        dc = torch.zeros_like(c)
        gradients = []
        for number in range(len(weights) - 1, -1, -1):
            factor = self._factor(d)
            gradients.append(self._product(factor.T, expanded[number].T))
            if number:
                de = self._product(factor, weights[number].T)
                d = _contract(de, c, slopes[number])
            if number and gates:
                _add_gradient_by_shares(de.numpy(), inputs[number].numpy(), masks[number].numpy(), dc.numpy())
            elif gates:
                dc += torch.bmm(d[:, None], each)[:, 0]
        of_gate = torch.autograd.grad(shares, gate, dc) if gates else ()
        self.gradients = [*of_gate, *reversed(gradients)]
        return torch.mean(torch.square(self.error))

    def _factor(self, a: Tensor) -> Tensor:
        """A matrix as a factor of a product."""
        return a.bfloat16() if self.half else a

    def _product(self, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T for factors a (m, n) and b (k, n), in the type of the parameters."""
        return product(a, b).to(self.network.flat.dtype)

    def seed(self, seed: int) -> None:
        """As in `AutogradStep`."""
        self.counter = np.uint64(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """As in `AutogradStep`, with other random numbers. Those of rows that are not `own` are skipped."""
        first, stop, _ = own.indices(rows)
        masks = []
        for width in self.widths:
            masks.append(torch.empty(stop - first, width, dtype=self.network.flat.dtype))
            use_threads(masks[-1].numel())
            _draw_mask(masks[-1].numpy(), _counter_after(self.counter, first * width), self.keep)
            self.counter = _counter_after(self.counter, rows * width)
        return self._keep_extra_inputs(masks)


def use_threads(values: int) -> None:
    """Set how many threads the next compiled loop over `values` numbers uses.

    A short loop uses fewer threads than PyTorch, because waking threads takes time.
    """
    threads = min(torch.get_num_threads(), numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    numba.set_num_threads(max(1, min(threads, values // NUMBERS_PER_THREAD)))


def _expand(x: Tensor, c: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
    """e (B, K (n + 1)) of inputs x (B, n) times the mask, and slopes (B, n).

    A slope is the mask times the derivative of the ELU that gave x. The derivative is x + 1 where x is below
    0, else 1. In the first layer x comes from no ELU, and the slopes are not used.
    """
    e, slope = x.new_empty(len(x), c.shape[1] * (x.shape[1] + 1)), torch.empty_like(x)
    use_threads(e.numel())
    _write_expanded(x.numpy(), c.numpy(), mask.numpy(), e.numpy(), slope.numpy())
    return e, slope


def _contract(de: Tensor, c: Tensor, slope: Tensor) -> Tensor:
    """The gradient (B, n) by the outputs of the previous layer, before their ELU.

    de: (B, K (n + 1)). c: (B, K). slope: (B, n) from `_expand`.
    """
    d = torch.empty_like(slope)
    use_threads(de.numel())
    _write_contracted(de.numpy(), c.numpy(), slope.numpy(), d.numpy())
    return d


@njit(parallel=True, error_model="numpy")
def _write_expanded(x: Any, c: Any, mask: Any, e: Any, slope: Any) -> None:
    """Write e and slope; see `_expand`."""
    rows, width = x.shape
    one = slope.dtype.type(1)  # with a Python 1, numba would compute in float64
    for row in numba.prange(rows):
        for i in range(width):
            slope[row, i] = mask[row, i] * min(x[row, i] + one, one)
        for k in range(c.shape[1]):
            start, share = k * (width + 1), c[row, k]
            for i in range(width):
                e[row, start + i] = share * mask[row, i] * x[row, i]
            e[row, start + width] = share


@njit(parallel=True, error_model="numpy")
def _write_contracted(de: Any, c: Any, slope: Any, d: Any) -> None:
    """Write d; see `_contract`."""
    rows, width = d.shape
    for row in numba.prange(rows):
        d[row] = 0
        for k in range(c.shape[1]):
            start, share = k * (width + 1), c[row, k]
            for i in range(width):
                d[row, i] += share * de[row, start + i]
        for i in range(width):
            d[row, i] *= slope[row, i]


# `reassoc` lets the compiler change the order of a sum, so that it can add several terms at a time.
@njit(parallel=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _add_gradient_by_shares(de: Any, x: Any, mask: Any, dc: Any) -> None:
    """Add a layer's part of the gradient by the shares to dc (B, K). x, mask: (B, n) the inputs, masked."""
    rows, width = x.shape
    for row in numba.prange(rows):
        for k in range(dc.shape[1]):
            start = k * (width + 1)
            total = de[row, start + width]
            for i in range(width):
                total += de[row, start + i] * mask[row, i] * x[row, i]
            dc[row, k] += total


@njit(parallel=True, error_model="numpy")
def _draw_mask(mask: Any, counter: Any, keep: Any) -> None:
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


def _counter_after(counter: np.uint64, numbers: int) -> np.uint64:
    """The state of splitmix64 after `numbers` more numbers. counter: the state before these numbers."""
    return np.uint64((int(counter) + numbers * int(SPLITMIX_STEP)) % 2**64)
