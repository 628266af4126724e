"""Fits the tables of `hobble.hurt.effects`: the limps of trained networks are to meet the goals of limp.json.

    python benchmarks/fit_limps.py CMU_FOLDER --generated WEIGHTS.npz ... --captured WEIGHTS.npz ...

The networks were trained with the tables of now: some on generated clips, some on clips of CMU_FOLDER. What
a network makes of its hurt versions differs from one training to the next by more than a small change of a
table does. So several networks together show what they have in common: with other tables, their limps are
taken to be those of now, plus what the tables change in hurt versions. Each entry is changed by itself to
find that out. Then a random search looks for the entries with which all networks meet all goals by the
largest margin. Prints the goals that a network would miss, before and after, and the new entries.

This holds for a few steps of an entry, since changes are only nearly proportional. After larger ones, run it
again on networks that were trained with the new tables.
"""

import argparse
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from derive_gait import REFERENCE
from limps import PARTS, SKELETONS, read

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import measure_clip
from hobble.gait.judge import Limp, area_under_curve, beyond_people
from hobble.gait.profile import LEFT, PROFILE_NAMES, RIGHT, Profile, measure_effects, profile_of_walk
from hobble.gait.recognise import grade_walk
from hobble.hurt import effects
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip
from hobble.measures.limp_goals import GOALS, GUARDINGS, LEG, USUAL, between_guardings, limp_values
from hobble.measures.limp_run import leg_limps, walk_figures
from hobble.models.load import load_network
from hobble.motion.skeleton_file import load_skeleton
from hobble.runtime import Runtime
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment

# Entry -> (step by which it is changed, least and greatest value). `step_ratio` is that of STEP_RATIO.
ENTRIES: dict[str, tuple[float, float, float]] = {
    "speed": (0.03, 0.55, 0.72), "stride": (0.04, 1, 1.35), "push": (0.1, 0.1, 1),
    "push_sound": (0.1, 0.05, 1), "vault": (0.2, 0, 1), "vault_sound": (0.2, 0, 1), "lift": (0.15, 0.2, 1.2),
    "lift_sound": (0.15, 0.15, 0.8),
    "crouch": (3, 0, 32), "out": (0.02, 0, 0.1), "off": (0.02, -0.12, 0.05), "off_sound": (0.02, -0.02, 0.1),
    "width": (0.025, -0.02, 0.09), "strike": (0.2, 0, 1), "list": (1.5, -4, 4), "forward": (2.5, -9, 4),
    "side": (2.5, -2, 8), "back": (0.2, 0.5, 1), "turn": (0.15, 0.2, 0.9), "step_ratio": (0.08, 0.12, 0.8),
}  # fmt: skip
MOST_STEPS = 2.0  # an entry moves by at most this many steps
CLIPS = 4  # captured clips, of different people, whose hurt versions show what an entry does
# A value is to be better than its goal by this much.
MARGIN: dict[str, float] = {
    "knee_sound": 0.05, "lift_sound": 0.1, "pelvis_turn": 1.0, "forward_guarding_1": 1.0,
    "forward_guarding_0": 1.0, "nearest": 0.1, "apart": 0.4, "strength_at_10": 0.5, "area": 0.12,
}  # fmt: skip
# Goals of limp.json from before (`measures.limp`): part -> effect -> greatest value, with a margin.
EARLIER: dict[str, dict[str, float]] = {
    "thigh": {"step_hurt": 0.6, "knee_hurt": 0.54},
    "shank": {"step_hurt": 0.6, "knee_hurt": 0.55},
    "foot": {"step_hurt": 0.6},
}
LEAST_LEAN, LEAST_STANCE = 3.4, 0.14  # of hip and thigh, degrees; of thigh, shank and foot, cycles
SURE = 3.0  # logarithm of how much likelier the recogniser finds a limp of the right side than anything else
STAY = 0.03  # how much a step away from the tables of now costs
Case = tuple[str, float]  # part and guarding
CASES: list[Case] = [(part, guarding) for part in LEG for guarding in (USUAL, *GUARDINGS)]


