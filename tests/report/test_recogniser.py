"""The recogniser in the page finds the same cycles, numbers and answers as in Python."""

from __future__ import annotations

import json
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import measure_cycles
from hobble.gait.profile import healthy_profile, profile_of_walk, read_people
from hobble.gait.recognise import grade_walk
from hobble.models.network import Network
from hobble.report.character import (
    healthy_walk,
    packed_statistics,
    playable_with_recogniser,
)


@pytest.fixture(scope="module")
def walks(examples: ModuleType, holden31: Skeleton) -> dict[str, Array]:
    """Walks (F, J, 3), cm: even, with noise in every joint, along a curve, and on the spot."""
    even = examples.walker(holden31, 240, 2.2)["positions"].astype(float)
    frames, rng = np.arange(240), np.random.default_rng(4)
    uneven = even + 1.5 * np.sin(frames[:, None, None] / 19 + rng.uniform(0, 6, even.shape[1:]))
    knee = holden31.role("right_knee")
    uneven[:, knee, 2] += 4 * np.sin(frames / 9) ** 2
    angle = np.radians(0.15) * frames
    turned = uneven.copy()
    turned[..., 0] = np.cos(angle)[:, None] * uneven[..., 0] + np.sin(angle)[:, None] * uneven[..., 2]
    turned[..., 2] = np.cos(angle)[:, None] * uneven[..., 2] - np.sin(angle)[:, None] * uneven[..., 0]
    still = even - even[:, :1] * [1, 0, 1]
    found = {"even": even, "uneven": uneven, "bending": turned, "on the spot": still}
    return {name: np.round(places, 6) for name, places in found.items()}


def in_page(tab: Any, skeleton: Skeleton, places: Array) -> Any:
    """Cycles and profile as the page finds them."""
    spec = {"names": list(skeleton.joints), "roles": dict(skeleton.roles)}
    frames = places.reshape(len(places), -1).tolist()
    return tab.run(f"""(() => {{
      const walk = Hobble.measureWalk({json.dumps(spec)}, {json.dumps(frames)});
      const spans = ["right", "left"].map((side) => walk[side].map((c) => [c.start, c.end]));
      return {{ spans, profile: Hobble.profile(walk) }};
    }})()""")


def test_cycles_and_their_measurements_equal_those_of_python(
    tab: Any, walks: dict[str, Array], holden31: Skeleton
) -> None:
    walks_with_cycles = 0
    for name, places in walks.items():
        walk, found = measure_cycles(holden31, places, 60), in_page(tab, holden31, places)
        assert found["spans"] == [[[c.start, c.end] for c in side] for side in (walk.right, walk.left)], name
        if not len(walk):
            assert found["profile"] is None
            continue
        walks_with_cycles += 1
        expected = profile_of_walk(walk)
        for key, value in found["profile"].items():
            assert value == pytest.approx(expected[key], abs=1e-6), (name, key)
    assert walks_with_cycles >= 3, "three of the walks have cycles"


def test_javascript_recognises_the_same_limps_as_python(tab: Any) -> None:
    """People's impaired walks at several strengths, compared with their healthy walks."""
    healthy, cases = dict(healthy_profile([])), []
    for person in (0, 3, 7):
        for walk in read_people()[person].values():
            cases += [{k: (1 - s) * healthy[k] + s * walk[k] for k in healthy} for s in (0.2, 0.6, 1.0)]
    found = tab.run(f"""(() => {{
      const grade = Hobble.grader({json.dumps(packed_statistics())}), healthy = {json.dumps(healthy)};
      return {json.dumps(cases)}.map((walk) => grade(walk, healthy));
    }})()""")
    labels = set()
    for case, answer in zip(cases, found, strict=True):
        expected = grade_walk(case, healthy)
        labels.add(expected.label)
        assert answer["label"] == expected.label
        assert answer["strength"] == pytest.approx(expected.strength, abs=1e-6)
        assert answer["distance"] == pytest.approx(expected.distance, abs=1e-6)
        assert answer["probabilities"] == pytest.approx(dict(expected.probabilities), abs=1e-6)
        assert answer["sides"] == pytest.approx(list(expected.probability_by_side.values()), abs=1e-6)
    assert len(labels) >= 4, "the cases are called different things"


def test_a_walk_is_compared_with_the_healthy_walk_of_the_same_figure(
    network: Network, examples: ModuleType, holden31: Skeleton, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is no answer for a figure that stays on the spot or has no knees."""
    spec = playable_with_recogniser(network, examples.RUNTIME)
    assert spec["recogniser"]["healthy"] == healthy_walk(network, holden31, examples.RUNTIME)
    assert spec["recogniser"]["healthy"]["speed_per_leg"] > 0.5
    without = {role: joint for role, joint in holden31.roles.items() if role != "left_knee"}
    assert healthy_walk(network, replace(holden31, roles=without), examples.RUNTIME) is None
    monkeypatch.setattr("hobble.report.character.AHEAD", (0.0, 0.0))
    assert healthy_walk(network, holden31, examples.RUNTIME) is None
    assert "recogniser" not in playable_with_recogniser(network, examples.RUNTIME)


def test_the_panel_shows_the_recognised_limp(tab: Any, walks: dict[str, Array], holden31: Skeleton) -> None:
    """The recogniser in Play uses three seconds, and asks the user to walk if there is no cycle."""
    healthy = profile_of_walk(measure_cycles(holden31, walks["even"], 60))
    spec = {"names": list(holden31.joints), "roles": dict(holden31.roles)}
    spec["recogniser"] = {"learnt": packed_statistics(), "healthy": healthy}
    said = {}
    for name in ("even", "on the spot"):
        frames = walks[name].reshape(240, -1).tolist()
        said[name] = tab.run(f"""(() => {{
          const watch = Hobble.watch({json.dumps(spec)});
          {json.dumps(frames)}.forEach((places) => watch.add(places));
          return watch.say();
        }})()""")
    last = grade_walk(profile_of_walk(measure_cycles(holden31, walks["even"][-180:], 60)), healthy)
    assert said["even"]["text"] == "nothing hurts"
    assert said["even"]["share"] == pytest.approx(last.probabilities["normal"], abs=1e-4)
    assert said["on the spot"] == {"text": "no answer: walk straight ahead"}
