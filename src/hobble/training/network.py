"""The phase-functioned network: its parameters, the spline over them, and what it computes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import prod

import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class Network:
    """Layers of `sizes` units whose weights are cyclic cubic splines of the phase.

    sizes: units from the input to the output, such as (342, 512, 512, 311).
    control_points: K knots of the spline, equally spaced over a cycle.
    flat: every parameter in one buffer: the weights of each layer (K, in, out), then the biases (K, out). One
        buffer, so that the optimiser is one sweep; inputs first, so that a layer is one product over
        phase-expanded inputs, (B, K in) x (K in, out).
    """

    sizes: tuple[int, ...]
    control_points: int
    flat: Tensor

    @cached_property
    def weights(self) -> list[Tensor]:
        """(K, in, out) views of `flat`, one for each layer."""
        return self.views(self.flat)[0]

    @cached_property
    def biases(self) -> list[Tensor]:
        """(K, out) views of `flat`, one for each layer."""
        return self.views(self.flat)[1]

    def views(self, flat: Tensor) -> tuple[list[Tensor], list[Tensor]]:
        """Weights and biases as views of a buffer laid out like `self.flat`: a gradient, a moment."""
        shapes = shapes_of(self.sizes, self.control_points)
        parts = torch.split(flat, [prod(s) for s in shapes])
        views = [part.view(shape) for part, shape in zip(parts, shapes, strict=True)]
        layers = len(self.sizes) - 1
        return views[:layers], views[layers:]

    def to(self, device: torch.device, dtype: torch.dtype | None = None) -> Network:
        """The same network elsewhere, or in another type."""
        return Network(self.sizes, self.control_points, self.flat.to(device, dtype, copy=True))

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,), without dropout."""
        c = coefficients(p, self.control_points)
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if layer:
                x = torch.nn.functional.elu(x)
            x = torch.addmm(c @ bias, expand(x, c), weight.flatten(0, 1))
        return x


def shapes_of(sizes: tuple[int, ...], control_points: int) -> list[tuple[int, ...]]:
    """Shapes of the parameters in the order of `Network.flat`."""
    pairs = list(pairwise(sizes))
    return [(control_points, a, b) for a, b in pairs] + [(control_points, b) for _, b in pairs]


def initialise(sizes: tuple[int, ...], control_points: int, seed: int) -> Network:
    """Weights uniform within +-sqrt(6 / (in * out)), biases 0 (Holden et al. 2017, as released)."""
    generator = np.random.default_rng([seed, 0])
    parts = []
    for shape in shapes_of(sizes, control_points):
        bound = np.sqrt(6.0 / (shape[1] * shape[2])) if len(shape) == 3 else 0.0
        parts.append(generator.uniform(-bound, bound, prod(shape)).astype(np.float32))
    return Network(tuple(sizes), control_points, torch.from_numpy(np.concatenate(parts)))


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
    out = torch.zeros(len(p), control_points, dtype=p.dtype, device=p.device)
    return out.scatter_(1, torch.remainder(index, control_points), cubic)


def expand(x: Tensor, c: Tensor) -> Tensor:
    """(B, K n): each row of x (B, n) times each of its coefficients (B, K)."""
    return (c[:, :, None] * x[:, None, :]).flatten(1)
