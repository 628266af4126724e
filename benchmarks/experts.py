"""Training steps a second of the mode-adaptive network, and a prediction of each controller, in one run.

    python benchmarks/experts.py [--batches 32,256] [--threads 2] [--turns 5] [--sizes 342,512,512,311]

As in `training.py`, all variants run in each turn, and the best turn of each counts.

- per sample: the experts' weights blended for every sample, by autograd, PyTorch's Adam;
- blended: outputs of all experts blended, by autograd: the usual good implementation;
- PyTorch, float32: `hobble.models.mann.step.MannStep`, as on other devices than a CPU;
- fused: `hobble.models.mann.fused.FusedMannStep`, with float32 and with bfloat16 factors;
- products: only the experts' matrix products of a step, with the same factors.

Predictions are of random networks of one size on one core: median microseconds, the controllers in turns, the
phase-functioned network in its cubic mode.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from itertools import pairwise
from statistics import median
from time import perf_counter

import hobble.training  # noqa: F401 - first, since it says how threads wait

# isort: split
import numpy as np
import torch
from runtime import SKELETON, load_skeleton
from torch import Tensor
from training import L1, PART, RATE, Batch, seconds

from hobble.core.processors import multiplies_bfloat16, processor_name
from hobble.models import model_of_kind
from hobble.models.load import network_from_arrays
from hobble.models.mann.forward import GATE_INPUTS
from hobble.models.mann.fused import FusedMannStep
from hobble.models.mann.step import MannStep
from hobble.models.mann.trainable import untrained_network, with_one
from hobble.models.products import product
from hobble.rows.layout import RowLayout
from hobble.training.checkpoint import use_threads
from hobble.training.optimiser import Adam

KEEP, EXPERTS = 0.97, 8
CALLS = 200


def dropped(x: Tensor) -> Tensor:
    return x * (torch.rand_like(x) < KEEP) / KEEP


def fresh(sizes: tuple[int, ...]):
    """A network of `sizes` with a gate of the published size, on the first columns."""
    return untrained_network(sizes, (GATE_INPUTS, 32, 32, EXPERTS), tuple(range(GATE_INPUTS)), 1)


def shares(gate: list[Tensor], x: Tensor) -> Tensor:
    h = x[:, :GATE_INPUTS]
    for number, layer in enumerate(gate):
        h = torch.nn.functional.elu(h) if number else h
        h = with_one(dropped(h)) @ layer.flatten(1).T
    return torch.softmax(h, dim=1)


def per_sample(experts: list[Tensor], x: Tensor, c: Tensor) -> Tensor:
    for number, layer in enumerate(experts):
        x = torch.nn.functional.elu(x) if number else x
        blended = torch.einsum("bk,koi->boi", c, layer.view(EXPERTS, -1, layer.shape[-1]))
        x = torch.baddbmm(blended[:, :, -1:], blended[:, :, :-1], dropped(x)[:, :, None])[:, :, 0]
    return x


def blended(experts: list[Tensor], x: Tensor, c: Tensor) -> Tensor:
    for number, layer in enumerate(experts):
        x = torch.nn.functional.elu(x) if number else x
        each = torch.mm(with_one(dropped(x)), layer.flatten(1).T).view(len(x), EXPERTS, -1)
        x = torch.einsum("bk,bko->bo", c, each)
    return x


def by_autograd(forward: Callable, part: int, sizes: tuple[int, ...]) -> Callable[[Batch], None]:
    layers = [layer.clone().requires_grad_() for layer in fresh(sizes).layers]
    adam = torch.optim.Adam(layers, lr=RATE)

    def step(batch: Batch) -> None:
        adam.zero_grad()
        for start in range(0, len(batch[0]), part):
            x, y, _ = (array[start : start + part] for array in batch)
            y_of_x = forward(layers[3:], x, shares(layers[:3], x))
            (torch.sum((y_of_x - y) ** 2) / batch[1].numel()).backward()
        (L1 / (2 * len(layers)) * sum(layer[:, :, :-1].abs().mean() for layer in layers)).backward()
        adam.step()

    return step


def by_hand(kind: type[MannStep], half: bool, sizes: tuple[int, ...], moves: bool = True) -> Callable:
    network = fresh(sizes)
    adam, step = Adam(network, RATE, 0.9, 0.999, L1), kind(network, 1 - KEEP, half)

    def go(batch: Batch) -> None:
        step(*batch, step.masks(len(batch[0])))
        if moves:
            adam.step(step.gradients)

    return go


def products(half: bool, sizes: tuple[int, ...]) -> Callable[[Batch], None]:
    """Only a step's matrix products: outputs, gradients of weights, and of all inputs but the first."""
    dtype = torch.bfloat16 if half else torch.float32
    weights = [torch.randn(EXPERTS * out, size + 1, dtype=dtype) for size, out in pairwise(sizes)]
    inputs: dict[int, list[tuple[Tensor, Tensor]]] = {}

    def go(batch: Batch) -> None:
        rows = len(batch[0])
        if rows not in inputs:
            inputs[rows] = [
                (torch.randn(rows, w.shape[1], dtype=dtype), torch.randn(rows, w.shape[0], dtype=dtype))
                for w in weights
            ]
        for number, ((h, d), weight) in enumerate(zip(inputs[rows], weights, strict=True)):
            product(h, weight)
            product(d.T, h.T)
            if number:
                product(d, weight.T)

    return go


