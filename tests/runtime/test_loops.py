"""Loops of the character's gaits, and the glTF file that has them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.runtime import loops
from hobble.runtime import scenarios as runtime_scenarios
from hobble.runtime.glb import export_glb
from hobble.runtime.options import Runtime
from hobble.runtime.scenarios import generate_scenarios, scenarios
from tests.figure.glb import Glb


def test_a_walk_is_cut_where_it_repeats() -> None:
    time = np.arange(loops.SETTLED + 60 + loops.LONGEST + loops.BLEND)
    swing = np.stack([0 * time, 90 + np.sin(2 * np.pi * time / 67), 2.0 * time], axis=1)
    leg = swing + np.stack([0 * time, -50 + 0 * time, 20 * np.sin(2 * np.pi * time / 67)], axis=1)
    first, last, gap = loops.find_cut(np.stack([swing, leg], axis=1))
    assert (last - first) % 67 == 0
    assert gap < 1e-6


def test_a_loop_goes_ahead_from_the_origin() -> None:
    time = np.arange(60)
    root = np.stack([500 - 2.0 * time, 90 + 0 * time, 3 * np.sin(2 * np.pi * time / 60)], axis=1)
    turned = np.tile([1.0, 0, 0, 0], (60, 1, 1))
    walk = loops.RepeatedWalk(root[:, None], turned, np.array([-120.0, 0, 0]), 0.0).ahead()
    assert walk.travel == pytest.approx([0, 0, 120])
    beside = walk.positions[:, 0] - np.arange(60)[:, None] / 60 * walk.travel
    assert beside.mean(axis=0) == pytest.approx([0, 90, 0])


def test_each_gait_is_in_the_file_as_a_loop_healthy_and_hurt(
    tmp_path: Path, hurtable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loops, "SETTLED", 40)
    short = [replace(scenario, frames=20) for scenario in scenarios(hurtable)[:2]]
    monkeypatch.setattr(runtime_scenarios, "scenarios", lambda _: short)
    generate_scenarios(hurtable, tmp_path / "scenarios.npz", tmp_path / "bvh", Runtime())
    export_glb(tmp_path / "a.glb", hurtable, tmp_path / "scenarios.npz", Runtime())
    file = Glb(tmp_path / "a.glb")
    for gait in loops.SPEEDS:
        for hurt in ("", "_left_knee", "_lower_back"):
            still, moving = f"{gait}{hurt}_loop", f"{gait}{hurt}_loop_root_motion"
            assert not file.keys(still, "root", "translation").any()
            assert file.keys(moving, "root", "translation")[:, 0] == pytest.approx(0, abs=1e-4)
            for animation in (still, moving):  # the last pose is the first one
                for node, path in (("Hips", "translation"), ("LeftLeg", "rotation"), ("Spine1", "rotation")):
                    found = file.keys(animation, node, path)
                    assert found[-1] == pytest.approx(found[0], abs=1e-4)
    assert set(file.animations) > {"walk", "jog"}  # the scenarios
