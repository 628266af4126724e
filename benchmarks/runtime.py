"""Microseconds of a prediction and of a whole frame, compared with lower bounds measured in the same run.

    python benchmarks/runtime.py [weights.npz or folder] [skeleton.yaml]

Without a file, a random network of the published size (342-512-512-311) is used: the times are the same.
A prediction of one character is compared with the time to read as many bytes. "Cold" uses so many copies of
the weights that no cache holds them, for the prediction and for the lower bound. A crowd is compared with
onnxruntime (if installed) on one thread, with Hobble's export. Times are processor times.

NUMBA_CPU_NAME=znver3 simulates a processor without AVX-512 (but not for onnxruntime).
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, thread_time
from typing import Any

import numpy as np
import yaml
from numba import njit

from hobble.core.processors import processor_name
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.load import load_network
from hobble.models.network import STORAGES
from hobble.models.pfnn import STORED_AND_BLENDED, Pfnn
from hobble.models.predict import PANELS_FOR_3_ROWS, PANELS_FOR_6_ROWS
from hobble.rows.layout import RowLayout
from hobble.runtime.animation import ProceduralAnimation

SKELETON = Path(__file__).parents[1] / "config/skeletons/holden31.yaml"
FRAMES = 1200
PHASE_STEP = 0.017
CACHES = 200_000_000  # bytes, more than caches hold
CALLS = 200
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


def timed(call: Callable[[int], object], count: int, clock: Callable[[], float] = perf_counter) -> Array:
    """Microseconds of each of `count` calls call(k), without the first tenth."""
    times = np.zeros(count)
    for k in range(count):
        before = clock()
        call(k)
        times[k] = clock() - before
    return 1e6 * times[count // 10 :]


@njit(fastmath=True)
def read(values: Any) -> Any:
    """The sum of all arrays, which reads each of them once."""
    quarter = values.size // 4
    a, b, c, d = values, values[quarter:], values[2 * quarter :], values[3 * quarter :]
    total = 0
    for i in range(quarter):
        total += a[i] + b[i] + c[i] + d[i]
    return total


def cpu() -> str:
    """The kind of processor, and which of its registers are used."""
    wide = PANELS_FOR_3_ROWS == PANELS_FOR_6_ROWS
    return f"{processor_name()}, {'AVX-512' if wide else 'no AVX-512'}"


def predictions(network: Pfnn) -> None:
    """One character: warm, and with weights that come from memory."""
    print(f"\n{'prediction':<34}{'median':>9}{'p99':>9}{'floor':>9}{'over it':>9}")
    rng = np.random.default_rng(2)
    x = rng.normal(0, 20, (1, network.layout.x_size)).astype(np.float32)
    z, out, phase = np.zeros_like(x), np.zeros((1, network.layout.y_size), np.float32), np.full(1, 0.3)
    for mode, (stored, looked_up) in STORED_AND_BLENDED.items():
        for storage in STORAGES:
            predictor = network.predictor(mode, storage)
            predictor.standardise(x, z)
            size = network.parameter_count * np.dtype(storage).itemsize  # of one point
            for cold in (False, True):
                copies = CACHES // (size * (stored or network.sets)) + 1 if cold else 1
                many = [network.predictor(mode, storage) for _ in range(copies)]
                pool = np.ones((CACHES // (looked_up * size) if cold else 1, looked_up * size // 8), np.int64)
                rows, times, floor = len(pool), [], []
                for k in range(CALLS):
                    phase[0] = rng.random() if cold else 0.3
                    of = many[k % copies]
                    times.append(timed(lambda _, p=of: p.evaluate(z, phase, out), 1, thread_time)[0])
                    floor.append(timed(lambda _, p=pool[k % rows]: read(p), 1, thread_time)[0])
                least = float(np.median(floor[9:]))
                median, p99 = np.median(times[9:]), np.percentile(times[9:], 99)
                name = f"{mode} {storage}{' cold' if cold else ''} (original {ORIGINAL[mode]})"
                print(f"{name:<34}{median:9.1f}{p99:9.1f}{least:9.1f}{median / least:9.2f}")


def crowds(network: Pfnn) -> None:
    """Many characters in cubic mode: processor microseconds, and those of onnxruntime in the same run."""
    try:
        import onnxruntime
    except ImportError:
        print("\nonnxruntime is not installed: no crowds beside it")
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / "network.onnx"
        network.export("onnx", path, "cubic")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    predictor, rng = network.predictor(), np.random.default_rng(2)
    print(
        f"\n{'characters':<14}{'ours':>9}{'onnxruntime':>13}{'ratio':>7}{'GFLOP/s':>9}{'share of 1/60 s':>17}"
    )
    for count in (1, 2, 4, 10, 32, 100, 200):
        x = (network.x_mean + network.x_std * rng.normal(size=(count, network.layout.x_size))).astype("f4")
        phase = rng.random(count)
        fed = {"x": x, "phase": phase.astype(np.float32)}
        ours, theirs = [], []
        for _ in range(max(15, 200 // count)):
            ours.append(timed(lambda _, x=x, p=phase: predictor.predict(x, p), 1, process_time)[0])
            theirs.append(timed(lambda _, fed=fed: session.run(None, fed), 1, process_time)[0])
        a, b = np.median(ours), np.median(theirs)
        speed = 2e-3 * network.parameter_count * network.sets * count / a
        print(f"{count:<14}{a:9.0f}{b:13.0f}{b / a:7.2f}{speed:9.1f}{a * 60e-6:17.2f}")


def frames(network: Pfnn) -> None:
    """Whole frames: microseconds for each character."""
    print(f"\n{'next_pose, a character':<34}{'median':>9}{'p99':>9}{'a frame':>9}")
    for mode in STORED_AND_BLENDED:
        for count in (1, 11, 200):
            character = ProceduralAnimation(network, mode=mode, characters=count)
            angle = np.random.default_rng(3).uniform(0, 2 * np.pi, count)
            character.state.phase[:] = angle / (2 * np.pi)
            velocity = 2.5 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
            character.next_pose(velocity, gait="walk")
            run = max(60, FRAMES // count)
            each = timed(lambda _, c=character, v=velocity: c.next_pose(v, gait="walk"), run, process_time)
            median, p99 = np.median(each), np.percentile(each, 99)
            name = f"{mode}, {count} characters"
            print(f"{name:<34}{median / count:9.1f}{p99 / count:9.1f}{median / 1000:9.2f} ms")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("network", nargs="?", help="weights.npz, a folder with one, or the original's folder")
    parser.add_argument("skeleton", nargs="?", type=Path, default=SKELETON, help="for networks without one")
    arguments = parser.parse_args()
    skeleton = load_skeleton(arguments.skeleton)
    network = load_network(arguments.network, skeleton) if arguments.network else random_network(skeleton)
    network = replace(network, skeleton=network.skeleton or skeleton)
    print(f"{'-'.join(map(str, network.sizes))}, microseconds, one core of {cpu()}")
    predictions(network)
    crowds(network)
    frames(network)


if __name__ == "__main__":
    main()
