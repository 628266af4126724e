"""Training recipes compared on held-out clips: errors, drift, and a lap of the character.

    python benchmarks/generalise.py DATABASE < recipes

DATABASE is results/datasets/<dataset>/database/plain; its `clips` have to be in the same folder. Each line of
the input is one recipe, in keys of the training section: `passes: 2, batch: 256, dropout: 0.1`. For each
recipe it prints:

- the mean squared error of the last section of training (with dropout and roll-outs) and of held-out rows;
- the distance of joints from the recorded ones in roll-outs of 1, 10 and 60 frames, cm;
- for a lap of the track: waypoints reached, seconds, largest distance from the path (cm), and largest turn of
  a joint in a frame (degrees). In a roll-out the path comes from the clip, so a network with good roll-outs
  may still get stuck on the track.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import hobble.training  # noqa: F401 - first, since it says how threads wait

# isort: split
import torch
import yaml

from hobble.database.reader import Database
from hobble.measures.accuracy_run import measure_accuracy
from hobble.measures.measure import MeasureInputs
from hobble.measures.responsivity import Options as Laps
from hobble.measures.responsivity_run import measure_responsivity
from hobble.models.load import load_network
from hobble.models.pfnn import PfnnOptions
from hobble.runtime import Runtime
from hobble.runtime.waypoints import TRACK, Waypoint
from hobble.training import Training
from hobble.training.batches import HeldOutErrors
from hobble.training.train import train, write_weights

LENGTHS = (1, 10, 60)


def measure_recipe(
    database: Database,
    recipe: dict,
    threads: int,
    network: PfnnOptions | None = None,
    track: Sequence[Waypoint] = TRACK,
) -> str:
    """The line of one recipe. network: by default the original one."""
    network = network or PfnnOptions()
    training = Training(**recipe)
    clips = {c["clip"]: c["split"] for c in database.manifest.clips if c["split"] == "held_out" and c["rows"]}
    files = {name: database.path.parent / "clips" / f"{name}.npz" for name in clips}
    with tempfile.TemporaryDirectory() as folder:
        weights = Path(folder) / "weights.npz"
        state = train(database, network=network, training=training, checkpoints=Path(folder), threads=threads)
        write_weights(weights, state.network, database, "benchmark", {})
        rolled = measure_accuracy(MeasureInputs("", {"weights": weights}, files, clips), lengths=LENGTHS)
        character = load_network(weights)
    lap = measure_responsivity(
        character, Laps(laps=1, modes=()), configuration="", runtime=Runtime(), track=track
    )
    whole = HeldOutErrors(database, torch.device("cpu"), 0).errors(state.network, every_row=True)[0]
    strayed = " ".join(f"{entry['held_out']['position_error_cm']:5.2f}" for entry in rolled["rollouts"])
    laps = f"{lap['waypoints_reached']}/{lap['waypoints']} {lap['laps'][0]['seconds']:4.0f}"
    laps += f" {lap['path_overshoot_cm']:5.0f} {lap['largest_turn_degrees']:4.0f}"
    return f"{state.history[-1][4]:7.4f} {whole:9.4f}  {strayed}  {laps}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("database", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    database = Database.open(options.database, Training().memory_mb)
    lengths = ", ".join(map(str, LENGTHS))
    print(f"  train  held out  cm over {lengths} frames; lap: reached, s, cm, degrees", flush=True)
    for line in sys.stdin:
        recipe = yaml.safe_load("{" + line + "}")
        print(f"{measure_recipe(database, recipe, options.threads)}  {line.strip()}", flush=True)


if __name__ == "__main__":
    main()
