"""A million frames with random targets, injuries and grounds, by many characters at once.

    python benchmarks/soak.py results/injured/network [--characters 200] [--frames 5000] [--seed 1]

Prints the worst values, and exits with status 1 if one exceeds `hobble.evaluation.soak.LIMITS`.
"""

from __future__ import annotations

import argparse
import sys

from hobble.core.errors import HobbleError
from hobble.evaluation.soak import LIMITS, soak
from hobble.models.load import load_network
from hobble.runtime.options import Runtime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", help="weights.npz, a folder that holds it, or a folder of .bin files")
    parser.add_argument("--characters", type=int, default=200)
    parser.add_argument("--frames", type=int, default=5000, help="of each character")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mode", default="constant", help="phase mode of the network")
    parser.add_argument("--without-locking", action="store_true", help="feet are only kept out of the ground")
    parser.add_argument(
        "--skeleton", default="config/skeletons/holden31.yaml", help="where the network has none"
    )
    arguments = parser.parse_args()
    if arguments.characters < 2:
        parser.error("--characters: at least 2")
    try:
        network = load_network(arguments.network, arguments.skeleton)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 2
    found = soak(
        network,
        arguments.characters,
        arguments.frames,
        arguments.seed,
        Runtime(mode=arguments.mode, foot_locking=not arguments.without_locking),
    )
    for name, value in found.items():
        print(f"{name:<24}{value}")
    print(f"{'holds' if found['holds'] else 'DOES NOT HOLD'}: {LIMITS}")
    return 0 if found["holds"] else 1


if __name__ == "__main__":
    sys.exit(main())
