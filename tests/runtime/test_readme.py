"""The Python in README and docs runs as it stands, and the three names of a link are one."""

from typing import Any

import numpy as np
import pytest

from hobble.channels.injury.shown import display
from hobble.core.skeleton import Skeleton
from hobble.models.network import Network
from hobble.runtime import ProceduralAnimation
from tests.conftest import ROOT
from tests.snippets import blocks

PYTHON = list(blocks(ROOT, "python"))


@pytest.mark.parametrize("page", sorted({block.page for block in PYTHON}))
def test_the_code_of_a_page_runs(
    hurtable: Network, make_network: Any, page: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its blocks one after another, with fewer frames and with untrained networks."""
    network = make_network(links=5, channel="mood") if "moods" in page else hurtable
    loaded: list[str] = []

    def load(path: str, **options: Any) -> ProceduralAnimation:
        loaded.append(path)
        return ProceduralAnimation(network, **options)

    monkeypatch.setattr(ProceduralAnimation, "load", load)
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {}
    for block in PYTHON:
        if block.page == page:
            exec(compile(block.text.replace("range(600)", "range(20)"), page, "exec"), names)
    assert loaded
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
    shown = display(holden31, holden31.link_names, ())
    names = shown.other_names
    assert (names["left ankle"], names["lower back"]) == ("LeftLeg-LeftFoot", "Hips-LowerBack")
    spoken = shown.spoken_names
    assert len(set(spoken)) == len(spoken)
    assert not any(joint in name for joint in holden31.joints for name in spoken if len(joint) > 5)
