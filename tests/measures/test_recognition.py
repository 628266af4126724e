"""Naming what hurts: the discriminant on known classes, the features of a figure, windows, and the tables."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.gait.recognise import learn
from hobble.measures import recognition_run as module
from hobble.measures.recognition_run import (
    HEALTHY,
    confusion_rows,
    measure_recognition,
    walking_windows,
)
from hobble.measures.walks import gait_features
from hobble.measures.windows import Window, feature_table, named_left_out
from hobble.rows.clip_rows import Captured
from hobble.runtime.options import Runtime
from tests.measures.made_up import captured_walk

RUNTIME = Runtime(steering=1.0)
KNEE, ARM = "LeftUpLeg-LeftLeg", "RightArm-RightForeArm"


def figure(skeleton: Skeleton, frames: int, knee: float, elbow: float, seed: int) -> np.ndarray:
    """(F, J, 3) a walking figure; its knee bends less and its elbow more by these radians."""
    rng = np.random.default_rng(seed)
    t = 2 * np.pi * np.arange(frames) / 60
    local = np.tile(quat.IDENTITY, (frames, len(skeleton.joints), 1))
    across = np.array([1.0, 0, 0])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        bent = 0.5 + 0.5 * np.sin(sign * t)
        local[:, skeleton.role(f"{side}_hip")] = quat.from_axis_angle(across, 0.4 * np.sin(sign * t))
        less = knee if side == "left" else 0.0
        local[:, skeleton.role(f"{side}_knee")] = quat.from_axis_angle(across, bent * (1 - less))
    local[:, skeleton.role("right_elbow")] = quat.from_axis_angle([0, 1.0, 0], elbow + 0.1 * np.sin(t))
    positions = forward_kinematics(skeleton, local, np.tile([0.0, 93, 0], (frames, 1)))[1]
    return positions + rng.normal(0, 0.5, positions.shape)


def clip(network, name: str, link: str | None, severity: float, seed: int, frames: int = 600) -> Captured:
    skeleton = network.skeleton
    hurt = severity / 10
    local = figure(skeleton, frames, hurt * (link == KNEE), 1.2 * hurt * (link == ARM), seed)
    severities = np.zeros((frames, len(network.channels["injury"])))
    if link:
        severities[:, network.channels["injury"].index(link)] = severity
    return captured_walk(name, local, {"injury": severities})


@pytest.fixture
def motion(hurtable) -> list[Captured]:
    parts = ((None, 0.0), (KNEE, 8.0), (ARM, 8.0))
    return [
        clip(hurtable, f"{link}-{n}", link, s, 10 * i + n)
        for i, (link, s) in enumerate(parts)
        for n in (1, 2)
    ]


SPLITS = {f"{link}-{n}": "train" if n == 1 else "held_out" for link in (None, KNEE, ARM) for n in (1, 2)}


def judged(network, motion, splits=SPLITS) -> dict[str, Any]:
    return measure_recognition(network, motion, splits, configuration="x", runtime=RUNTIME, people=0.82)


def test_two_classes_are_separated_along_fishers_direction() -> None:
    """Fisher's direction is the inverse covariance times the difference of the means."""
    rng = np.random.default_rng(3)
    # That of both classes, which count the same however many there are of each.
    one, other = np.array([[3.0, 1.5], [1.5, 1.0]]), np.array([[1.0, 0.5], [0.5, 3.0]])
    spread = (one + other) / 2
    a = rng.multivariate_normal([0, 0], one, 4000)
    b = rng.multivariate_normal([1, -1], other, 1000)
    found = learn(np.concatenate([a, b]), ["a"] * 4000 + ["b"] * 1000)
    across = found.weights[:, 1] - found.weights[:, 0]
    expected = np.linalg.solve(spread, [1.0, -1.0])
    np.testing.assert_allclose(
        across / np.linalg.norm(across), expected / np.linalg.norm(expected), atol=0.05
    )
    # Half way between the means neither is likelier, whatever their numbers.
    middle = found.scores(np.array([[0.5, -0.5]]))[0]
    assert abs(middle[0] - middle[1]) < 0.2
    assert found.likeliest_classes(np.array([[-1.0, 1.0], [2.0, -2.0]])) == ["a", "b"]


def test_features_measure_knee_and_elbow_bend_on_each_side(holden31: Skeleton) -> None:
    contacts, root = np.ones((120, 4)), np.zeros((120, 3))
    well = gait_features(holden31, figure(holden31, 120, 0, 0, 1), contacts, root)
    stiff = gait_features(holden31, figure(holden31, 120, 0.5, 0, 1), contacts, root)
    bent = gait_features(holden31, figure(holden31, 120, 0, 1.0, 1), contacts, root)
    assert len(well) == 50
    assert all(np.isfinite(list(f.values())).all() for f in (well, stiff, bent))
    assert stiff["knee_bend_left_sd"] == pytest.approx(0.5 * well["knee_bend_left_sd"], rel=0.1)
    assert stiff["knee_bend_right_sd"] == pytest.approx(well["knee_bend_right_sd"], rel=0.1)
    assert bent["elbow_right_mean"] - well["elbow_right_mean"] == pytest.approx(np.degrees(1.0), rel=0.15)
    assert bent["elbow_left_mean"] == pytest.approx(well["elbow_left_mean"], abs=0.5)
    assert well["thigh_left_sd"] == pytest.approx(np.degrees(0.4 / np.sqrt(2)), rel=0.1)


