"""Exports a network (onnx, bin), or motions that it generates (bvh).

python -m hobble.runtime onnx|bin|bvh NETWORK TARGET

Examples:

python -m hobble.runtime onnx results/holden/network holden.onnx --mode cubic
python -m hobble.runtime bin results/holden/network out/holden
python -m hobble.runtime bvh out/holden out/walks --skeleton config/skeletons/holden31.yaml
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import get_args

from hobble.core.errors import HobbleError
from hobble.core.section import PhaseMode
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.options import Runtime
from hobble.runtime.scenarios import write_motions


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns its exit status, 1 after an error."""
    parser = argparse.ArgumentParser(
        prog="python -m hobble.runtime",
        description="Export a network (onnx, bin), or motions that it generates (bvh).",
    )
    parser.add_argument(
        "to",
        choices=("onnx", "bin", "bvh"),
        help="onnx: one file, checked with onnxruntime; bin: .bin files as in the release of Holden et al. "
        "(2017); bvh: a few walks that the network generates (straight, turning, ...), one BVH file each",
    )
    parser.add_argument(
        "network", help="the network: weights.npz, the folder that holds it, or a folder of .bin files"
    )
    parser.add_argument("target", help="the file or folder to write")
    parser.add_argument(
        "--mode",
        choices=get_args(PhaseMode),
        default="cubic",
        help="how the network's weights are interpolated over the phase; cubic is exact",
    )
    parser.add_argument(
        "--skeleton", help="a file of config/skeletons, for a network file that has no skeleton"
    )
    options = parser.parse_args(arguments)
    try:
        network = load_network(options.network, options.skeleton)
        print(_write(options.to, network, options.target, options.mode))
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _write(to: str, network: Network, target: str, mode: str) -> str:
    """Write the file or folder `target` in format `to`. Returns a message for the user."""
    if to == "bvh":
        if network.skeleton is None:
            raise HobbleError("the network has no skeleton: pass one with --skeleton")
        names = [track.scenario.name for track in write_motions(network, target, Runtime(mode=mode))]
        return f"{target}: {', '.join(names)}"
    return network.export(to, target, mode)


if __name__ == "__main__":
    sys.exit(main())
