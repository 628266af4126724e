"""Naming what hurts and what mood shows: the discriminant on known classes, windows, and the tables."""

import json
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hobble.channels import channel
from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.gait.recognise import learn
from hobble.measures import recognition as page
from hobble.measures import recognition_run as module
from hobble.measures.recognition_run import HEALTHY, NONE, STEP, WINDOW, manner_windows, walking_windows
from hobble.models.network import Network
from hobble.report.parts import Paragraph
from hobble.rows.clip_rows import Captured
from hobble.runtime import Runtime
from tests.measures.made_up import captured_walk

RUNTIME = Runtime(steering=1.0)
KNEE, ARM = "LeftUpLeg-LeftLeg", "RightArm-RightForeArm"
OF_WALK = (module.USED - WINDOW) // STEP + 1  # windows of a generated walk


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


def clip(
    network: Network,
    name: str,
    seed: int,
    link: str | None = None,
    severity: float = 8.0,
    mood: str | None = None,
    lean: float = 0.0,
    frames: int = 600,
) -> Captured:
    """A captured walk in which a link hurts, or a mood shows; the trunk leans forward by `lean` cm."""
    skeleton, hurt = network.skeleton, severity / 10
    local = figure(skeleton, frames, hurt * (link == KNEE), 1.2 * hurt * (link == ARM), seed)
    local[:, [skeleton.role("neck"), skeleton.role("head")], 2] += lean
    channels = {key: np.zeros((frames, len(columns))) for key, columns in network.channels.items()}
    for key, column, value in (("injury", link, severity), ("mood", mood, 1.0)):
        if column:
            channels[key][:, network.channels[key].index(column)] = value
    return captured_walk(name, local, channels)


@pytest.fixture
def motion(hurtable) -> list[Captured]:
    links = enumerate((None, KNEE, ARM))
    return [clip(hurtable, f"{link}-{n}", 10 * i + n, link) for i, link in links for n in (1, 2)]


SPLITS = {f"{link}-{n}": "train" if n == 1 else "held_out" for link in (None, KNEE, ARM) for n in (1, 2)}


def judged(network, motion, splits=SPLITS) -> dict[str, Any]:
    return module.measure_injuries(network, motion, splits, runtime=RUNTIME, people=0.82)


def test_two_classes_are_separated_along_fishers_direction() -> None:
    """The inverse of the mean covariance times the difference of the means, of unequally many examples."""
    rng = np.random.default_rng(3)
    one, other = np.array([[3.0, 1.5], [1.5, 1.0]]), np.array([[1.0, 0.5], [0.5, 3.0]])
    a, b = rng.multivariate_normal([0, 0], one, 4000), rng.multivariate_normal([1, -1], other, 1000)
    found = learn(np.concatenate([a, b]), ["a"] * 4000 + ["b"] * 1000)
    across, expected = found.weights @ [-1, 1], np.linalg.solve((one + other) / 2, [1.0, -1.0])
    unit = [v / np.linalg.norm(v) for v in (across, expected)]
    np.testing.assert_allclose(*unit, atol=0.05)
    assert abs(found.scores(np.array([[0.5, -0.5]])) @ [-1, 1]) < 0.2, "half way between the means"
    assert found.likeliest_classes(np.array([[-1.0, 1.0], [2.0, -2.0]])) == ["a", "b"]


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
    assert found["generated"]["windows"] == (2 * 4 * 3 + 3) * OF_WALK
    assert [s["severity"] for s in found["generated"]["by_severity"]] == [0, 3, 5, 7, 10]
    json.dumps(found, allow_nan=False)
    table = module.confusion_rows(found)
    assert sum(r["windows"] for r in table if r["motion"] == "generated") == found["generated"]["windows"]


def test_windows_hold_straight_walking_with_one_injury(hurtable) -> None:
    good = clip(hurtable, "a", 1, KNEE, 5.0, frames=400)
    windows = walking_windows(good, hurtable)
    # Four parts of 100 frames; windows of 60 begin every 15 frames and stay in their part.
    assert [w.part for w in windows] == [quarter for quarter in range(4) for _ in range(3)]
    assert {(w.label, w.severity) for w in windows} == {(KNEE, 5.0)}
    aside, slow = {"velocity": good.velocity[:, ::-1]}, {"velocity": 0.1 * good.velocity}
    for change in (aside, slow, {"gait": 0 * good.gait}):
        assert walking_windows(replace(good, **change), hurtable) == []
    severity = good.channels["injury"].copy()
    severity[150:] = 0  # half way through the second part, in which no window is all of a kind
    healed = walking_windows(replace(good, channels={"injury": severity}), hurtable)
    assert [w.label for w in healed] == [KNEE] * 3 + [HEALTHY] * 6
    severity = good.channels["injury"].copy()
    severity[:, hurtable.channels["injury"].index(ARM)] = 2
    both = walking_windows(replace(good, channels={"injury": severity}), hurtable)
    assert {(w.label, w.severity) for w in both} == {(f"{KNEE} and {ARM}", 5.0)}