def test_captured_windows_are_named_after_the_link_that_hurts(hurtable, motion) -> None:
    found = judged(hurtable, motion)
    assert found["applies"]
    assert found["people"] == 0.82
    assert found["classes"] == sorted([HEALTHY, KNEE, ARM])
    for key in ("cross_validated", "held_out"):
        part = found["captured"][key]
        assert part["right"] == 1.0
        assert part["confusion"][KNEE] == {c: part["windows"] // 3 * (c == KNEE) for c in found["classes"]}
    assert found["chance"] == pytest.approx(1 / 3, abs=1e-5)
    # Whatever an untrained network does, each walk is judged: 2 links, 4 severities, 3 speeds; 3 healthy.
    walks = found["generated"]["by_walk"]
    assert walks["walks"] == 2 * 4 * 3 + 3
    assert found["generated"]["windows"] % walks["walks"] == 0
    assert [s["severity"] for s in found["generated"]["by_severity"]] == [0, 3, 5, 7, 10]
    json.dumps(found, allow_nan=False)
    table = confusion_rows(found)
    assert sum(r["windows"] for r in table if r["motion"] == "generated") == found["generated"]["windows"]
    assert judged(hurtable, motion) == found


def test_windows_hold_straight_walking_with_one_injury(hurtable) -> None:
    good = clip(hurtable, "a", KNEE, 5.0, 1, frames=400)
    windows = walking_windows(good, hurtable)
    # Four parts of 100 frames; windows of 60 begin every 15 frames and stay in their part.
    assert [w.part for w in windows] == [quarter for quarter in range(4) for _ in range(3)]
    assert {(w.label, w.severity) for w in windows} == {(KNEE, 5.0)}
    aside = replace(good, velocity=good.velocity[:, ::-1])
    assert walking_windows(aside, hurtable) == []
    assert walking_windows(replace(good, velocity=0.1 * good.velocity), hurtable) == []
    assert walking_windows(replace(good, gait=0 * good.gait), hurtable) == []
    severity = good.channels["injury"].copy()
    severity[150:] = 0  # half way through the second part, in which no window is all of a kind
    healed = walking_windows(replace(good, channels={"injury": severity}), hurtable)
    assert [w.label for w in healed] == [KNEE] * 3 + [HEALTHY] * 6
    severity = good.channels["injury"].copy()
    severity[:, hurtable.channels["injury"].index(ARM)] = 2
    both = walking_windows(replace(good, channels={"injury": severity}), hurtable)
    assert {(w.label, w.severity) for w in both} == {(f"{KNEE} and {ARM}", 5.0)}


def test_without_sides_both_legs_are_one_class(holden31: Skeleton) -> None:
    parts = module.parts_of_classes(holden31)
    assert parts("LeftUpLeg-LeftLeg") == parts("RightUpLeg-RightLeg") == ("thigh",)
    assert parts("RightLeg-RightFoot and LeftForeArm-LeftHand") == ("forearm", "shank")
    assert parts(HEALTHY) == () != parts("LowerBack-Spine")
    hurt = ["LeftLeg-LeftFoot", "LeftLeg-LeftFoot", "RightUpLeg-RightLeg", HEALTHY]
    named = ["RightLeg-RightFoot", "LeftLeg-LeftFoot", "LeftLeg-LeftFoot", HEALTHY]
    windows = [Window("a", link, {}, 5.0) for link in hurt]
    found = module.count_answers(sorted(set(named)), windows, named, parts)
    assert found["right"] == 0.5
    assert found["right_without_side"] == 0.75


def test_cross_validation_never_learns_from_the_windows_it_names() -> None:
    """If windows differ only in their labels, the names are guesses."""
    rng = np.random.default_rng(6)
    windows = [
        Window("a", f"{n % 2}", {f"{d}": float(v) for d, v in enumerate(rng.normal(size=60))}, 5.0, n // 10)
        for n in range(40)
    ]
    named = named_left_out(windows, [w.part for w in windows])
    assert np.mean(named == [w.label for w in windows]) < 0.8
    table, labels = feature_table([w.values for w in windows]), [w.label for w in windows]
    assert learn(table, labels).likeliest_classes(table) == labels


def test_too_little_data_is_reported_with_its_reason(hurtable, motion) -> None:
    assert judged(hurtable, motion[:2])["reason"] == module.TOO_FEW
    assert confusion_rows(judged(hurtable, motion[:2])) == []
    # A part that hurts only in held-out clips is never named right, and is counted.
    found = judged(hurtable, motion, {**SPLITS, f"{ARM}-1": "held_out"})
    assert found["classes"] == sorted([HEALTHY, KNEE])
    assert ARM in found["captured"]["held_out"]["confusion"]
    assert found["captured"]["held_out"]["right"] == pytest.approx(0.5)  # both clips of the arm are wrong
