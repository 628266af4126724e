"""Stability of a network's character over ten simulated minutes.

    python benchmarks/stability.py results/holden/network [--minutes 10] [--seed 1] [--skeleton FILE]

Prints the worst values of each kind of motion, and exits with status 1 if the hips leave 60 to 110 cm, a
joint turns more than 60 degrees in a frame, feet slide 2 cm a step or more on average, or a number is not
finite.
"""

from __future__ import annotations

import argparse
import sys

from hobble.core.errors import HobbleError
from hobble.evaluation.stability import LIMITS, stability
from hobble.models.load import load_network
from hobble.models.pfnn.predictor import MODES
from hobble.runtime.options import Runtime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", help="weights.npz, a folder that holds it, or a folder of .bin files")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mode", choices=tuple(MODES), default="cubic")
    parser.add_argument("--steering", type=float, default=2.0, help="0 is the original runtime")
    parser.add_argument(
        "--skeleton", default="config/skeletons/holden31.yaml", help="where the network has none"
    )
    options = parser.parse_args()
    try:
        network = load_network(options.network)
        if network.skeleton is None:
            network = load_network(options.network, options.skeleton)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 2
    runtime = Runtime(mode=options.mode, steering=options.steering)
    found = stability(network, options.minutes, options.seed, runtime)
    print(f"{'':<8}{'frames':>8}{'hips, cm':>16}{'turn, deg':>11}{'slide, cm':>11}{'steps':>7}", end="")
    print(f"{'foot down':>11}{'skating, cm':>13}")
    for name, row in {**found["kinds"], "all": found}.items():
        hips = f"{row['hips_lowest_cm']:.1f} to {row['hips_highest_cm']:.1f}"
        slide = "-" if row["foot_slide_cm"] is None else f"{row['foot_slide_cm']:.2f}"
        print(
            f"{name:<8}{row['frames']:>8}{hips:>16}{row['largest_turn_degrees']:>11.1f}{slide:>11}"
            f"{row['steps']:>7}{row['foot_down_share']:>11.3f}{row['skating_cm']:>13.3f}"
        )
    print(f"{'stable' if found['stable'] else 'NOT STABLE'}: {LIMITS}")
    return 0 if found["stable"] else 1


if __name__ == "__main__":
    sys.exit(main())
