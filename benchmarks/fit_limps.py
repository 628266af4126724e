"""Fits the tables of `hobble.hurt.effects`: the limps of trained networks are to meet the goals of limp.json.

    python benchmarks/fit_limps.py CMU_FOLDER --generated WEIGHTS.npz ... --captured WEIGHTS.npz ...

The networks were trained with the tables of now: some on generated clips, some on clips of CMU_FOLDER. What
a network makes of its hurt versions differs from one training to the next by more than a small change of a
table does. So several networks together show what they have in common: with other tables, their limps are
taken to be those of now, plus what the tables change in hurt versions. Each entry is changed by itself to
find that out. Then a random search looks for the entries with which all networks meet all goals by the
largest margin. Prints what each network falls short of, before and after, and the new entries.

This holds for a few steps of an entry, since changes are only nearly proportional. After larger ones, run it
again on networks that were trained with the new tables.
"""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from derive_gait import REFERENCE
from limps import PARTS, generated_walk, hurt_walk, read

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.gait.judge import Limp, area_under_curve, beyond_people
from hobble.gait.profile import LEFT, PROFILE_NAMES, RIGHT, Profile, measure_effects
from hobble.gait.recognise import grade_walk
from hobble.hurt import effects
from hobble.labels.clip_labels import Labels
from hobble.measures.limp_goals import GOALS, GUARDINGS, LEG, USUAL, between_guardings, limp_values
from hobble.measures.limp_run import leg_limps, walk_figures
from hobble.models.load import load_network
from hobble.runtime import Runtime

# Entry -> (step by which it is changed, least and greatest value). `step_ratio` is that of STEP_RATIO.
ENTRIES: dict[str, tuple[float, float, float]] = {
    "speed": (0.03, 0.55, 0.72), "stride": (0.04, 1, 1.35), "push": (0.1, 0.1, 1),
    "push_sound": (0.1, 0.05, 1), "vault": (0.2, 0, 1), "vault_sound": (0.2, 0, 1), "lift": (0.15, 0.2, 1.2),
    "lift_sound": (0.15, 0.15, 0.8),
    "crouch": (3, 0, 32), "out": (0.02, 0, 0.1), "off": (0.02, -0.16, 0.05), "off_sound": (0.02, -0.02, 0.1),
    "land_sound": (0.02, -0.16, 0.1),
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
Sources = Mapping[str, Sequence[tuple[Clip, Labels]]]  # kind -> healthy clips and their labels


class Entry(NamedTuple):
    """An entry of a table. now: its value."""

    part: str
    name: str
    now: float


def as_array(profile: Profile) -> Array:
    return np.array([profile[name] for name in PROFILE_NAMES])


def versions(sources: Sources, part: str) -> dict[tuple[str, Case], Array]:
    """(kind, case) -> the mean profile (52,) of the hurt versions of its clips, for each guarding."""
    return {
        (kind, (part, guarding)): np.mean(
            [as_array(hurt_walk(*source, part, 10.0, guarding)) for source in some], axis=0
        )
        for kind, some in sources.items()
        for guarding in (USUAL, *GUARDINGS)
    }


def table_of(part: str, name: str) -> tuple[dict[str, float], str]:
    """The table that has an entry, and its key there."""
    return (effects.STEP_RATIO, part) if name == "step_ratio" else (effects.ADDED_CHANGES[part], name)


def entries_and_slopes(sources: Sources) -> tuple[list[Entry], dict[tuple[str, Case], Array]]:
    """The n entries, and (kind, case) -> (n, 52): how a step of each entry changes the profile."""
    entries: list[Entry] = []
    changes: list[dict[tuple[str, Case], Array]] = []
    for part in LEG:
        before = versions(sources, part)
        for name, (step, _, _) in ENTRIES.items():
            table, key = table_of(part, name)
            if key not in table:
                continue
            entries.append(Entry(part, name, table[key]))
            table[key] += step
            effects.changes_of_hurt_part.cache_clear()
            after = versions(sources, part)
            table[key] = entries[-1].now
            effects.changes_of_hurt_part.cache_clear()
            changes.append({which: after[which] - profile for which, profile in before.items()})
    unchanged = np.zeros(len(PROFILE_NAMES))
    every = dict.fromkeys(which for change in changes for which in change)
    return entries, {which: np.array([change.get(which, unchanged) for change in changes]) for which in every}


def limps_of(weights: Path) -> list[Limp]:
    """The limps of the right side at severity 10."""
    network = load_network(weights)
    injuries = [{}, *({link: 10.0} for link in PARTS.values())]
    crowd = walk_figures(network, [{"injury": injury} for injury in injuries], "walk", 20.0, Runtime())
    return leg_limps(network, crowd, 20.0, Runtime())[RIGHT]


def moved(
    limps: Sequence[Limp], kind: str, slopes: Mapping[tuple[str, Case], Array], steps: Array
) -> list[Limp]:
    """The limps with other tables. steps: (n,) by how many steps each entry differs from now."""
    out = []
    for limp in limps:
        profile = as_array(limp.walk) + steps @ slopes[kind, (limp.part, limp.guarding)]
        out.append(replace(limp, walk=dict(zip(PROFILE_NAMES, profile.tolist(), strict=True))))
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


def search(entries: Sequence[Entry], cost: Callable[[Array], float], minutes: float) -> Array:
    """(n,) the steps with the lowest cost that a random search finds."""
    limits = np.array([ENTRIES[entry.name] for entry in entries])
    now = np.array([entry.now for entry in entries])
    least, most = ((limits[:, k] - now) / limits[:, 0] for k in (1, 2))
    least, most = np.clip(least, -MOST_STEPS, 0), np.clip(most, 0, MOST_STEPS)

    rng, best, until = np.random.default_rng(1), np.zeros(len(entries)), time.monotonic() + 60 * minutes
    lowest = cost(best)
    while time.monotonic() < until:
        changes = rng.random(len(entries)) < rng.integers(1, 5) * 3 / len(entries)
        trial = np.clip(best + changes * rng.normal(size=len(entries)) * rng.choice([0.3, 1.0]), least, most)
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
    networks = [(kind, file, limps_of(file)) for kind, file in files]
    people = [names[0] for names in REFERENCE.values()][:CLIPS]
    sources: dict[str, list[tuple[Clip, Labels]]] = {}
    if options.generated:
        sources["generated"] = [generated_walk()]
    if options.captured:
        sources["captured"] = [read(options.folder, name) for name in people]
    entries, slopes = entries_and_slopes(sources)

    def short(kind: str, limps: Sequence[Limp], steps: Array) -> dict[str, float]:
        return shortfalls(moved(limps, kind, slopes, steps))

    def cost(steps: Array) -> float:
        falls = (sum(short(kind, limps, steps).values()) for kind, _, limps in networks)
        return sum(falls) + STAY * float(steps @ steps)

    steps = search(entries, cost, options.minutes)
    for title, at in (("now", np.zeros(len(entries))), ("fitted", steps)):
        print(f"{title}: shortfall of each row")
        for kind, file, limps in networks:
            falls = [f"{row} {fall:.1f}" for row, fall in short(kind, limps, at).items() if fall > 0.01]
            print(f"  {file}: {', '.join(falls) or 'none'}")
    print("entries: now, fitted")
    for entry, amount in zip(entries, steps, strict=True):
        if abs(amount) > 0.1:
            fitted = entry.now + amount * ENTRIES[entry.name][0]
            print(f"  {entry.part} {entry.name}: {entry.now:g}, {fitted:.3g}")


if __name__ == "__main__":
    main()
