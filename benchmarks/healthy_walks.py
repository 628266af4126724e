"""How well healthy walks of the generated walker and of a network's character are told from captured ones.

    python benchmarks/healthy_walks.py CMU_FOLDER [--network WEIGHTS.npz]

A linear classifier has the 52 numbers of a profile (`hobble.gait.profile`) of windows of 4 s, all on the
skeleton holden31. Each person and each figure is left out of its training in turn. Prints the area under the
curve (.5: cannot tell), and the numbers in which the two differ most. For comparison, the same of each person
beside the others. And how people, walker and character move (`MANNER`; the character without variation).
"""

import argparse
import itertools
from pathlib import Path

import numpy as np
from derive_gait import OTHERS, REFERENCE, parts
from limps import read

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import WalkCycles, measure_cycles
from hobble.gait.profile import PROFILE_NAMES, mirror_profile, profile_of_walk
from hobble.gait.recognise import SHRINKAGE, learn, windows_with_cycles
from hobble.measures.motion_quality import cleanness, joint_update
from hobble.measures.walks import bend
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.motion.skeleton_file import load_skeleton
from hobble.runtime.animation import ProceduralAnimation
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment

SPEEDS = (1.5, 1.75, 2.0, 2.25, 2.5)  # cm a frame, of the figures
SECONDS = 30
SKELETON = Path("config/skeletons/holden31.yaml")
# In a cycle: largest minus smallest forward speed of the hips over their mean, range of the head's pitch and
# of the elbow, rise of a toe. In a frame: turn of a joint in the world, and how far a standing toe skates.
MANNER = ("speed", "nod", "elbow", "toe, cm", "turn", "skates, cm")


def profiles(walks: list[list[WalkCycles]]) -> Array:
    """(N, 52) profiles, and their mirror images. walks: the cycles in the windows of each clip."""
    found = [profile_of_walk(part) for of_clip in walks for part in of_clip]
    both = [*found, *map(mirror_profile, found)]
    return np.array([[profile[name] for name in PROFILE_NAMES] for profile in both])


def captured(folder: Path) -> list[list[Clip]]:
    """The clips of each person."""
    return [[read(folder, name)[0] for name in REFERENCE[who] + OTHERS[who]] for who in REFERENCE]


def manner(skeleton: Skeleton, positions: Array, rotations: Array) -> list[float]:
    """The numbers of MANNER. positions: (F, J, 3). rotations: (F, J, 4), both in the world."""
    at = {role: positions[:, skeleton.role(role)].astype(float) for role in skeleton.roles}
    steps, head = np.diff(at["hips"][:, ::2], axis=0), rotations[:, skeleton.role("head")].astype(float)
    nod = np.degrees(np.arcsin(quat.rotate(head, np.array([0.0, 0.0, 1.0]))[:, 1]))
    elbow = bend(*(at[f"right_{joint}"] for joint in ("shoulder", "elbow", "wrist")))
    of_cycles = []
    for cycle in measure_cycles(skeleton, positions).right:
        s = slice(cycle.start, cycle.end)
        travel = steps[s].sum(axis=0) / np.linalg.norm(steps[s].sum(axis=0))
        speed, toe = steps[s] @ travel, at["right_toe"][s, 1]
        of_cycles.append((np.ptp(speed) / speed.mean(), np.ptp(nod[s]), np.ptp(elbow[s]), np.ptp(toe)))
    slid = cleanness(skeleton, positions, rotations)["skating_toes"]
    return [*np.median(of_cycles, axis=0).tolist(), joint_update(rotations.astype(float)), slid]


def manner_of(clip: Clip) -> list[float]:
    """The numbers of MANNER of a clip."""
    return manner(clip.skeleton, clip.positions, clip.global_rotations)


def print_manners(moves: dict[str, list[list[float]]]) -> None:
    """Print a line for each name: the lowest and the highest of each number of MANNER."""
    print(f"{'':24}" + "".join(f"{name:>15}" for name in MANNER))
    for name, rows in moves.items():
        ends = zip(np.min(rows, axis=0), np.max(rows, axis=0), strict=True)
        cells = (f"{low:.2f} to {high:.2f}" if len(rows) > 1 else f"{low:.2f}" for low, high in ends)
        print(f"{name:24}" + "".join(f"{cell:>15}" for cell in cells))


def generated() -> list[Clip]:
    """Clips of the generated walker, one for each speed."""
    skeleton, frames = load_skeleton(SKELETON).skeleton, SECONDS * 60
    plans = [[Segment("walk", 60 * speed, seconds=SECONDS)] for speed in SPEEDS]
    return [walk_from_plan(f"w{i}", skeleton, p, frames, "flat", 60, i).clip for i, p in enumerate(plans)]


def figures(network: Network, variation: float) -> tuple[Array, Array]:
    """Positions (F, C, J, 3) and rotations (F, C, J, 4) in the world of healthy characters at C speeds."""
    character = ProceduralAnimation(network, characters=len(SPEEDS), variation=variation)
    targets = np.column_stack([np.zeros(len(SPEEDS)), SPEEDS])
    poses = [character.next_pose(targets, gait="walk") for _ in range((5 + SECONDS) * 60)][300:]
    return np.array([pose.positions for pose in poses]), np.array([pose.rotations for pose in poses])


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
    of_people, walker = captured(options.folder), generated()
    clips = [[profiles([parts(clip)]) for clip in of_person] for of_person in of_people]
    people = [np.concatenate(of_person) for of_person in clips]
    told_apart("generated clips", people, [profiles([parts(clip)]) for clip in walker])
    for i, person in enumerate(REFERENCE):
        told_apart(f"the person {person}", [*people[:i], *people[i + 1 :]], clips[i], shown=0)
    persons = zip(REFERENCE, of_people, strict=True)
    moves = {f"the person {person}": [manner_of(c) for c in of_person] for person, of_person in persons}
    moves |= {f"walker, {0.6 * v:.2f} m/s": [manner_of(c)] for v, c in zip(SPEEDS, walker, strict=True)}
    if options.network:
        network = load_network(options.network)
        skeleton = network.skeleton
        assert skeleton is not None
        positions, _ = figures(network, 1.0)
        walks = [measure_cycles(skeleton, positions[:, i]) for i in range(len(SPEEDS))]
        windows = [[p for _, p in windows_with_cycles(walk, len(positions))] for walk in walks]
        told_apart("the healthy character", people, [profiles([each]) for each in windows])
        positions, rotations = figures(network, 0.0)
        for i, v in enumerate(SPEEDS):
            moves[f"character, {0.6 * v:.2f} m/s"] = [manner(skeleton, positions[:, i], rotations[:, i])]
    print_manners(moves)


if __name__ == "__main__":
    main()
