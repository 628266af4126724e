"""Tells whether two networks learnt the same but for rounding: `near.py WEIGHTS WEIGHTS`.

Sums over processes round differently. Prints by how much the held-out errors differ; status 1 above .01 of
them, or where steps or samples are not the same.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np

MOST = 0.01


def told(path: str) -> dict[str, Any]:
    """What a file of weights says of its training."""
    with np.load(path) as file:
        return dict(json.loads(str(file["meta"])))


def main(first: str, second: str) -> int:
    a, b = told(first), told(second)
    apart = abs(a["held_out_mse"] / b["held_out_mse"] - 1)
    print(f"held-out errors {a['held_out_mse']:.4f} and {b['held_out_mse']:.4f}, {apart:.1%} apart")
    return int(any(a[key] != b[key] for key in ("steps", "samples")) or apart > MOST)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
