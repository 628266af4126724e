"""Controllers side by side: laps, ten minutes, roll-outs, frame times in turn, bytes.

    python benchmarks/controllers.py DATABASE NAME=WEIGHTS ... [--laps 19] [--minutes 10] [--rollouts]

DATABASE is results/datasets/<dataset>/database/plain; the `clips` that it was made from have to be in the
same folder. Frame times are divided by those of the first network. They are measured on one core, with one
character that walks, jogs, stops and turns, and with CROWD of them. Each kind stores its numbers as it does
by default. The networks take turns, a stretch of frames each, so that other work on the machine affects all
of them equally. The script prints the median of the ratios of the stretches' means. A stretch includes frames
with and without a search of motion matching.
"""

import argparse
from pathlib import Path
from time import perf_counter

import numpy as np
from stability import random_targets, stability

from hobble.core.processors import processor_name
from hobble.database.chunks import Manifest
from hobble.measures.accuracy_run import measure_accuracy
from hobble.measures.measure import MeasureInputs
from hobble.measures.responsivity import Options as Laps
from hobble.measures.responsivity_run import measure_responsivity
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation

TURNS, FRAMES = 60, 60  # stretches of each network, frames of a stretch
CROWD = 200
LENGTHS = (1, 60, 300)


def frame_ratios(networks: dict[str, Network], characters: int, turns: int) -> dict[str, tuple[float, float]]:
    """Name -> microseconds a frame (median of the stretches), and how many times those of the first."""
    made = {name: ProceduralAnimation(n, characters=characters) for name, n in networks.items()}
    targets = [s for s in random_targets(10.0) for _ in range(s.frames)]
    for animation in made.values():
        for target in targets[:: len(targets) // 20]:
            animation.next_pose(target.velocity, target.facing, target.gait)
    took: dict[str, list[float]] = {name: [] for name in made}
    for turn in range(turns):
        part = targets[turn * FRAMES : (turn + 1) * FRAMES]
        for name, animation in made.items():
            begin = perf_counter()
            for target in part:
                animation.next_pose(target.velocity, target.facing, target.gait)
            took[name].append((perf_counter() - begin) / len(part))
    first = np.array(next(iter(took.values())))
    return {
        name: (1e6 * float(np.median(t)), float(np.median(np.array(t) / first))) for name, t in took.items()
    }


def roll_outs(weights: Path, database: Path) -> str:
    """Centimetres over roll-outs of LENGTHS held-out frames."""
    clips = {
        c["clip"]: c["split"] for c in Manifest.load(database).clips if c["split"] == "held_out" and c["rows"]
    }
    files = {name: database.parent / "clips" / f"{name}.npz" for name in clips}
    found = measure_accuracy(MeasureInputs("", {"weights": weights}, files, clips), lengths=LENGTHS)
    return " ".join(f"{entry['held_out']['position_error_cm']:.2f}" for entry in found["rollouts"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("database", type=Path)
    parser.add_argument("networks", nargs="+", metavar="NAME=WEIGHTS")
    parser.add_argument("--laps", type=int, default=19)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rollouts", action="store_true")
    parser.add_argument("--no-times", action="store_true", help="leave out the frame times")
    options = parser.parse_args()
    print(processor_name())
    paths = {name: Path(path) for name, _, path in (one.partition("=") for one in options.networks)}
    networks = {name: load_network(path) for name, path in paths.items()}
    for count, turns in () if options.no_times else ((1, TURNS), (CROWD, 4)):
        for name, (us, ratio) in frame_ratios(networks, count, turns).items():
            print(f"{name}: {count} characters, {us:,.0f} us a frame, {ratio:.2f} times", flush=True)
    for name, network in networks.items():
        size, number = paths[name].stat().st_size / 1e6, np.dtype(network.default_storage).itemsize
        kept = 1e-6 * number * network.stored_numbers(network.resolve_mode(None))
        print(f"{name}: {size:.1f} MB file, {kept:.1f} MB in memory as {network.default_storage}", flush=True)
        if options.laps:
            laps = Laps(laps=options.laps, modes=())
            lap = measure_responsivity(network, laps, configuration="", runtime=Runtime())
            print(
                f"{name}: {lap['waypoints_reached']} of {lap['waypoints']} waypoints, at most "
                f"{lap['path_overshoot_cm']:.0f} cm off the path, a lap {lap['mean_lap_seconds']} s, turn "
                f"{lap['largest_turn_degrees']:.0f} degrees",
                flush=True,
            )
        if options.minutes:
            print(f"{name}: {stability(network, options.minutes)}", flush=True)
        if options.rollouts:
            strayed = roll_outs(paths[name], options.database)
            print(f"{name}: {', '.join(map(str, LENGTHS))} frames: {strayed} cm", flush=True)


if __name__ == "__main__":
    main()