def steps(batches: list[int], sizes: tuple[int, ...], turns: int) -> None:
    """Print the table of each batch."""
    ways = {
        "per sample": by_autograd(per_sample, PART, sizes),
        "blended": by_autograd(blended, 1 << 30, sizes),
        "PyTorch, float32": by_hand(MannStep, False, sizes),
        "fused, float32": by_hand(FusedMannStep, False, sizes),
        "  without Adam": by_hand(FusedMannStep, False, sizes, moves=False),
        "products, float32": products(False, sizes),
    }
    if multiplies_bfloat16():
        ways["fused, bfloat16"] = by_hand(FusedMannStep, True, sizes)
        ways["  without Adam, bf16"] = by_hand(FusedMannStep, True, sizes, moves=False)
        ways["products, bfloat16"] = products(True, sizes)
    for rows in batches:
        batch = (torch.randn(rows, sizes[0]), torch.randn(rows, sizes[-1]), torch.rand(rows))
        best = dict.fromkeys(ways, float("inf"))
        for turn in range(turns + 1):
            for name, work in ways.items():
                if name == "per sample" and turn > 2:
                    continue
                spent = seconds(work, batch)
                best[name] = min(best[name], spent) if turn else best[name]
        print(f"\nbatch {rows:16} samples/s    ms a step   x per sample  of the products' speed")
        for name, spent in best.items():
            floor = best["products, bfloat16" if "bf" in name else "products, float32"]
            speed = f"{rows / spent:11,.0f} {spent * 1e3:12.2f}"
            print(f"{name:20} {speed} {best['per sample'] / spent:14.1f} {floor / spent:23.2f}")


def predictions() -> None:
    """Print the microseconds of a prediction of each kind."""
    skeleton = load_skeleton(SKELETON)
    layout = RowLayout(len(skeleton.joints))
    rng = np.random.default_rng(1)
    predictors = {}
    for kind in ("pfnn", "plain", "mann"):
        options = model_of_kind(kind).options_class()()
        trainable = model_of_kind(kind).untrained_network(options, layout, skeleton, 1)
        arrays = dict(trainable.arrays())
        for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
            arrays |= {f"{name}mean": np.zeros(size, np.float32), f"{name}std": np.ones(size, np.float32)}
        meta = {
            "kind": kind,
            "layout": layout.to_dict(),
            "skeleton": skeleton.to_dict(),
            **trainable.file_metadata,
        }
        network = network_from_arrays(kind, arrays | {"meta": np.array(json.dumps(meta))})
        for storage in ("float32", "int16"):
            predictors[kind, storage] = network.predictor(storage=storage)
    print(f"\n{'prediction':20} {'1':>10} {'x pfnn':>8} {'200':>10} {'x pfnn':>8}   microseconds")
    table: dict[tuple[str, str], list[float]] = {key: [] for key in predictors}
    for count in (1, 200):
        x = rng.normal(size=(count, layout.x_size)).astype(np.float32)
        spent: dict[tuple[str, str], list[float]] = {key: [] for key in predictors}
        for call in range(CALLS if count == 1 else CALLS // 10):
            phase = np.full(count, (call * 0.017) % 1)
            for key, predictor in predictors.items():
                start = perf_counter()
                predictor.predict(x, phase)
                spent[key].append(perf_counter() - start)
        for key, times in spent.items():
            table[key].append(median(times) * 1e6)
    for (kind, storage), (one, many) in table.items():
        base = table["pfnn", storage]
        print(
            f"{kind + ', ' + storage:20} {one:10.0f} {one / base[0]:8.2f} {many:10.0f} {many / base[1]:8.2f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--batches", default="32,256")
    parser.add_argument("--sizes", default="342,512,512,311")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    print(processor_name())
    predictions()
    use_threads(options.threads)
    torch.manual_seed(1)
    sizes = tuple(int(size) for size in options.sizes.split(","))
    batches = [int(rows) for rows in options.batches.split(",") if rows]
    steps(batches, sizes, options.turns)


if __name__ == "__main__":
    main()
