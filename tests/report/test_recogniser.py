"""The recogniser in C, which the page runs, finds the same cycles, numbers and answers as in Python."""

import base64
import ctypes
import itertools
import json
from typing import Any

import numpy as np
import pytest

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.engine import SOURCES, compile_c
from hobble.gait.cycles import measure_cycles
from hobble.gait.profile import features, healthy_profile, profile_of_walk, read_people
from hobble.gait.recognise import grade_walk, grader_of_all_people
from hobble.report.character import PROFILE_IN_C, measured_joints, packed_statistics
from tests.report.browser import Browser


@pytest.fixture(scope="module")
def walks(walk: Array, holden31: Skeleton) -> dict[str, Array]:
    """Walks (F, J, 3), cm: even, with noise in every joint, along a curve, and on the spot."""
    frames, rng = np.arange(len(walk)), np.random.default_rng(4)
    uneven = walk + 1.5 * np.sin(frames[:, None, None] / 19 + rng.uniform(0, 6, walk.shape[1:]))
    uneven[:, holden31.role("right_knee"), 2] += 4 * np.sin(frames / 9) ** 2
    angle = np.radians(0.15) * frames
    turned = uneven.copy()
    turned[..., 0] = np.cos(angle)[:, None] * uneven[..., 0] + np.sin(angle)[:, None] * uneven[..., 2]
    turned[..., 2] = np.cos(angle)[:, None] * uneven[..., 2] - np.sin(angle)[:, None] * uneven[..., 0]
    found = {"even": walk, "uneven": uneven, "bending": turned, "on the spot": walk - walk[:, :1] * [1, 0, 1]}
    return {name: np.round(places, 6) for name, places in found.items()}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The recogniser in C."""
    target = tmp_path_factory.mktemp("gait") / "libgait.so"
    compile_c([SOURCES / "hobble_gait.c"], target, ["-O2", "-shared", "-fPIC"])
    return ctypes.CDLL(str(target))


def doubles(values: Array) -> Any:
    """A pointer to numbers; the array must stay alive."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def profile_in_c(library: ctypes.CDLL, skeleton: Skeleton, places: Array) -> tuple[int, dict[str, float]]:
    """The number of cycles, and the profile."""
    joints = np.array(measured_joints(skeleton), np.int32)
    frames, out = np.ascontiguousarray(places, float), np.zeros(len(PROFILE_IN_C))
    cycles = library.hobble_gait_profile(
        doubles(frames), len(frames), frames.shape[1], joints.ctypes.data_as(ctypes.c_void_p), doubles(out)
    )
    return cycles, dict(zip(PROFILE_IN_C, out, strict=True))


def test_cycles_and_their_measurements_equal_those_of_python(
    library: ctypes.CDLL, walks: dict[str, Array], holden31: Skeleton
) -> None:
    counts = []
    for name, places in walks.items():
        walk = measure_cycles(holden31, places, 60)
        cycles, found = profile_in_c(library, holden31, places)
        assert cycles == len(walk), name
        counts.append(cycles)
        expected = profile_of_walk(walk) if cycles else {}
        assert {key: found[key] for key in found if key in expected} == pytest.approx(
            {key: expected[key] for key in found if key in expected}, abs=1e-6
        )
    assert all(counts[:3]), "the first three walks have cycles"
    assert profile_in_c(library, holden31, walks["even"][:20])[0] == 0


def test_c_recognises_the_same_limps_as_python(library: ctypes.CDLL) -> None:
    """People's impaired walks at several strengths, compared with their healthy walks."""
    healthy, packed = dict(healthy_profile([])), packed_statistics()
    learnt, answer = np.frombuffer(base64.b64decode(packed["learnt"])), np.zeros(4 + len(packed["words"]))
    assert len(features(healthy, healthy)) == 21, "as many as HOBBLE_GAIT_FEATURES"
    kinds, labels = [label for label, _ in grader_of_all_people().kinds], set()
    walks = [walk for person in (0, 3, 7) for walk in read_people()[person].values()]
    for walk, s in itertools.product(walks, (0.2, 0.6, 1.0)):
        case = {k: (1 - s) * healthy[k] + s * walk[k] for k in healthy}
        arrays = [np.array([values[name] for name in PROFILE_IN_C]) for values in (case, healthy)]
        library.hobble_gait_recognise(doubles(learnt), *map(doubles, arrays), doubles(answer))
        expected = grade_walk(case, healthy)
        labels.add(expected.label)
        assert (kinds[int(answer[0])] if answer[0] >= 0 else "normal") == expected.label
        numbers = [expected.strength, expected.distance, expected.probabilities["normal"]]
        assert answer[1:] == pytest.approx([*numbers, *expected.probability_by_side.values()], abs=1e-6)
    assert len(labels) >= 4, "the cases are called different things"


def test_the_panel_shows_the_recognised_limp(
    tab: Browser, walks: dict[str, Array], holden31: Skeleton
) -> None:
    """The recogniser in Play uses three seconds, and asks the user to walk if there is no cycle."""
    healthy = profile_of_walk(measure_cycles(holden31, walks["even"], 60))
    learnt = {"healthy": [healthy[name] for name in PROFILE_IN_C], "joints": measured_joints(holden31)}
    even, on_the_spot = (
        tab.run(f"""(() => {{
          const frames = {json.dumps(walks[name].reshape(len(walks[name]), -1).tolist())};
          const recogniser = {json.dumps(packed_statistics() | learnt)};
          const watch = Hobble.watch({{ ...Hobble.material.playable.test, recogniser }});
          frames.forEach((places) => watch.add(places));
          return watch.say();
        }})()""")
        for name in ("even", "on the spot")
    )
    last = grade_walk(profile_of_walk(measure_cycles(holden31, walks["even"][-180:], 60)), healthy)
    assert even["text"] == "nothing hurts"
    assert even["share"] == pytest.approx(last.probabilities["normal"], abs=1e-4)
    assert on_the_spot == {"text": "no answer: walk straight ahead"}
