"""The network in the page: the same numbers as in Python, and a character that answers to its keys."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.core.skeleton import Skeleton
from hobble.report.formats import embedded
from hobble.report.playable import PARTS, body_parts, playable
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.network import Network, load_network

FRAMES = 120


def test_parts_are_the_links_of_their_roles(holden31: Skeleton) -> None:
    names = {label: holden31.link_names[i] for label, i in body_parts(holden31, holden31.link_names).items()}
    assert names["left thigh"] == "LeftUpLeg-LeftLeg"
    assert names["right foot"] == "RightFoot-RightToeBase"
    assert names["lower back"] == "Hips-LowerBack"
    assert set(names) == {label for label, *_ in PARTS}
    assert body_parts(holden31, ()) == {}


def test_weights_are_kept_to_a_part_in_sixty_thousand(network: Network, character: dict[str, Any]) -> None:
    layer = character["layers"][0]
    integers = np.frombuffer(base64.b64decode(layer["weights"]), "<i2").reshape(network.weights[0].shape)
    scale = np.frombuffer(base64.b64decode(layer["scale"]), "<f4").reshape(network.weights[0].shape[:2])
    error = np.abs(integers * scale[..., None] - network.weights[0])
    assert np.all(error <= 0.501 * scale[..., None])
    assert character["layers"][-1]["rows"] == network.layout.y_joint_rotation.start


def wish(frame: int) -> dict[str, Any]:
    """Ahead, then a turn, sideways, a stop with a turn on the spot, crouching, hurt from a third on."""
    angle = 0.03 * max(0, frame - 20)
    velocity, facing, gait = [2.5 * np.sin(angle), 2.5 * np.cos(angle)], None, "walk"
    if 40 <= frame < 60:
        facing = [0.0, 1.0]
    if 60 <= frame < 90:
        velocity, facing, gait = [0.0, 0.0], [1.0, 0.2], None
    if frame >= 90:
        velocity, gait = [2.0, 0.0], "crouch"
    return {"velocity": velocity, "facing": facing, "gait": gait, "hurt": frame >= 40}


def hills(x: Any, z: Any) -> Any:
    """The ground that the page calls rolling."""
    return 14 * np.sin(x / 170) * np.cos(z / 140) + 8 * np.sin((x + z) / 260)


@pytest.fixture(scope="module")
def tab(page: str, tools: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    yield from tools.opened(page, tmp_path_factory.mktemp("play"))


def test_the_page_moves_as_python_does(tab: Any, network: Network, examples: ModuleType) -> None:
    animation = ProceduralAnimation(network, storage="int16", **examples.RUNTIME)
    expected = []
    for frame in range(FRAMES):
        asked = wish(frame)
        injury = {"LeftUpLeg-LeftLeg": 7.0, "Hips-LowerBack": 3.0} if asked["hurt"] else None
        pose = animation.next_pose(asked["velocity"], asked["facing"], asked["gait"], injury, hills)
        expected.append((pose.positions, pose.phase, pose.severity))
    links = network.links
    script = f"""(() => {{
      const spec = Hobble.material.playable, c = Hobble.character(spec);
      const hills = (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260);
      return {json.dumps([wish(f) for f in range(FRAMES)])}.map(({{ velocity, facing, gait, hurt }}) => {{
        if (hurt) {{
          c.wished[{links.index("LeftUpLeg-LeftLeg")}] = 7;
          c.wished[{links.index("Hips-LowerBack")}] = 3;
        }}
        c.frame(velocity, facing, gait, hills);
        return [Array.from(c.pose), c.phase, Array.from(c.severity)];
      }});
    }})()"""
    found = tab.run(script)
    for frame, ((positions, phase, severity), (x, p, s)) in enumerate(zip(expected, found, strict=True)):
        assert np.abs(np.reshape(x, (-1, 3)) - positions).max() < 1e-3, frame
        assert abs(p - phase) < 1e-6
        np.testing.assert_allclose(s, severity, atol=1e-9)
    travelled = np.linalg.norm(expected[-1][0][0] - expected[0][0][0])
    assert travelled > 50, "the example should go somewhere"


def test_keys_move_the_figure(tab: Any) -> None:
    tab.run("document.getElementById('play-stage').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus()")
    where = "[Hobble.player.character.px[60], Hobble.player.character.pz[60]]"
    tab.run("Hobble.player.start()")
    before = tab.run(where)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    assert tab.until("Math.hypot(...Hobble.player.character.velocity) > 2")
    assert tab.until(f"Math.hypot({where}[0] - {before[0]}, {where}[1] - {before[1]}) > 5")
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert tab.until("Math.hypot(...Hobble.player.character.velocity) < .01")


def test_a_click_on_the_left_shin_hurts_it(tab: Any, network: Network) -> None:
    tab.run("document.getElementById('play-stage').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("Hobble.player.start()")
    tab.until("document.getElementById('play-reading').textContent.length > 0")
    shin = network.links.index("LeftLeg-LeftFoot")
    place = """(() => {
      const { view, character } = Hobble.player, [, knee, heel] = Hobble.material.playable.legs[0];
      const box = document.getElementById("play-view").getBoundingClientRect();
      const at = (j) => view.project(Array.from(character.pose.subarray(3 * j, 3 * j + 3)));
      const [p, q] = [at(knee), at(heel)];
      return [box.x + (p[0] + q[0]) / 2, box.y + (p[1] + q[1]) / 2];
    })()"""
    for modifiers, severity in ((0, 2), (0, 4), (8, 2)):
        tab.run("new Promise(requestAnimationFrame)")
        x, y = tab.run(place)
        for kind in ("mousePressed", "mouseReleased"):
            tab.send(
                "Input.dispatchMouseEvent",
                type=kind, x=x, y=y, button="left", clickCount=1, modifiers=modifiers,
            )  # fmt: skip
        assert tab.until(f"Hobble.player.severities[{shin}] === {severity}"), severity
    assert tab.until(f"Hobble.player.character.severity[{shin}] > .1")


def test_presets_sliders_and_the_link_to_them(tab: Any, network: Network) -> None:
    buttons = "[...document.querySelectorAll('#play-presets button')]"
    assert tab.run(f"{buttons}.map((b) => b.textContent)") == [
        "Hurt knee", "Sprained ankle", "Bad back", "Knee and back", "Healthy",
    ]  # fmt: skip
    tab.run(f"{buttons}[2].click()")
    back = network.links.index("Hips-LowerBack")
    assert tab.run(f"Hobble.player.severities[{back}]") == 8
    assert "8" in tab.run("[...document.querySelectorAll('#play-sliders output')].map((o) => o.value)")
    tab.run("document.getElementById('play-share').click()")
    assert tab.run("location.hash") == f"#play=flat;{back}:8"
    tab.run(f"{buttons}[4].click()")
    assert tab.run("Math.max(...Hobble.player.severities)") == 0
    tab.send("Page.reload")
    assert tab.until(
        f"typeof Hobble !== 'undefined' && Hobble.player && Hobble.player.severities[{back}] === 8"
    )


def test_playing_says_nothing_and_asks_for_nothing(tab: Any) -> None:
    assert tab.console == []
    assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in tab.requests)


def test_the_largest_network_leaves_room_in_the_page(
    examples: ModuleType, root: Path, tmp_path: Path, page: str
) -> None:
    """191 joints and two layers of 512: with plotly.js and everything else the page is to be under 25 MB."""
    data = yaml.safe_load((root / "config/skeletons/ava191.yaml").read_text())
    skeleton = Skeleton.from_dict({"name": "ava191", **{k: v for k, v in data.items() if k != "maps"}})
    examples.weights(tmp_path / "weights.npz", skeleton, units=512)
    spec = playable(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert len(embedded(spec)) < 17e6
    assert len(page) < 7e6


def test_a_network_without_links_can_still_be_played(
    examples: ModuleType, holden31: Skeleton, tmp_path: Any
) -> None:
    examples.weights(tmp_path / "weights.npz", holden31, links=False)
    spec = playable(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert spec["links"] == []
    assert spec["presets"] == []
    assert spec["parts"] == {}
