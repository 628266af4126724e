"""Checks that two networks learnt the same apart from rounding: near.py WEIGHTS WEIGHTS"""

import json
import sys
from typing import Any

import numpy as np

MOST = 0.01


def read_result(path: str) -> dict[str, Any]:
    """What a file of weights says about its training."""
    with np.load(path) as file:
        return dict(json.loads(str(file["meta"])))


def main(first: str, second: str) -> int:
    a, b = read_result(first), read_result(second)
    apart = abs(a["held_out_mse"] / b["held_out_mse"] - 1)
    print(f"held-out errors {a['held_out_mse']:.4f} and {b['held_out_mse']:.4f}, {apart:.1%} apart")
    return int(any(a[key] != b[key] for key in ("steps", "samples")) or apart > MOST)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
