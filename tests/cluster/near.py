"""Tells whether two networks learnt the same but for rounding: `near.py WEIGHTS WEIGHTS`.

Sums over processes round differently, and a few steps of float32 make little of it. Prints the largest difference
of their weights, as a share of what one set of weights has learnt since the start; status 1 above .2.
"""

from __future__ import annotations

import json
import sys

import numpy as np

MOST = 0.2


def weights(path: str) -> tuple[np.ndarray, dict[str, object]]:
    """All weights of a file, and what it says of its training."""
    with np.load(path) as file:
        names = sorted(name for name in file.files if name[0] in "Wb" and name[1:].isdigit())
        return np.concatenate([file[name].ravel() for name in names]), json.loads(str(file["meta"]))


def main(first: str, second: str) -> int:
    (a, told), (b, also) = weights(first), weights(second)
    apart = float(np.abs(a - b).max() / np.abs(a).max())
    errors = [facts.get("held_out_mse") for facts in (told, also)]
    print(f"largest difference of a weight: {apart:.2g} of the largest; held-out errors {errors}")
    same_steps = told["steps"] == also["steps"] and told["samples"] == also["samples"]
    return int(not same_steps or apart > MOST)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
