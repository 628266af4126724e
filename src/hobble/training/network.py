"""The phase-functioned network: its parameters, the spline over them, and what it computes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from hobble.training.products import product


@dataclass(frozen=True)
class Network:
    """Layers of `sizes` units whose weights and biases are cyclic cubic splines of the phase.

    sizes: units from the input to the output, such as (342, 512, 512, 311). control_points: K knots of the
    spline, equally spaced over a cycle. flat: every parameter in one buffer, layer by layer (out, K, in + 1),
    the last column being the bias. So the
        optimiser is one sweep, and a layer one product with inputs expanded by a 1 and by the phase.
    """

    sizes: tuple[int, ...]
    control_points: int
    flat: Tensor

    @cached_property
    def layers(self) -> list[Tensor]:
        """(out, K, in + 1) views of `flat`, one for each layer."""
        return self.views(self.flat)

    def views(self, flat: Tensor) -> list[Tensor]:
        """The layers of a buffer laid out like `self.flat`: of a gradient, of a moment."""
        views, start = [], 0
        for size, out in pairwise(self.sizes):
            shape = (out, self.control_points, size + 1)
            views.append(flat[start : start + out * shape[1] * shape[2]].view(shape))
            start += views[-1].numel()
        return views

    def to(self, device: torch.device | str, dtype: torch.dtype | None = None) -> Network:
        """A copy elsewhere, or in another type."""
        return Network(self.sizes, self.control_points, self.flat.to(device, dtype, copy=True))

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,), without dropout."""
        c = coefficients(p, self.control_points)
        for number, layer in enumerate(self.layers):
            if number:
                x = torch.nn.functional.elu(x)
            x = product(expand(x, c), layer.flatten(1))
        return x


def parameters(sizes: tuple[int, ...], control_points: int) -> int:
    """How many numbers a network is: the length of `Network.flat`."""
    return control_points * sum((size + 1) * out for size, out in pairwise(sizes))


def initialise(sizes: tuple[int, ...], control_points: int, seed: int) -> Network:
    """Weights uniform within +-sqrt(6 / (in * out)), biases 0 (Holden et al. 2017, as released)."""
    generator = np.random.default_rng([seed, 0])
    network = Network(tuple(sizes), control_points, torch.zeros(parameters(sizes, control_points)))
    for layer in network.layers:
        out, k, size = layer.shape
        bound = (6.0 / ((size - 1) * out)) ** 0.5
        layer[:, :, :-1] = torch.from_numpy(generator.uniform(-bound, bound, (out, k, size - 1)))
    return network


def coefficients(p: Tensor, control_points: int) -> Tensor:
    """(B, K) weights of the control points at phases (B,): the cyclic cubic Catmull-Rom spline.

    They sum to 1; at p = k / K they single out control point k.
    """
    position = torch.remainder(p, 1.0) * control_points
    knot = torch.floor(position)
    t = (position - knot)[:, None]
    index = knot.long()[:, None] + torch.arange(-1, 3, device=p.device)
    cubic = torch.cat(
        [
            ((2 - t) * t - 1) * t / 2,
            ((3 * t - 5) * t * t + 2) / 2,
            ((4 - 3 * t) * t + 1) * t / 2,
            (t - 1) * t * t / 2,
        ],
        dim=1,
    )
    knots = torch.arange(control_points, device=p.device)
    picked = torch.remainder(index, control_points)[:, :, None] == knots
    return torch.sum(cubic[:, :, None] * picked, dim=1)


def expand(x: Tensor, c: Tensor) -> Tensor:
    """(B, K (n + 1)): each row of x (B, n), with a 1 behind it, times each of its coefficients (B, K)."""
    return torch.cat([c[:, :, None] * x[:, None, :], c[:, :, None]], dim=2).flatten(1)
