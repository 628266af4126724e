"""Training steps a second, with Adam, dropout and the L1 term, for several implementations in one run.

    python benchmarks/training.py [--batches 32,256,1024] [--threads 2] [--turns 7] [--sizes 342,512,512,311]

All of them run in each turn, and the best turn of each counts, because other work disturbs some turns. The
floor is the time of the matrix products alone, at their best, with the same factors.

- per sample: weights built for every sample, differentiated by autograd, PyTorch's Adam (sixty-four samples
  at a time, since 1,024 need 5 GB);
- blended: outputs of the control points blended, otherwise the same: the usual good implementation;
- PyTorch, float32: `hobble.models.step.AutogradStep`, as on other devices than a CPU;
- fused, float32: `hobble.models.step.FusedStep`, the default below batch 256;
- fused, bfloat16: the same with factors rounded to bfloat16, the default from there on.

There is no benchmark for GPUs.
"""

import argparse
import time
from collections.abc import Callable
from itertools import pairwise

import hobble.training  # noqa: F401 - first, since it says how threads wait

# isort: split
import torch
from torch import Tensor

from hobble.core.processors import multiplies_bfloat16, processor_name
from hobble.models.forward import phase_shares
from hobble.models.pfnn import PfnnOptions, TrainablePfnn
from hobble.models.step import AutogradStep, FusedStep, product
from hobble.training.checkpoint import use_threads
from hobble.training.optimiser import Adam

KEEP, L1, RATE, POINTS = 0.7, 0.01, 1e-4, 4
PART = 64
Batch = tuple[Tensor, Tensor, Tensor]


def fresh(sizes: tuple[int, ...]) -> TrainablePfnn:
    """An untrained network of `sizes`."""
    count = POINTS * sum((size + 1) * out for size, out in pairwise(sizes))
    return PfnnOptions(control_points=POINTS).trainable(torch.zeros(count), sizes, ()).randomise(1)


def dropped(x: Tensor) -> Tensor:
    return x * (torch.rand_like(x) < KEEP) / KEEP


def per_sample(layers: list[Tensor], x: Tensor, c: Tensor) -> Tensor:
    for number, layer in enumerate(layers):
        blended = torch.einsum("bk,oki->boi", c, layer)
        x = torch.baddbmm(blended[:, :, -1:], blended[:, :, :-1], dropped(x)[:, :, None])[:, :, 0]
        x = torch.nn.functional.elu(x) if number < len(layers) - 1 else x
    return x


def blended(layers: list[Tensor], x: Tensor, c: Tensor) -> Tensor:
    for number, layer in enumerate(layers):
        each = torch.einsum("bi,oki->bko", dropped(x), layer[:, :, :-1]) + layer[:, :, -1].T
        x = torch.einsum("bk,bko->bo", c, each)
        x = torch.nn.functional.elu(x) if number < len(layers) - 1 else x
    return x


def by_autograd(forward: Callable, part: int, sizes: tuple[int, ...]) -> Callable[[Batch], None]:
    layers = [layer.clone().requires_grad_() for layer in fresh(sizes).layers]
    adam = torch.optim.Adam(layers, lr=RATE)

    def step(batch: Batch) -> None:
        adam.zero_grad()
        for start in range(0, len(batch[0]), part):
            x, y, p = (array[start : start + part] for array in batch)
            error = (
                torch.sum((forward(layers, x, phase_shares(p, torch.arange(POINTS))) - y) ** 2)
                / batch[1].numel()
            )
            error.backward()
        (L1 / (2 * len(layers)) * sum(layer[:, :, :-1].abs().mean() for layer in layers)).backward()
        adam.step()

    return step


def by_hand(kind: type[AutogradStep], half: bool, sizes: tuple[int, ...]) -> Callable[[Batch], None]:
    network = fresh(sizes)
    adam, step = Adam(network, RATE, 0.9, 0.999, L1), kind(network, 1 - KEEP, half)

    def go(batch: Batch) -> None:
        step(*batch, step.masks(len(batch[0])))
        adam.step(step.gradients)

    return go


def products(
    half: bool, sizes: tuple[int, ...], device: torch.device | str = "cpu"
) -> Callable[[Batch], None]:
    """Only a step's matrix products: outputs, gradients of weights, and of all inputs but the first."""
    dtype = torch.bfloat16 if half else torch.float32
    like = {"dtype": dtype, "device": device}
    weights = [torch.randn(out, POINTS * (size + 1), **like) for size, out in pairwise(sizes)]
    inputs: dict[int, list[tuple[Tensor, Tensor]]] = {}

    def go(batch: Batch) -> None:
        rows = len(batch[0])
        if rows not in inputs:
            shapes = [weight.shape for weight in weights]
            inputs[rows] = [(torch.randn(rows, i, **like), torch.randn(rows, o, **like)) for o, i in shapes]
        for number, ((e, d), weight) in enumerate(zip(inputs[rows], weights, strict=True)):
            product(e, weight)
            product(d.T, e.T)
            if number:
                product(d, weight.T)

    return go


def seconds(work: Callable[[Batch], None], batch: Batch) -> float:
    """Of one call, over at least a tenth of a second."""
    calls, start = 0, time.perf_counter()
    while (spent := time.perf_counter() - start) < 0.1 or not calls:
        work(batch)
        calls += 1
    return spent / calls


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--batches", default="32,256,1024")
    parser.add_argument("--sizes", default="342,512,512,311")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--turns", type=int, default=7)
    options = parser.parse_args()
    print(processor_name())
    use_threads(options.threads)
    torch.manual_seed(1)
    sizes = tuple(int(size) for size in options.sizes.split(","))
    ways = {
        "per sample": by_autograd(per_sample, PART, sizes),
        "blended": by_autograd(blended, 1 << 30, sizes),
        "PyTorch, float32": by_hand(AutogradStep, False, sizes),
        "fused, float32": by_hand(FusedStep, False, sizes),
        "floor, float32": products(False, sizes),
    }
    if multiplies_bfloat16():
        ways["fused, bfloat16"] = by_hand(FusedStep, True, sizes)
        ways["floor, bfloat16"] = products(True, sizes)
    inputs = sum(size * out for size, out in pairwise(sizes[:2]))
    all_layers = sum(size * out for size, out in pairwise(sizes))
    flop = 2 * POINTS * (3 * all_layers - inputs)
    print(
        f"{'-'.join(map(str, sizes))}, {options.threads} threads, {flop / 1e6:.1f} MFLOP of products a sample"
    )
    for rows in map(int, options.batches.split(",")):
        batch = (torch.randn(rows, sizes[0]), torch.randn(rows, sizes[-1]), torch.rand(rows))
        best = dict.fromkeys(ways, float("inf"))
        for turn in range(options.turns + 1):
            for name, work in ways.items():
                if name == "per sample" and turn > 2:
                    continue
                spent = seconds(work, batch)
                best[name] = min(best[name], spent) if turn else best[name]
        print(f"\nbatch {rows:16} samples/s    ms a step   x per sample   x blended   GFLOP/s")
        for name, spent in best.items():
            ratios = f"{best['per sample'] / spent:11.1f} {best['blended'] / spent:13.1f}"
            speed = f"{rows / spent:11,.0f} {spent * 1e3:12.2f}"
            print(f"{name:20} {speed} {ratios} {flop * rows / spent / 1e9:9.0f}")


if __name__ == "__main__":
    main()
