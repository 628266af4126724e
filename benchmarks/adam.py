"""Hobble's Adam, which adds the L1 term in the same loop, against PyTorch's fused Adam and a sign.

    python benchmarks/adam.py [--batches 32,256] [--threads 1] [--sizes 342,512,512,311]

Both take turns, and the fastest call of each counts, because other work disturbs some calls. The last column
says by how much a whole training step would take longer with PyTorch's.
"""

import argparse
from collections.abc import Callable, Mapping
from time import perf_counter, thread_time

import hobble.training  # noqa: F401 - first, since it says how threads wait

# isort: split
import torch
from training import fresh

from hobble.core.processors import multiplies_bfloat16, processor_name
from hobble.models.step import FusedStep
from hobble.training.checkpoint import use_threads
from hobble.training.optimiser import Adam, l1_slopes

KEEP, L1, RATE, BETAS = 0.97, 0.01, 1e-4, (0.9, 0.999)


SECONDS = 1.0  # for all calls that are compared


def least(calls: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Seconds of the fastest call of each; of the processor if there is one thread."""
    clock = thread_time if torch.get_num_threads() == 1 else perf_counter
    best = dict.fromkeys(calls, float("inf"))
    begun, turns = perf_counter(), 0
    while perf_counter() - begun < SECONDS or turns < 8:
        turns += 1
        for name, call in calls.items():
            before = clock()
            call()
            best[name] = min(best[name], clock() - before)
    return best


class Fused:
    """PyTorch's fused Adam on the layers of a network, after the gradient of the L1 term was added."""

    def __init__(self, network: torch.nn.Module) -> None:
        self.layers = [layer.detach().clone() for layer in network.layers]
        self.slopes = l1_slopes(network, L1)
        self.adam = torch.optim.Adam(self.layers, RATE, BETAS, fused=True)

    def step(self, gradients: list[torch.Tensor]) -> None:
        """Take one step. gradients: as in `hobble.training.optimiser.Adam`; the L1 term is added to them."""
        for layer, gradient, slope in zip(self.layers, gradients, self.slopes, strict=True):
            layer.grad = gradient.view(layer.shape)
            layer.grad[:, :, :-1].add_(torch.sign(layer[:, :, :-1]), alpha=slope)
        self.adam.step()


def compare(rows: int, sizes: tuple[int, ...], half: bool) -> None:
    """Check that both move the weights alike, then print a row for each optimiser."""
    network = fresh(sizes)
    step, other = FusedStep(network, 1 - KEEP, half), Fused(network)
    ours = Adam(network, RATE, *BETAS, L1)
    batch = torch.randn(rows, sizes[0]), torch.randn(rows, sizes[-1]), torch.rand(rows)
    masks = step.masks(rows)
    step(*batch, masks)
    before = network.flat.clone()
    for _ in range(3):
        ours.step(step.gradients)
        other.step([gradient.clone() for gradient in step.gradients])
    moved = (network.flat - before).abs().max()
    off = max((a - b).abs().max() for a, b in zip(network.layers, other.layers, strict=True))
    assert off < 1e-2 * moved, f"they differ by {off / moved:.3g} of the largest movement"
    calls = {
        "step": lambda: step(*batch, masks),
        "ours": lambda: ours.step(step.gradients),
        "PyTorch": lambda: other.step(step.gradients),
    }
    best = least(calls)
    own, torchs, rest = (best[name] for name in ("ours", "PyTorch", "step"))
    print(
        f"{rows:5} {'bfloat16' if half else 'float32':9} {1e3 * own:9.2f} {1e3 * torchs:9.2f}"
        f" {torchs / own:7.2f} {1e3 * rest:9.2f} {(rest + torchs) / (rest + own):9.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--batches", default="32,256")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--sizes", default="342,512,512,311")
    options = parser.parse_args()
    use_threads(options.threads)
    torch.manual_seed(1)
    sizes = tuple(int(size) for size in options.sizes.split(","))
    print(f"{processor_name()}, {options.threads} threads, {options.sizes}; milliseconds")
    print("batch factors        ours   PyTorch   ratio  the step  whole step")
    for rows in map(int, options.batches.split(",")):
        compare(rows, sizes, False)
        if multiplies_bfloat16():
            compare(rows, sizes, True)


if __name__ == "__main__":
    main()