class Entry(NamedTuple):
    """An entry of a table, and how a step of it changes the profiles: kind of clip -> case -> (52,)."""

    part: str
    name: str
    now: float
    slopes: dict[str, dict[Case, Array]]


def clips(folder: Path, skeleton: Skeleton) -> dict[str, list[tuple[Clip, Labels]]]:
    """Kind -> healthy clips and their labels."""
    walk = walk_from_plan("generated", skeleton, [Segment("walk", 130, seconds=20)], 1200, "flat", 60, 1).clip
    source = {"source_frames": len(walk), "source_fps": walk.fps}
    generated = walk, label_clip(walk, [], source, "walk", "flat", LabelOptions())[0]
    people = [names[0] for names in REFERENCE.values()][:CLIPS]
    return {"generated": [generated], "captured": [read(folder, name) for name in people]}


def as_array(profile: Profile) -> Array:
    return np.array([profile[name] for name in PROFILE_NAMES])


def versions(some: Sequence[tuple[Clip, Labels]], part: str) -> dict[Case, Array]:
    """The mean profile of the hurt versions of some clips, for each guarding."""
    found: dict[Case, Array] = {}
    for _, guarding in (case for case in CASES if case[0] == part):
        profiles = []
        for clip, labels in some:
            hurt = np.zeros((len(clip), len(clip.skeleton.links)))
            hurt[:, clip.skeleton.link_names.index(PARTS[part])] = 10.0
            version = hurt_clip(clip, labels, hurt, guarding=guarding).clip
            profiles.append(as_array(profile_of_walk(measure_clip(version))))
        found[part, guarding] = np.mean(profiles, axis=0)
    return found


def table_of(part: str, name: str) -> tuple[dict[str, float], str]:
    """The table that has an entry, and its key there."""
    return (effects.STEP_RATIO, part) if name == "step_ratio" else (effects.ADDED_CHANGES[part], name)


def entries(sources: Mapping[str, list[tuple[Clip, Labels]]]) -> Iterator[Entry]:
    for part in LEG:
        before = {kind: versions(some, part) for kind, some in sources.items()}
        for name, (step, _, _) in ENTRIES.items():
            table, key = table_of(part, name)
            if key not in table:
                continue
            now = table[key]
            table[key] = now + step
            effects.changes_of_hurt_part.cache_clear()
            after = {kind: versions(some, part) for kind, some in sources.items()}
            table[key] = now
            effects.changes_of_hurt_part.cache_clear()
            slopes = {
                kind: {case: after[kind][case] - profile for case, profile in of_kind.items()}
                for kind, of_kind in before.items()
            }
            yield Entry(part, name, now, slopes)


def limps_of(weights: Path) -> list[Limp]:
    """The limps of the right side at severity 10."""
    network = load_network(weights)
    injuries = [{}, *({link: 10.0} for link in PARTS.values())]
    crowd = walk_figures(network, [{"injury": injury} for injury in injuries], "walk", 20.0, Runtime())
    return leg_limps(network, crowd, 20.0, Runtime())[RIGHT]


def moved(limps: Sequence[Limp], kind: str, table: Sequence[Entry], steps: Array) -> list[Limp]:
    """The limps with other tables. steps: (n,) by how many steps each entry differs from now."""
    out = []
    for limp in limps:
        profile = as_array(limp.walk)
        for entry, amount in zip(table, steps, strict=True):
            if entry.part == limp.part:
                profile = profile + amount * entry.slopes[kind][limp.part, limp.guarding]
        walk = dict(zip(PROFILE_NAMES, profile.tolist(), strict=True))
        out.append(Limp(limp.part, limp.severity, limp.guarding, walk, limp.healthy))
    return out


def sureness(limp: Limp) -> float:
    """Logarithm of the odds that the recogniser finds a limp, and not of the other side."""
    kinds = grade_walk(limp.walk, limp.healthy).probability_by_side
    right = sum(share for (_, side), share in kinds.items() if side != LEFT)
    return float(np.log(max(right, 1e-9)) - np.log(max(1 - right, 1e-9)))


