"""The Python in README, docs and examples runs as it stands, and the three names of a link are one."""

import runpy
from typing import Any

import numpy as np
import pytest

from hobble.channels.injury.shown import display
from hobble.core.skeleton import Skeleton
from hobble.models.network import Network
from hobble.runtime import ProceduralAnimation
from tests.conftest import ROOT
from tests.runtime.walking import walk
from tests.snippets import blocks

PYTHON = list(blocks(ROOT, "python"))


@pytest.fixture
def loaded(request: Any, hurtable: Network, make_network: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The paths that were loaded. Each gives the same untrained network, one with moods on their page."""
    paths: list[str] = []
    network = make_network(links=5, channel="mood") if "moods" in request.node.name else hurtable

    def load(path: str, **options: Any) -> ProceduralAnimation:
        paths.append(path)
        return ProceduralAnimation(network, **options)

    monkeypatch.setattr(ProceduralAnimation, "load", load)
    monkeypatch.chdir(ROOT)
    return paths


@pytest.mark.parametrize("page", sorted({block.page for block in PYTHON}))
def test_the_code_of_a_page_runs(loaded: list[str], page: str) -> None:
    """Its blocks one after another, with fewer frames and with untrained networks."""
    names: dict[str, Any] = {}
    for block in PYTHON:
        if block.page == page:
            exec(compile(block.text.replace("range(600)", "range(20)"), page, "exec"), names)
    assert loaded
    assert np.isfinite(names["pose"].positions).all()


def test_the_example_of_a_game_loop_runs(
    loaded: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr("sys.argv", ["game_loop.py", "network"])
    left = runpy.run_path(str(ROOT / "examples" / "game_loop.py"))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 10
    assert lines[0].startswith(" 0 s at [")
    assert loaded == ["network"]
    assert 0.5 < left["pose"].positions[0, 1] < 1.5  # metres
    assert left["pose"].channels["injury"].max() > 4


def test_a_link_has_three_names(holden31: Skeleton, hurtable: Network) -> None:
    names = ("left knee", "left thigh", "LeftUpLeg-LeftLeg")
    poses = [walk(ProceduralAnimation(hurtable), 30, injury={name: 7})[-1].positions for name in names]
    assert np.array_equal(poses[0], poses[1])
    assert np.array_equal(poses[0], poses[2])
    shown = display(holden31, holden31.link_names, ())
    others = shown.other_names
    assert (others["left ankle"], others["lower back"]) == ("LeftLeg-LeftFoot", "Hips-LowerBack")
    spoken = shown.spoken_names
    assert len(set(spoken)) == len(spoken)
    assert not any(joint in name for joint in holden31.joints for name in spoken if len(joint) > 5)
