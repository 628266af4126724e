"""Speed of the measurements with many characters at once: injury sweeps, and roll-outs of clips.

    python benchmarks/evaluation.py [weights.npz or folder]

Without a file, a random network of the published size with 30 severities is used: the times are the same.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
from runtime import SKELETON, load_skeleton, random_network

from hobble.core.processors import processor_name
from hobble.measures.accuracy_run import RollOutCrowd, RollOutInputs
from hobble.measures.walks import CrowdTarget, generate_walks
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime

RUNTIME = Runtime(mode="cubic")
FRAMES = 120


def seconds(work: Callable[[], object]) -> float:
    """CPU seconds of the second of two runs: compiled code is loaded in the first."""
    work()
    start = process_time()
    work()
    return process_time() - start


def sweep(network: Network) -> tuple[float, float]:
    """CPU microseconds for a frame of one figure: a figure for each link at once, and one after another."""
    links = network.channels.get("injury") or ("",) * 30

    def walk(which: slice) -> None:
        cases = [{"injury": {link: 5.0}} for link in links[which]]
        generate_walks(network, [CrowdTarget(FRAMES, ["walk"] * len(cases), cases)], RUNTIME)

    per, alone = 1e6 / FRAMES / len(links), [slice(i, i + 1) for i in range(len(links))]
    return per * seconds(lambda: walk(slice(None))), per * seconds(lambda: [walk(one) for one in alone])


def roll_outs(network: Network) -> tuple[float, float]:
    """CPU microseconds for a frame of a roll-out: with all starts of a stretch at once, and one after
    another.
    """
    layout, count, length = network.layout, 400, 60
    rng = np.random.default_rng(1)
    x = (network.x_mean + 0.1 * rng.normal(size=(count, layout.x_size))).astype(np.float32)
    still = np.zeros(count)
    recorded = RollOutInputs(
        x,
        np.zeros((count, layout.y_size), np.float32),
        still,
        rng.random(count),
        still,
        np.zeros((count, 2)),
        still + 1,
    )
    starts = np.arange(1, count - length, 6)
    predictor = network.predictor()
    per = 1e6 / length / len(starts)

    def roll_out(chosen: np.ndarray) -> None:
        for _ in RollOutCrowd(predictor, recorded, chosen, chosen + length).frames():
            pass

    together = seconds(lambda: roll_out(starts))
    apart = seconds(lambda: [roll_out(starts[i : i + 1]) for i in range(len(starts))])
    return per * together, per * apart


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("network", nargs="?", type=Path, help="weights.npz, or a folder with one")
    path = parser.parse_args().network
    print(processor_name())
    network = load_network(path) if path else random_network(load_skeleton(SKELETON))
    print("microseconds of CPU a frame       at once  one by one  ratio")
    for name, (together, apart) in (("injury sweep", sweep(network)), ("roll-outs", roll_outs(network))):
        print(f"{name:32}{together:9.0f}{apart:12.0f}{apart / together:7.1f}")


if __name__ == "__main__":
    main()
