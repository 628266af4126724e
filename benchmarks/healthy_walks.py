"""How well healthy walks of the generated walker and of a network's character are told from captured ones.

    python benchmarks/healthy_walks.py CMU_FOLDER [--network WEIGHTS.npz]

A linear classifier has the 52 numbers of a profile (`hobble.gait.profile`) of windows of 4 s, all on the
skeleton holden31. Each person and each figure is left out of its training in turn. Prints the area under the
curve (.5: cannot tell), and the numbers in which the two differ most. For comparison, the same of each person
beside the others.
"""

import argparse
import itertools
from pathlib import Path

import numpy as np
from derive_gait import OTHERS, REFERENCE, parts
from limps import read

from hobble.core.quat import Array
from hobble.gait.cycles import WalkCycles, measure_cycles
from hobble.gait.profile import PROFILE_NAMES, mirror_profile, profile_of_walk
from hobble.gait.recognise import SHRINKAGE, learn, windows_with_cycles
from hobble.models.load import load_network
from hobble.motion.skeleton_file import load_skeleton
from hobble.runtime.animation import ProceduralAnimation
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment

SPEEDS = (1.5, 1.75, 2.0, 2.25, 2.5)  # cm a frame, of the figures
SECONDS = 30
SKELETON = Path("config/skeletons/holden31.yaml")


def profiles(walks: list[list[WalkCycles]]) -> Array:
    """(N, 52) profiles, and their mirror images. walks: the cycles in the windows of each clip."""
    found = [profile_of_walk(part) for of_clip in walks for part in of_clip]
    both = [*found, *map(mirror_profile, found)]
    return np.array([[profile[name] for name in PROFILE_NAMES] for profile in both])


def captured(folder: Path) -> list[list[Array]]:
    """The profiles of each clip of each person."""
    names = [REFERENCE[person] + OTHERS[person] for person in REFERENCE]
    return [[profiles([parts(read(folder, name)[0])]) for name in of_person] for of_person in names]


def generated() -> list[Array]:
    """The profiles of clips of the generated walker, one for each speed."""
    skeleton, frames = load_skeleton(SKELETON).skeleton, SECONDS * 60
    plans = [[Segment("walk", 60 * speed, seconds=SECONDS)] for speed in SPEEDS]
    clips = [walk_from_plan(f"w{i}", skeleton, p, frames, "flat", 60, i).clip for i, p in enumerate(plans)]
    return [profiles([parts(clip)]) for clip in clips]


def figures(weights: Path) -> list[Array]:
    """The profiles of a network's healthy character, one for each speed."""
    network = load_network(weights)
    character = ProceduralAnimation(network, characters=len(SPEEDS), variation=1.0)
    targets = np.column_stack([np.zeros(len(SPEEDS)), SPEEDS])
    poses = [character.next_pose(targets, gait="walk") for _ in range((5 + SECONDS) * 60)][300:]
    positions = np.array([pose.positions for pose in poses])
    assert network.skeleton is not None
    walks = [measure_cycles(network.skeleton, positions[:, i]) for i in range(len(SPEEDS))]
    return [profiles([[p for _, p in windows_with_cycles(walk, len(poses))]]) for walk in walks]


def told_apart(name: str, real: list[Array], made: list[Array], shown: int = 12) -> None:
    """Print the area under the curve, and the numbers in which the two differ most."""
    areas = []
    for i, k in itertools.product(range(len(real)), range(len(made))):
        known = [np.concatenate([*some[:left], *some[left + 1 :]]) for some, left in ((real, i), (made, k))]
        labels = ["real"] * len(known[0]) + ["made"] * len(known[1])
        judge = learn(np.concatenate(known), labels, SHRINKAGE)
        of_real, of_made = (np.diff(judge.scores(some))[:, 0] for some in (real[i], made[k]))
        areas.append(np.mean(of_real[:, None] > of_made))
    print(f"{name}: area under the curve {np.mean(areas):.2f}")
    a, b = np.concatenate(made), np.concatenate(real)
    apart = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt((a.var(axis=0) + b.var(axis=0)) / 2)
    for k in np.argsort(-np.abs(apart))[:shown]:
        print(f"    {PROFILE_NAMES[k]}: {a[:, k].mean():.2f}, people {b[:, k].mean():.2f} ({apart[k]:+.1f})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="CMU_FOLDER", help="folder of the CMU clips, as .bvh")
    parser.add_argument("--network", type=Path, metavar="WEIGHTS.npz")
    options = parser.parse_args()
    clips = captured(options.folder)
    people = [np.concatenate(of_person) for of_person in clips]
    told_apart("generated clips", people, generated())
    for i, person in enumerate(REFERENCE):
        told_apart(f"the person {person}", [*people[:i], *people[i + 1 :]], clips[i], shown=0)
    if options.network:
        told_apart("the healthy character", people, figures(options.network))


if __name__ == "__main__":
    main()
