"""The code in README runs as it stands, and the three names of a link are one."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import pytest

from hobble.channels.injury.shown import other_names, spoken_links
from hobble.core.skeleton import Skeleton
from hobble.models.network import Network
from hobble.runtime import ProceduralAnimation


def test_the_code_in_readme_runs(
    root: Path, hurtable: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (root / "README.md").read_text(encoding="utf-8")
    section = text.partition("## The character in your program\n")[2].partition("\n##")[0]
    code = textwrap.dedent("".join(line for line in section.splitlines(True) if line.startswith("    ")))
    assert "next_pose" in code
    loaded: list[str] = []

    def load(path: str) -> ProceduralAnimation:
        loaded.append(path)
        return ProceduralAnimation(hurtable)

    monkeypatch.setattr(ProceduralAnimation, "load", load)
    names: dict = {}
    exec(compile(code.replace("range(600)", "range(20)"), "README.md", "exec"), names)
    assert loaded == ["results/limp/network"]
    assert np.isfinite(names["pose"].positions).all()


def test_a_link_has_three_names(holden31: Skeleton, hurtable: Network) -> None:
    poses = []
    for name in ("left knee", "left thigh", "LeftUpLeg-LeftLeg"):
        character = ProceduralAnimation(hurtable)
        for _ in range(30):
            pose = character.next_pose((0, 2.5), injury={name: 7})
        poses.append(pose.positions)
    assert np.array_equal(poses[0], poses[1])
    assert np.array_equal(poses[0], poses[2])
    names = other_names(holden31, holden31.link_names, ())
    assert (names["left ankle"], names["lower back"]) == ("LeftLeg-LeftFoot", "Hips-LowerBack")
    spoken = spoken_links(holden31, holden31.link_names)
    assert len(set(spoken)) == len(spoken)
    assert not any(joint in name for joint in holden31.joints for name in spoken if len(joint) > 5)
