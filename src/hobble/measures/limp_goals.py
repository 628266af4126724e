"""Judges the limps of a hurt hip, thigh, shank and foot, right and left, against goals from real people.

Lengths of lists: one entry for each of these parts, or for each of PAIRS.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from hobble.gait.judge import Limp, area_under_curve, beyond_people, counted_of_people, most_of_people
from hobble.gait.profile import measure_effects
from hobble.gait.recognise import SIDES
from hobble.measures.walks import mean_of_known

LEG = ("hip", "thigh", "shank", "foot")  # parts of the body that belong to a leg
PAIRS = (("hip", "thigh"), ("thigh", "shank"), ("thigh", "foot"), ("shank", "foot"))
USUAL = 0.6  # guarding, if nothing else is said
GUARDINGS = (0.0, 0.4, 0.8, 1.0)  # at severity 10, besides USUAL
# Limps with a guarding in between are compared with those of the ten people, who guarded a little.
LEAST_GUARDING, MOST_GUARDING = 0.4, 0.8
NEVER = float("inf")
# Row -> least and greatest value that meets the goal. The distance .8 is that between two limps of the ten
# people, the strength 6.4 that of their strongest kind of limp.
GOALS: dict[str, tuple[float, float]] = {
    "knee_sound": (-NEVER, 0.95),
    "lift_sound": (-NEVER, 0.9),
    "pelvis_turn": (-NEVER, 1),
    "forward_guarding_1": (15, 30),
    "forward_guarding_0": (-NEVER, 8),
    "nearest": (-NEVER, 0.8),
    "apart": (2.5, NEVER),
    "strength_at_3": (1.8, NEVER),
    "strength_at_10": (-NEVER, 6.4),
    "area": (-NEVER, 0.75),
    "beyond_people": (-NEVER, 0),
    "named_at_3": (0.6, NEVER),
    "named_at_5": (0.95, NEVER),
    "named_at_10": (1, NEVER),
    "wrong_side": (-NEVER, 0),
}


def judge_limps(limps: Mapping[str, Sequence[Limp]], sizes: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The keys `goals`, `beyond` and `left_out` of limp.json.

    limps: side -> the walks in which this leg hurts, at all severities and USUAL guarding and at severity 10
    with GUARDINGS; those of the left leg are mirrored. sizes: `sizes` of limp.json.
    """
    rows = [row for row in sizes if row["gait"] == "walk" and row["part"] in LEG]
    compared = {side: between_guardings(some) for side, some in limps.items()}
    beyond = {side: beyond_people(some) if some else [] for side, some in compared.items()}
    values = {
        side: {
            **limp_values(limps[side]),
            "area": [area_under_curve(compared[side])] if len({o.part for o in compared[side]}) > 1 else [],
            "beyond_people": [float(sum(each.counts for each in beyond[side]))] if compared[side] else [],
            **_recognised([row for row in rows if row["side"] == side]),
        }
        for side in SIDES
    }
    goals = []
    for name, (least, most) in GOALS.items():
        of_sides = {side: [round(value, 5) for value in values[side][name]] for side in SIDES}
        every = [value for some in of_sides.values() for value in some]
        met = all(least <= value <= most for value in every) if every else None
        limits = {"least": least, "most": most}
        known = {key: limit if abs(limit) < NEVER else None for key, limit in limits.items()}
        goals.append({"row": name, **known, **of_sides, "met": met})
    counted = counted_of_people()
    return {
        "goals": goals,
        "beyond": [{"side": side, **asdict(each)} for side, some in beyond.items() for each in some],
        "left_out": {"by": most_of_people(), "features": counted.tolist()},
    }


def between_guardings(limps: Iterable[Limp]) -> list[Limp]:
    """The limps at severity 10 that are compared with those of the ten people."""
    return [o for o in limps if o.severity == 10 and LEAST_GUARDING <= o.guarding <= MOST_GUARDING]


def limp_values(limps: Iterable[Limp]) -> dict[str, list[float]]:
    """The rows of GOALS that need no classifier; lists are shorter if there are no limps of some part."""
    found = {(limp.part, limp.severity, limp.guarding): limp for limp in limps}

    def each(measure: Callable[[Limp], float], severity: float = 10.0, guard: float = USUAL) -> list[float]:
        cases = ((part, severity, guard) for part in LEG)
        return [float(measure(found[case])) for case in cases if case in found]

    def effect(name: str) -> Callable[[Limp], float]:
        return lambda limp: measure_effects(limp.walk, limp.healthy)[name]

    strongest = {part: found[part, 10.0, USUAL] for part in LEG if (part, 10.0, USUAL) in found}
    lift, turn = "range ankle_height_L", "range pelvis_turn_left"
    return {
        "knee_sound": each(effect("knee_sound")),
        "lift_sound": each(lambda limp: limp.walk[lift] / limp.healthy[lift]),
        "pelvis_turn": each(lambda limp: limp.walk[turn] - limp.healthy[turn]),
        "forward_guarding_1": each(effect("lean_forward"), guard=1.0),
        "forward_guarding_0": each(effect("lean_forward"), guard=0.0),
        "nearest": each(lambda limp: limp.nearest),
        "apart": [strongest[a].apart(strongest[b]) for a, b in PAIRS if {a, b} <= set(strongest)],
        "strength_at_3": each(lambda limp: limp.strength, 3.0),
        "strength_at_10": each(lambda limp: limp.strength),
    }


def _recognised(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    """Shares of windows, means over the walks in which one leg hurts."""
    at = {
        f"named_at_{severity:g}": mean_of_known(row["named"] for row in rows if row["severity"] == severity)
        for severity in (3.0, 5.0, 10.0)
    }
    at["wrong_side"] = mean_of_known(row["wrong_side"] for row in rows)
    return {name: [] if value is None else [value] for name, value in at.items()}