def test_too_little_data_is_reported_with_its_reason(hurtable, motion) -> None:
    assert judged(hurtable, motion[:2])["reason"] == module.TOO_FEW
    assert module.confusion_rows(judged(hurtable, motion[:2])) == []
    # A part that hurts only in held-out clips is never named right, and is counted.
    found = judged(hurtable, motion, {**SPLITS, f"{ARM}-1": "held_out"})
    assert found["classes"] == sorted([HEALTHY, KNEE])
    assert ARM in found["captured"]["held_out"]["confusion"]
    assert found["captured"]["held_out"]["right"] == pytest.approx(0.5)  # both clips of the arm are wrong


FRAMES = 300


@pytest.fixture
def both(hurtable) -> Network:
    """A network of random weights with 25 severities and five moods, all of which were seen in training."""
    links = hurtable.channels["injury"][:25]
    layout = replace(hurtable.layout, channels=(("injury", 25), ("mood", 5)))
    moods = channel("mood").columns(hurtable.skeleton)
    return replace(hurtable, layout=layout, channels={"injury": links, "mood": moods})


LEANS = {None: 0.0, "sad": 12.0, "old": 30.0}


def moody(network: Network, mood: str | None, lean: float, seed: int) -> Captured:
    return clip(network, f"{mood}-{seed}", seed, mood=mood, lean=lean, frames=FRAMES)


@pytest.fixture
def moods(both: Network) -> list[Captured]:
    return [moody(both, m, lean + n, n) for m, lean in LEANS.items() for n in (1, 2, 3)]


def measure_moods(network: Network, motion: Sequence[Captured]) -> Any:
    people = {one.clip: one.clip for one in motion}
    return module.measure_manners(network, "mood", motion, dict.fromkeys(people, "train"), people, Runtime())


def test_whole_people_are_left_out() -> None:
    """Each clip is like the other clip of its person and unlike all others."""
    rng = np.random.default_rng(2)
    windows, people = [], {}
    for person in range(12):
        own, manner = rng.normal(0, 1, 6), "sad" if person % 2 else NONE
        for take in (1, 2):
            name = f"{person}-{take}"
            people[name] = str(person)
            takes = own + rng.normal(0, 0.02, (20, 6))
            windows += [module.Window(name, manner, dict(enumerate(values))) for values in takes]
    by_clip = module.recognise_left_out(windows, {name: name for name in people}, [0.6])
    by_person = module.recognise_left_out(windows, people, [0.6])
    assert by_clip["people"] == 24
    assert by_person["people"] == 12
    assert by_person["people_of"] == {NONE: 6, "sad": 6}
    assert by_clip["windows"] == by_person["windows"] == 480
    assert by_clip["right"] > by_person["right"] + 0.2


def test_manners_are_named_and_their_effects_measured(
    both: Network, moods: list[Captured], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Captured windows stand for the generated figures."""
    real = {
        m: [w.values for w in manner_windows(moody(both, m, lean + 1, 9), both, "mood")]
        for m, lean in LEANS.items()
    }

    def generated_values(network: Network, walks: Sequence[Any], runtime: Runtime, features: Any):
        return [real[next(iter(channels["mood"]), None)] for channels, _ in walks]

    monkeypatch.setattr(module, "generated_values", generated_values)
    found = measure_moods(both, moods)
    assert found["manners"] == ["old", "sad"]
    assert (found["captured"]["right"], found["right_at_1"]) == (1.0, 1.0)
    assert found["captured"]["shrinkage"] == 0.6, "of equals the largest"
    effect = found["effects"][2]
    assert (effect["manner"], effect["effect"]) == ("old", "trunk")
    rest = figure(both.skeleton, 60, 0, 0, 1).mean(axis=0)
    trunk = rest[both.skeleton.role("neck")] - rest[both.skeleton.role("hips")]

    def lean(cm: float) -> float:
        return float(np.degrees(np.arctan2(trunk[2] + cm, trunk[1])))

    assert effect["captured"] == pytest.approx(lean(32) - lean(2), abs=0.2)
    assert effect["generated"] == effect["generated_at_half"] == pytest.approx(lean(31) - lean(1), abs=0.2)


def test_a_network_walks_in_every_manner_and_mixture(both: Network, moods: list[Captured]) -> None:
    found = measure_moods(both, moods)
    assert [row["windows"] for row in found["generated"]] == [3 * OF_WALK] * 6
    assert [row["manners"] for row in found["generated"]] == [
        [], ["old"], ["sad"], ["old"], ["sad"], ["old", "sad"],
    ]  # fmt: skip
    material = SimpleNamespace(network={"skeleton": {}})
    shown = page.section({"applies": False, "channels": [found]}, material).parts[1:]
    assert len({part.content.name for part in shown if not isinstance(part.content, Paragraph)}) == 5
    assert measure_moods(both, moods[:6:2]) is None, "one mood in training"
    assert [part.content for part in page.section({}, material).parts] == [None]
