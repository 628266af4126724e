"""The commands of hobble.gait, and the walker of the data set `synthetic`."""

import json
from pathlib import Path

import numpy as np

from hobble.cli.__main__ import main
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import WALK, Segment


def walker(skeleton: Skeleton, speed: float) -> Clip:
    """The procedural walker, straight ahead for ten seconds at a speed in cm/s."""
    segments = [Segment(WALK, speed, seconds=12.0)]
    return walk_from_plan(f"at-{speed:g}", skeleton, segments, 600, "flat", 60.0, 1).clip


def written(folder: Path, clip: Clip) -> str:
    write_bvh(folder / f"{clip.name}.bvh", clip)
    return str(folder / f"{clip.name}.bvh")


def test_the_command_prints_a_result_for_each_clip(holden31, tmp_path, capsys):
    healthy, slow = (written(tmp_path, walker(holden31, speed)) for speed in (125, 80))
    assert main(["gait", slow, healthy, "--healthy", healthy, "--side", "left"]) == 0
    said = capsys.readouterr().out
    assert said.count("effects if the left side is hurt") == 2
    assert "at-80: normal" in said
    assert "at-125: normal" in said
    assert "No healthy walk" not in said
    assert said.count("strength") == 2
    assert main(["gait", slow, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["graded"]["label"] == "normal"
    assert main(["gait", healthy]) == 0
    assert "mean of ten healthy people" in capsys.readouterr().out


def test_a_clip_without_a_step_is_named_and_refused(holden31, tmp_path, capsys):
    rotations = np.zeros((90, len(holden31.joints), 4))
    rotations[..., 0] = 1
    sway = 2 * np.sin(np.arange(90) / 15)
    still = Clip("standing", holden31, 60.0, rotations, np.stack([sway, 93 + 0 * sway, 0 * sway], axis=1))
    files = [written(tmp_path, clip) for clip in (still, walker(holden31, 125))]
    for clip, healthy in (files, files[::-1]):
        assert main(["gait", clip, "--healthy", healthy]) == 1
        said = capsys.readouterr().err
        assert "standing.bvh" in said
        assert "no whole cycle" in said
