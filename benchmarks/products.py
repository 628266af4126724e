"""The matrix products of a training step, by each way that PyTorch has on a CPU, and the gain of the best.

    python benchmarks/products.py [--batches 32,256] [--threads 1] [--sizes 342,512,512,311] [--half]

The ways take turns, and the fastest call of each counts, because other work disturbs some calls. "chosen" is
the way that `hobble.models.products` chooses on this machine. A step is that of `pfnn` with dropout, without
Adam. Ratios are to the way named "linear", oneDNN's inner product, or to "plain" on a CPU for which oneDNN
refuses bfloat16. To see what other processors see, set
ATEN_CPU_CAPABILITY=avx2 ONEDNN_MAX_CPU_ISA=AVX2 MKL_ENABLE_INSTRUCTIONS=AVX2 NUMBA_CPU_NAME=znver3.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from time import perf_counter, thread_time
from unittest.mock import patch

import hobble.training  # noqa: F401 - first, since it says how threads wait

# isort: split
import torch
from torch import Tensor

from hobble.core.processors import processor_name
from hobble.models import products
from hobble.models.pfnn.fused import FusedPfnnStep
from hobble.models.pfnn.trainable import untrained_network
from hobble.training.checkpoint import use_threads

POINTS = 4
SECONDS = 1.0  # for all ways of one product or step
BASE = "linear"


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


def factors(rows: int, sizes: tuple[int, ...], dtype: torch.dtype) -> dict[str, tuple[Tensor, Tensor]]:
    """The two factors (m, n) and (k, n) of each product of a step."""
    found = {}
    for number, (inputs, outputs) in enumerate(pairwise(sizes)):
        e, w, d = (
            torch.randn(size, dtype=torch.float32).to(dtype)
            for size in ((rows, POINTS * (inputs + 1)), (outputs, POINTS * (inputs + 1)), (rows, outputs))
        )
        found[f"layer {number}: outputs"] = e, w
        found[f"layer {number}: gradient of weights"] = d.T, e.T
        if number:
            found[f"layer {number}: gradient of inputs"] = d, w.T
    return found


def chosen(a: Tensor, b: Tensor) -> str:
    """The way that `product` takes."""
    shape = (len(a), a.shape[1], len(b))
    by_rows = (products._is_by_rows(a), products._is_by_rows(b))
    return products._chosen_way(shape, by_rows, a.dtype, torch.get_num_threads())


def steps(rows: int, sizes: tuple[int, ...], half: bool) -> dict[str, float]:
    """Seconds of a step with one way for all products, and with the chosen ones."""
    network = untrained_network(sizes, POINTS, 1)
    step = FusedPfnnStep(network, 0.03, half)
    batch = torch.randn(rows, sizes[0]), torch.randn(rows, sizes[-1]), torch.rand(rows)

    def with_way(way: str) -> Callable[[], object]:
        def call() -> None:
            with patch.object(products, "_chosen_way", lambda *_: way):
                step(*batch, step.masks(rows))

        return call

    def as_chosen() -> None:
        step(*batch, step.masks(rows))

    ways = products.working_ways(torch.bfloat16 if half else torch.float32)
    return least({**{way: with_way(way) for way in ways}, "chosen": as_chosen})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--batches", default="32,256")
    parser.add_argument("--sizes", default="342,512,512,311")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--half", action="store_true", help="factors in bfloat16")
    options = parser.parse_args()
    use_threads(options.threads)
    sizes = tuple(int(size) for size in options.sizes.split(","))
    dtype = torch.bfloat16 if options.half else torch.float32
    names = products.working_ways(dtype)
    print(f"{processor_name()}, PyTorch's loops for {torch.backends.cpu.get_cpu_capability()}")
    print(f"{'-'.join(map(str, sizes))}, {options.threads} threads, {str(dtype).removeprefix('torch.')}")
    for rows in map(int, options.batches.split(",")):
        print(f"\nbatch {rows:<28}" + "".join(f"{name:>9} us" for name in names) + "  chosen")
        total, own = dict.fromkeys(names, 0.0), 0.0
        for product, (a, b) in factors(rows, sizes, dtype).items():
            out = torch.empty(len(a), len(b), dtype=dtype)
            found = least({name: partial(products.WAYS[name], a, b, out) for name in names})
            taken = chosen(a, b)
            total = {name: total[name] + found[name] for name in names}
            own += found[taken]
            print(f"{product:<34}" + "".join(f"{1e6 * found[name]:12.0f}" for name in names) + f"  {taken}")
        show("products", {**total, "chosen": own})
        show("step", steps(rows, sizes, options.half))


def show(what: str, found: Mapping[str, float]) -> None:
    """A line of times, and one of ratios."""
    cells = "".join(f"{1e6 * found[name]:12.0f}" for name in found)
    base = BASE if BASE in found else "plain"
    ratios = "".join(f"{found[name] / found[base]:12.2f}" for name in found)
    print(f"{f'{what}, all in one way; chosen':<34}{cells}\n{f'  over {base}':<34}{ratios}")


if __name__ == "__main__":
    main()
