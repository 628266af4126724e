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
from hobble.measures.motion_quality import FOOT_POINTS, joints_with, skating, standing_heights
from hobble.measures.walks import bend
from hobble.models.load import load_network
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
    feet = positions[:, joints_with(skeleton, FOOT_POINTS)].astype(float)
    slid = skating(feet, standing_heights(feet))[:, 1::2].mean()
    turn = np.degrees(quat.angle(rotations[:-1].astype(float), rotations[1:].astype(float))).mean()
    return [*np.median(of_cycles, axis=0).tolist(), float(turn), float(slid)]


def generated() -> list[Clip]:
    """Clips of the generated walker, one for each speed."""
    skeleton, frames = load_skeleton(SKELETON).skeleton, SECONDS * 60
    plans = [[Segment("walk", 60 * speed, seconds=SECONDS)] for speed in SPEEDS]
    return [walk_from_plan(f"w{i}", skeleton, p, frames, "flat", 60, i).clip for i, p in enumerate(plans)]


def figures(weights: Path, variation: float) -> tuple[Skeleton, Array, Array]:
    """The skeleton of a network's healthy character, its positions (F, C, J, 3) and rotations (F, C, J, 4) in
    the world, at C speeds.
    """
    network = load_network(weights)
    character = ProceduralAnimation(network, characters=len(SPEEDS), variation=variation)
    targets = np.column_stack([np.zeros(len(SPEEDS)), SPEEDS])
    poses = [character.next_pose(targets, gait="walk") for _ in range((5 + SECONDS) * 60)][300:]
    assert network.skeleton is not None
    positions, rotations = (
        np.array([getattr(p, name) for p in poses]) for name in ("positions", "rotations")
    )
    return network.skeleton, positions, rotations


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
    moves = {
        f"the person {person}": [manner(c.skeleton, c.positions, c.global_rotations) for c in of_person]
        for person, of_person in zip(REFERENCE, of_people, strict=True)
    }
    for speed, clip in zip(SPEEDS, walker, strict=True):
        moves[f"walker, {0.6 * speed:.2f} m/s"] = [
            manner(clip.skeleton, clip.positions, clip.global_rotations)
        ]
    if options.network:
        skeleton, positions, _ = figures(options.network, 1.0)
        walks = [measure_cycles(skeleton, positions[:, i]) for i in range(len(SPEEDS))]
        windows = [[p for _, p in windows_with_cycles(walk, len(positions))] for walk in walks]
        told_apart("the healthy character", people, [profiles([each]) for each in windows])
        _, positions, rotations = figures(options.network, 0.0)
        for i, speed in enumerate(SPEEDS):
            of_figure = manner(skeleton, positions[:, i], rotations[:, i])
            moves[f"character, {0.6 * speed:.2f} m/s"] = [of_figure]
    print(f"{'':24}" + "".join(f"{name:>15}" for name in MANNER))
    for name, rows in moves.items():
        ends = zip(np.min(rows, axis=0), np.max(rows, axis=0), strict=True)
        cells = (f"{low:.2f} to {high:.2f}" if len(rows) > 1 else f"{low:.2f}" for low, high in ends)
        print(f"{name:24}" + "".join(f"{cell:>15}" for cell in cells))


if __name__ == "__main__":
    main()