def shortfalls(limps: Sequence[Limp]) -> dict[str, float]:
    """Row -> by how many margins a network falls short of its goal and margin, squared; 0: by none."""
    usual = [limp for limp in limps if limp.guarding == USUAL]
    values = {**limp_values(limps), "area": [area_under_curve(between_guardings(limps))]}
    out = {}
    for row, margin in MARGIN.items():
        least, most = GOALS[row]
        worst = (max(least + margin - value, value - most + margin) / margin for value in values[row])
        out[row] = sum(max(0.0, each) ** 2 for each in worst)
    beyond = [abs(each.by) - 0.8 for each in beyond_people(between_guardings(limps))]
    out["beyond_people"] = sum(max(0.0, each / 0.4) ** 2 for each in beyond)
    out["named"] = sum(max(0.0, SURE - sureness(limp)) ** 2 for limp in usual)
    earlier = []
    for limp in usual:
        found = measure_effects(limp.walk, limp.healthy)
        earlier += [(found[name] - most) / 0.03 for name, most in EARLIER.get(limp.part, {}).items()]
        if limp.part in ("hip", "thigh"):
            earlier.append((LEAST_LEAN - found["lean"]) / 0.5)
        if limp.part != "hip":
            earlier.append((LEAST_STANCE - found["stance"]) / 0.04)
    out["earlier goals"] = sum(max(0.0, each) ** 2 for each in earlier)
    return out


def search(networks: Sequence[tuple[str, list[Limp]]], table: Sequence[Entry], minutes: float) -> Array:
    """(n,) the best steps that a random search finds."""
    limits = np.array([ENTRIES[entry.name] for entry in table])
    now = np.array([entry.now for entry in table])
    least, most = ((limits[:, k] - now) / limits[:, 0] for k in (1, 2))
    least, most = np.clip(least, -MOST_STEPS, 0), np.clip(most, 0, MOST_STEPS)

    def cost(steps: Array) -> float:
        falls = (shortfalls(moved(limps, kind, table, steps)).values() for kind, limps in networks)
        return sum(map(sum, falls)) + STAY * float(steps @ steps)

    rng, best, until = np.random.default_rng(1), np.zeros(len(table)), time.monotonic() + 60 * minutes
    lowest = cost(best)
    while time.monotonic() < until:
        changes = rng.random(len(table)) < rng.integers(1, 5) * 3 / len(table)
        trial = np.clip(best + changes * rng.normal(size=len(table)) * rng.choice([0.3, 1.0]), least, most)
        if (found := cost(trial)) < lowest:
            best, lowest = trial, found
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="CMU_FOLDER", help="folder of the CMU clips, as .bvh")
    for kind in ("generated", "captured"):
        help_text = f"networks that learnt from {kind} clips"
        parser.add_argument(
            f"--{kind}", type=Path, nargs="+", default=[], metavar="WEIGHTS.npz", help=help_text
        )
    parser.add_argument("--minutes", type=float, default=5.0, help="of the search (default: 5)")
    options = parser.parse_args()
    files = [(kind, file) for kind in ("generated", "captured") for file in getattr(options, kind)]
    if not files:
        parser.error("name at least one network with --generated or --captured")
    networks = [(kind, limps_of(file)) for kind, file in files]
    sources = clips(options.folder, load_skeleton(SKELETONS / "holden31.yaml").skeleton)
    table = list(entries({kind: some for kind, some in sources.items() if kind in dict(files)}))
    steps = search(networks, table, options.minutes)
    for title, at in (("now", np.zeros(len(table))), ("fitted", steps)):
        print(f"{title}: shortfall of each row")
        for (kind, limps), (_, file) in zip(networks, files, strict=True):
            short = {
                row: fall for row, fall in shortfalls(moved(limps, kind, table, at)).items() if fall > 0.01
            }
            print(f"  {file}: {', '.join(f'{row} {fall:.1f}' for row, fall in short.items()) or 'none'}")
    print("entries: now, fitted")
    for entry, amount in zip(table, steps, strict=True):
        if abs(amount) > 0.1:
            fitted = entry.now + amount * ENTRIES[entry.name][0]
            print(f"  {entry.part} {entry.name}: {entry.now:g}, {fitted:.3g}")


if __name__ == "__main__":
    main()
