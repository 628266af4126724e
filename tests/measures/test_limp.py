"""Sizes of limps: of a known limp, of none, and of one on the wrong side."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hobble.gait.cycles import CURVES, SCALARS, Cycle, WalkCycles
from hobble.gait.profile import GAITS, NORMAL, PROFILE_NAMES, mean_curves, mirror_profile, read_people
from hobble.measures import limp_run as module
from hobble.measures.limp import _goal, gallery_chart
from hobble.measures.limp_run import SEVERITIES, Walk, imitated_walks, measure_limps
from hobble.measures.walks import spearman
from hobble.runtime import Runtime

LEFT_KNEE, RIGHT_KNEE = "LeftUpLeg-LeftLeg", "RightUpLeg-RightLeg"
FRAMES = 480
POSES = np.arange(24.0)[:, None, None] * np.ones((24, 31, 3))  # of all mean cycles


def cycles_of(values: Mapping[str, float]) -> tuple[Cycle, ...]:
    """Cycles with these numbers of a profile."""
    ramp = np.linspace(-0.5, 0.5, 50)  # of range 1 and mean 0
    curves = np.array([values[f"mean {name}"] + values[f"range {name}"] * ramp for name in CURVES])
    scalars = {name: values[name] for name in SCALARS}
    return tuple(Cycle(start, start + 70, scalars, curves) for start in range(0, FRAMES - 70, 70))


def walking(limp: dict[str, float], speed: float, injury: dict[str, float] | None = None) -> Walk:
    """A figure that walks like people and limps on one side, by a share of the limp of people with pain in
    the right leg.
    """
    strength, people = max(limp.values(), default=0.0), read_people()

    def mixed(name: str) -> float:
        usual, full = (np.mean([person[gait][name] for person in people]) for gait in (NORMAL, "antalgic"))
        return float((1 - strength) * usual + strength * full)

    values = {name: mixed(name) for name in PROFILE_NAMES}
    sides = cycles_of(values), cycles_of(mirror_profile(values))
    walk = WalkCycles(60.0, *(sides[::-1] if "left" in limp else sides))
    return Walk(injury or {}, walk, POSES, "", speed, FRAMES)


@pytest.fixture
def measure(hurtable, monkeypatch):
    """measure(effect): limp.json of a character whose limp at a severity is `effect(severity)` of people's
    limp.
    """

    def run(effect, other_side: bool = False, every: Sequence[Walk] = (), splits=None) -> dict[str, Any]:
        def walk_figures(network, cases, gait, seconds, runtime):
            out = []
            for injury in (case.get("injury", {}) for case in cases):
                amount = {"left" if (link == LEFT_KNEE) != other_side else "right": effect(s)
                          for link, s in injury.items()}  # fmt: skip
                speed = module.SPEEDS[gait] * (1 - 0.5 * max(amount.values(), default=0.0))
                out.append(walking(amount, speed, injury))
            return out

        monkeypatch.setattr(module, "walk_figures", walk_figures)
        options = {"configuration": "x", "runtime": Runtime(), "seconds": 8.0}
        return measure_limps(hurtable, every, splits or {}, links=[LEFT_KNEE, RIGHT_KNEE], **options)

    return run


def test_effects_grow_with_severity_and_are_alike_on_both_sides(measure) -> None:
    found = measure(lambda s: 0.1 * s)
    rows = [row for row in found["sizes"] if row["gait"] == "walk"]
    assert [row["severity"] for row in rows] == 2 * list(SEVERITIES)
    rows = [row for row in rows if row["side"] == "right"]  # people's normal walks are not quite even
    full = rows[-1]
    assert full["knee_hurt"] < 0.5
    assert full["stance"] > 0.15
    for row in rows:
        share = 0.1 * row["severity"]
        assert row["knee_hurt"] == pytest.approx(1 - share * (1 - full["knee_hurt"]), abs=0.05)
        assert row["stance"] == pytest.approx(share * full["stance"], abs=0.01)
        assert row["speed_share"] == pytest.approx(1 - 0.05 * row["severity"])
    last = found["named"][-1]
    assert last["severity"] == 10
    assert last["named"] == 1
    assert last["wrong_side"] == 0
    json.dumps(found, allow_nan=False)


def test_a_change_of_two_percent_correlates_fully_but_is_not_recognised(measure) -> None:
    """The rank correlation of an effect, and its size at 10."""
    found = measure(lambda s: 0.002 * s)
    knee = [row["knee_hurt"] for row in found["sizes"] if (row["gait"], row["side"]) == ("walk", "left")]
    assert spearman(SEVERITIES, knee) == pytest.approx(-1)
    assert 0.95 < knee[-1] < 1
    assert [row["named"] for row in found["named"]] == [0, 0, 0, 0]
    assert all(row["graded"] == "normal" for row in found["sizes"] if row["gait"] == "walk")


def clip(name: str, hurt: dict[str, float], limp: dict[str, float]) -> Walk:
    return replace(walking(limp, 2.0, hurt), clip=name)


def test_a_held_out_limp_is_nearer_only_if_the_same_leg_is_hurt(measure) -> None:
    hurt, limp = {RIGHT_KNEE: 8.0}, {"right": 0.8}
    every, splits = (clip("7_1", {}, {}), *(clip(f"7_{n}", hurt, limp) for n in "23")), {"7_2": "held_out"}
    (row,) = measure(lambda s: 0.1 * s, every=every, splits=splits)["held_out_limps"]
    assert (row["clip"], row["compared_with"], row["nearer"]) == ("7_2", "performer", True)
    assert row["hurt"] < 0.3 * row["healthy"]
    assert not measure(lambda s: 0.1 * s, True, every, splits)["held_out_limps"][0]["nearer"]
    assert not measure(lambda s: 0.0, False, every, splits)["held_out_limps"][0]["nearer"]


def test_captured_limps_stand_beside_the_character_with_their_injury(measure, holden31) -> None:
    """Held-out clips first, no mirrors, at most six; then the ten people's walks are not needed."""
    names = [*(f"8_{n}" for n in range(8)), "7_1", "7_1_mirror"]
    every = [clip(name, {RIGHT_KNEE: 8.0}, {}) for name in names]
    found = measure(lambda s: 0.0, every=every, splits={"7_1": "held_out"})
    rows = found["gallery"]
    assert found["imitated"] == []
    assert [row["clip"] for row in rows] == ["7_1", "8_0", "8_1", "8_2", "8_3", "8_4"]
    assert rows[0]["poses"]["captured"] == POSES[::3].tolist()
    assert {np.shape(poses) for poses in rows[0]["poses"].values()} == {(8, 31, 3)}
    chart = gallery_chart({"gallery": rows[:1]}, holden31.to_dict())
    assert list(chart.options) == [f"7_1 ({RIGHT_KNEE} 8), from {view}" for view in ("the side", "behind")]


