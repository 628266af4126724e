"""Microseconds of a prediction and of a whole frame, beside a plain numpy blend.

    python benchmarks/runtime.py [weights.npz or folder] [skeleton.yaml]

Without a file, a random network of the published size (342-512-512-311) is used: the times are the same.
Weights are cold where it says so: 64 MB are read between two predictions, more than the caches hold.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import yaml

from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.load import load_network
from hobble.models.network import STORAGES
from hobble.models.pfnn.forward import weights_at
from hobble.models.pfnn.network import Pfnn
from hobble.models.pfnn.predictor import MODES, PfnnPredictor
from hobble.rows.layout import RowLayout
from hobble.runtime.animation import ProceduralAnimation

SKELETON = Path(__file__).parents[1] / "config/skeletons/holden31.yaml"
FRAMES = 1200
PHASE_STEP = 0.017
ORIGINAL = {"constant": 212, "linear": 329, "cubic": 497}  # its C++, microseconds, on this kind of machine


def load_skeleton(path: Path) -> Skeleton:
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    return Skeleton.from_dict({"name": path.stem, **{k: v for k, v in data.items() if k != "maps"}})


def random_network(skeleton: Skeleton, units: int = 512, hidden: int = 2) -> Pfnn:
    """Random weights around a figure in its rest pose that glides ahead."""
    layout = RowLayout(len(skeleton.joints))
    rng = np.random.default_rng(1)
    sizes = [layout.x_size, *[units] * hidden, layout.y_size]
    rest = np.tile([1.0, 0, 0, 0], (1, layout.joints, 1))
    y = np.zeros(layout.y_size, np.float32)
    y[layout.y_joint_position] = forward_kinematics(skeleton, rest, np.array([[0, 93.0, 0]]))[1].ravel()
    y[layout.y_phase_change], y[1] = PHASE_STEP, 1.5
    y[layout.y_direction][layout.future :] = 1
    return Pfnn(
        weights=tuple(rng.normal(0, n**-0.5, (4, m, n)).astype(np.float32) for n, m in pairwise(sizes)),
        biases=tuple(np.zeros((4, m), np.float32) for m in sizes[1:]),
        x_mean=np.zeros(layout.x_size, np.float32),
        x_std=np.full(layout.x_size, 20, np.float32),
        y_mean=y,
        y_std=np.full(layout.y_size, 0.01, np.float32),
        layout=layout,
        skeleton=skeleton,
    )


def numpy_blend(network: Pfnn, x: np.ndarray, phase: float) -> np.ndarray:
    """The plain way: blend every weight at the phase, then multiply."""
    h = (x - network.x_mean) / network.x_std
    last = len(network.weights) - 1
    for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
        h = weights_at(w, phase)[0].astype(np.float32) @ h + weights_at(b, phase)[0].astype(np.float32)
        if i < last:
            h = np.where(h > 0, h, np.expm1(h))
    return h * network.y_std + network.y_mean


def timed(call, frames: int, cold: bool = False) -> np.ndarray:
    """Microseconds of each of `frames` calls call(phase), the phase going on."""
    junk = np.zeros(8 * 2**20)
    times = np.zeros(frames)
    for k in range(frames):
        phase = (k * PHASE_STEP) % 1
        if cold:
            junk.sum()
        before = perf_counter()
        call(phase)
        times[k] = perf_counter() - before
    return 1e6 * times[frames // 10 :]


def show(name: str, times: np.ndarray, baseline: float, note: str = "") -> None:
    median, p99 = np.median(times), np.percentile(times, 99)
    print(f"{name:<34}{median:9.1f}{p99:9.1f}{baseline / median:9.1f}  {note}")


def predictions(network: Pfnn) -> float:
    x = np.random.default_rng(2).normal(0, 20, (1, network.layout.x_size)).astype(np.float32)
    blend = timed(lambda p: numpy_blend(network, x[0], p), 120)
    baseline = float(np.median(blend))
    print(f"{'prediction':<34}{'median':>9}{'p99':>9}{'ratio':>9}")
    show("numpy, weights blended", blend, baseline)
    z, out, phase = np.zeros_like(x), np.zeros((1, network.layout.y_size), np.float32), np.zeros(1)
    for mode in MODES:
        for storage in STORAGES:
            predictor = PfnnPredictor(network, mode, storage)
            predictor.standardise(x, z)

            def call(p: float, predictor: PfnnPredictor = predictor) -> None:
                phase[0] = p
                predictor.evaluate(z, phase, out)

            call(0)
            for cold in (False, True):
                name = f"{mode} {storage}{' cold' if cold else ''}"
                show(name, timed(call, FRAMES, cold), baseline, f"(original {ORIGINAL[mode]})")
    return baseline


def frames(network: Pfnn, baseline: float) -> None:
    print(f"\n{'next_pose, a character':<34}{'median':>9}{'p99':>9}{'ratio':>9}")
    for mode in MODES:
        for count in (1, 11, 200):
            character = ProceduralAnimation(network, mode=mode, characters=count)
            angle = np.random.default_rng(3).uniform(0, 2 * np.pi, count)
            character.state.phase[:] = angle / (2 * np.pi)
            velocity = 2.5 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
            character.next_pose(velocity, gait="walk")
            run = max(60, FRAMES // count)
            before = process_time()
            times = timed(lambda p, c=character, v=velocity: c.next_pose(v, gait="walk"), run) / count
            busy = 1000 * (process_time() - before) / run
            note = f"{count} characters" + (
                f": {np.median(times) * count / 1000:.1f} ms, {busy:.1f} ms of the processor"
                if count > 1
                else ""
            )
            show(mode, times, baseline, note)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("network", nargs="?", help="weights.npz, a folder that holds one, or the original's")
    parser.add_argument("skeleton", nargs="?", type=Path, default=SKELETON, help="for networks without one")
    asked = parser.parse_args()
    skeleton = load_skeleton(asked.skeleton)
    network = load_network(asked.network, skeleton) if asked.network else random_network(skeleton)
    print(f"{'-'.join(map(str, network.sizes))}, microseconds, one core; ratio: numpy's blend over this")
    network = replace(network, skeleton=network.skeleton or skeleton)
    frames(network, predictions(network))


if __name__ == "__main__":
    main()
