"""The commands of hobble.gait, and the walker of the data set `synthetic`."""

import json
from collections.abc import Callable

import numpy as np
import pytest

from hobble.cli.__main__ import main
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.gait.profile import healthy_profile
from hobble.gait.recognise import compare_clip, shares_of_answers
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import WALK, Segment


@pytest.fixture(scope="module")
def walker(holden31) -> Callable[[float], Clip]:
    """The procedural walker, straight ahead for ten seconds at a speed in cm/s."""

    def make(speed: float) -> Clip:
        segments = [Segment(WALK, speed, seconds=12.0)]
        return walk_from_plan(f"at-{speed:g}", holden31, segments, 600, "flat", 60.0, 1).clip

    return make


@pytest.fixture
def file(tmp_path):
    def write(clip: Clip) -> str:
        path = tmp_path / f"{clip.name}.bvh"
        write_bvh(path, clip)
        return str(path)

    return write


@pytest.fixture(autouse=True)
def at_the_checkout(monkeypatch, root):
    monkeypatch.chdir(root)


@pytest.mark.parametrize("speed", [65, 80, 100, 150])
def test_the_procedural_walker_is_healthy_at_any_speed(walker, speed):
    seen = compare_clip(walker(speed), healthy_profile([walker(125)]))
    assert seen.window_answers
    assert shares_of_answers(seen.window_answers) == {"normal": 1.0}
    assert seen.effects["right"]["speed"] == pytest.approx(speed / 125, abs=0.03)


def test_the_command_prints_a_result_for_each_clip(walker, file, capsys):
    healthy, slow = file(walker(125)), file(walker(80))
    assert main(["gait", slow, healthy, "--healthy", healthy, "--side", "left"]) == 0
    said = capsys.readouterr().out
    assert said.count("effects if the left side is hurt") == 2
    assert "at-80: normal" in said
    assert "at-125: normal" in said
    assert "mean of ten healthy people" not in said
    assert "strength" in said
    assert main(["gait", slow, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["graded"]["label"] == "normal"
    assert main(["gait", healthy]) == 0
    assert "mean of ten healthy people" in capsys.readouterr().out


def test_a_clip_without_a_step_is_named_and_refused(holden31, walker, file, capsys):
    rotations = np.zeros((90, len(holden31.joints), 4))
    rotations[..., 0] = 1
    sway = 2 * np.sin(np.arange(90) / 15)
    still = Clip("standing", holden31, 60.0, rotations, np.stack([sway, 93 + 0 * sway, 0 * sway], axis=1))
    assert main(["gait", file(still), "--healthy", file(walker(125))]) == 1
    said = capsys.readouterr().err
    assert "standing.bvh" in said
    assert "no whole cycle" in said
    assert main(["gait", file(walker(125)), "--healthy", file(still)]) == 1
    assert "standing.bvh" in capsys.readouterr().err