def test_without_captured_limps_six_walks_of_people_stand_beside_the_character(measure) -> None:
    """It has people's pain in the thigh, and no other part of it hurts."""
    found = measure(lambda s: 0.1 * s)
    for character in (row["curves"]["character"] for row in found["imitated"][:2]):  # with another zero
        character["trunk_forward"] = np.add(character["trunk_forward"], 30.0)
    charts = gallery_chart(found, {}).charts
    hurt = [f"{name}; hurt: {RIGHT_KNEE}" for name in ("antalgic (pain)", "stiff-legged")]
    for chart in charts:
        assert len(chart.options) == 6
        for walk, traces in chart.options.items():
            assert [t["name"] for t in traces] == ["people", *["hurt"] * (walk in hurt), "healthy"]
    knee, lean = mean_curves()[NORMAL]["knee_flexion_R"], charts[4].options[hurt[0]]
    assert charts[0].options["normal walk"][0]["y"] == pytest.approx(knee - knee.mean(), abs=0.11)
    assert [np.mean(trace["y"]) for trace in lean] == pytest.approx([5.1, 5.1, 0.0], abs=0.2)


def test_beside_people_is_the_nearest_limp_of_a_fitting_right_part_at_severity_10(hurtable) -> None:
    left, shank = "LeftLeg-LeftFoot", "RightLeg-RightFoot"
    hurt = [(0.4, RIGHT_KNEE, 10.0), (1.0, shank, 7.0), (0.8, shank, 10.0), (1.0, left, 10.0)]
    crowd = [walking({"right": share}, 2.0, {link: severity}) for share, link, severity in hurt]
    rows = {row["gait"]: row for row in imitated_walks(hurtable.skeleton, [walking({}, 2.0), *crowd])}
    assert [rows[gait]["hurt"] for gait in GAITS] == [{}, {shank: 10.0}, {RIGHT_KNEE: 10.0}, {}, {}, {}]
    assert rows["antalgic"]["from_hurt"] == pytest.approx(0.2 * rows["antalgic"]["from_healthy"], rel=0.2)


def test_the_goals_are_those_of_people_and_a_character_without_a_limp_misses_them(measure) -> None:
    """Nobody hurts a hip or foot here, and the network has no guarding, so some rows have no value."""

    def goals(effect) -> dict[str, dict[str, Any]]:
        return {row["row"]: row for row in measure(effect)["goals"]}

    full = goals(lambda s: 0.1 * s)
    assert all(full[name]["met"] for name in ("knee_sound", "nearest", "strength_at_10", "named_at_10"))
    assert full["strength_at_3"]["right"][0] == pytest.approx(
        0.3 * full["strength_at_10"]["right"][0], rel=0.1
    )
    assert (full["apart"]["met"], full["forward_guarding_1"]["met"]) == (None, None)
    assert _goal(full["knee_sound"])["goal"] == "at most 0.95"
    none = goals(lambda s: 0.0)
    assert not any(none[name]["met"] for name in ("knee_sound", "strength_at_3", "named_at_3"))
