"""How well a character follows its target, with the original runtime's steering (0) and Hobble's (2).

    python benchmarks/steering.py results/holden/network [--skeleton FILE] [--laps 2]

Units are centimetres, degrees and frames; both get the same targets. The results do not depend on the speed
of the machine.
"""

import argparse

import numpy as np

from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.waypoints import TRACK

LINES = {  # degrees from the facing to the direction of travel, cm a frame
    "ahead": (0, 2.5),
    "to the left": (90, 2.2),
    "to the right": (-90, 2.2),
    "backward": (180, 1.8),
    "aslant": (45, 2.2),
}
SECONDS = 10
LONGEST_LAP = 20_000  # frames


def way(speed: float, degrees: float) -> np.ndarray:
    return speed * np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def line(network: Network, degrees: float, speed: float, steering: float) -> str:
    """A straight path from a stand, facing +Z; measured from two seconds on."""
    character = ProceduralAnimation(network, steering=steering)
    velocity = way(speed, degrees)
    poses = [character.next_pose(velocity, (0, 1), "walk") for _ in range(60 * (SECONDS + 2))][120:]
    gone = poses[-1].root[::2] - poses[0].root[::2]
    aside = abs(gone @ [velocity[1], -velocity[0]]) / speed
    yaw = np.degrees(np.mean([p.yaw for p in poses]))
    reached = gone @ velocity / speed / len(poses)
    return f"{aside:.0f} cm off, {reached:.2f} of {speed} cm a frame, facing {yaw:.0f} degrees off"


def on_the_spot(network: Network, steering: float) -> str:
    character = ProceduralAnimation(network, steering=steering)
    places = []
    for quarter in range(1, 9):
        places += [character.next_pose((0, 0), way(1, 90 * quarter), "walk").root[::2] for _ in range(180)]
    x, z = np.ptp(places, axis=0)
    return f"{x:.0f} x {z:.0f} cm of room for eight quarter turns"


def corner(network: Network, gait: str, speed: float, degrees: float, steering: float) -> str:
    character = ProceduralAnimation(network, steering=steering)
    for _ in range(240):
        start = character.next_pose((0, speed), None, gait).root
    places = [character.next_pose(way(speed, degrees), None, gait).root - start for _ in range(300)]
    return f"{max(p[2] for p in places):.0f} cm too far"


def laps(network: Network, count: int, steering: float) -> str:
    character = ProceduralAnimation(network, waypoints=TRACK, steering=steering)
    follower, off = character.follower, []
    assert follower is not None
    while follower.reached[0] < count * len(TRACK) and len(off) < count * LONGEST_LAP:
        character.next_pose()
        off.append(follower.off_path[0])
    reached = f"{follower.reached[0]} waypoints"
    return f"{reached}, off the line {max(off):.0f} cm at most, {np.mean(off):.0f} on average"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", help="weights.npz, a folder that holds it, or a folder of .bin files")
    parser.add_argument(
        "--skeleton", default="config/skeletons/holden31.yaml", help="where the network has none"
    )
    parser.add_argument("--laps", type=int, default=2)
    options = parser.parse_args()
    network = load_network(options.network)
    if network.skeleton is None:
        network = load_network(options.network, options.skeleton)
    for steering in (0.0, 2.0):
        print(f"steering {steering:g}")
        for name, (degrees, speed) in LINES.items():
            print(f"  {name:<22}{line(network, degrees, speed, steering)}")
        print(f"  {'turning on the spot':<22}{on_the_spot(network, steering)}")
        for gait, speed in (("walk", 2.5), ("jog", 7.0)):
            for degrees in (90, 180):
                name = f"{gait}, then {degrees} degrees"
                print(f"  {name:<22}{corner(network, gait, speed, degrees, steering)}")
        print(f"  {'the track':<22}{laps(network, options.laps, steering)}")


if __name__ == "__main__":
    main()
