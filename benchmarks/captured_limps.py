"""Whether a network's hurt character is nearer to captured limps than its healthy one.

    python benchmarks/captured_limps.py WEIGHTS CLIP.bvh [CLIP.bvh ...]

Each clip needs a status file beside it, CLIP_injuries.txt, with the same severities in all frames. No
healthy walk of the same performer is known, so the clip is compared with people's mean healthy walk.
"""

import argparse
from pathlib import Path

import numpy as np

from hobble.channels.injury.status import read_status
from hobble.cli.gait import read_clip
from hobble.core.errors import InputError
from hobble.gait.cycles import measure_cycles
from hobble.gait.profile import NO_CYCLE
from hobble.measures.limp_run import INJURY, Walk, compare_held_out, healthy_reference, walk_figures
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime


def captured_limp(path: Path, network: Network) -> Walk:
    clip = read_clip(path)
    spells = read_status(path.with_name(f"{path.stem}_injuries.txt"), network.channels[INJURY]).spells
    if len({spell.links for spell in spells}) != 1:
        raise InputError(path, "its severities change, so no single limp can be compared")
    walk = measure_cycles(clip.skeleton, clip.positions, clip.fps)
    if not len(walk):
        raise InputError(path, NO_CYCLE)
    return Walk(dict(spells[0].links), walk, np.zeros((0, 0, 3)), path.stem)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("weights", help="a network that was not trained on these clips")
    parser.add_argument("clips", nargs="+", type=Path, metavar="CLIP.bvh")
    parser.add_argument("--seconds", type=float, default=8.0, help="length of the character's walks")
    options = parser.parse_args()
    network = load_network(options.weights)
    limps = [captured_limp(path, network) for path in options.clips]
    cases = [{}, *({INJURY: limp.injury} for limp in limps)]
    healthy, *figures = walk_figures(network, cases, "walk", options.seconds, Runtime())
    print(f"{'clip':44}{'healthy':>9}{'hurt':>7}")
    for limp, figure in zip(limps, figures, strict=True):
        row = compare_held_out(limp, figure, healthy, healthy_reference(limp, limps))
        print(f"{row['clip']:44}{row['healthy']:9.2f}{row['hurt']:7.2f}")


if __name__ == "__main__":
    main()
