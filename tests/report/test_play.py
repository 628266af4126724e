"""The network in the page: the same numbers as in Python, and a character that answers to its keys."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.motion.decode import decode, frame_rate
from hobble.motion.read import read_bvh
from hobble.report.formats import embedded
from hobble.report.loft import vertices
from hobble.report.playable import PARTS, body_parts, playable
from hobble.runtime.animation import ProceduralAnimation

FRAMES = 120


def test_parts_are_the_links_of_their_roles(holden31: Skeleton) -> None:
    names = {label: holden31.link_names[i] for label, i in body_parts(holden31, holden31.link_names).items()}
    assert names["left thigh"] == "LeftUpLeg-LeftLeg"
    assert names["right foot"] == "RightFoot-RightToeBase"
    assert names["lower back"] == "Hips-LowerBack"
    assert set(names) == {label for label, *_ in PARTS}
    assert body_parts(holden31, ()) == {}
    links = holden31.link_names
    back = body_parts(holden31, links, {"LowerBack-Spine", "Spine1-Neck"})["lower back"]
    assert links[back] == "LowerBack-Spine", "the one that was hurt in training"


def test_weights_are_kept_to_a_part_in_sixty_thousand(network: Network, character: dict[str, Any]) -> None:
    layer = character["network"]["layers"][0]
    integers = np.frombuffer(base64.b64decode(layer["weights"]), "<i2").reshape(network.weights[0].shape)
    scale = np.frombuffer(base64.b64decode(layer["scale"]), "<f4").reshape(network.weights[0].shape[:2])
    error = np.abs(integers * scale[..., None] - network.weights[0])
    assert np.all(error <= 0.501 * scale[..., None])
    assert character["network"]["layers"][-1]["rows"] == network.layout.y_joint_rotation.start


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
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    expected = []
    for frame in range(FRAMES):
        asked = wish(frame)
        injury = {"LeftUpLeg-LeftLeg": 7.0, "Hips-LowerBack": 3.0} if asked["hurt"] else None
        pose = animation.next_pose(asked["velocity"], asked["facing"], asked["gait"], injury, hills)
        expected.append((pose.positions, pose.phase, pose.told["injury"]))
    links = network.links
    script = f"""(() => {{
      const spec = Hobble.material.playable.example, c = Hobble.character(spec);
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


def show(tab: Any) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")


def test_keys_move_the_figure(tab: Any) -> None:
    show(tab)
    character = "Hobble.player.actors[0].character"
    where = f"[{character}.px[60], {character}.pz[60]]"
    tab.run("Hobble.player.start()")
    before = tab.run(where)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    assert tab.until(f"Math.hypot(...{character}.velocity) > 2")
    assert tab.until(f"Math.hypot({where}[0] - {before[0]}, {where}[1] - {before[1]}) > 5")
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert tab.until(f"Math.hypot(...{character}.velocity) < .01")
    panel = "document.getElementById('play-panel').textContent"
    assert tab.until(f"/Speed\\d\\.\\d\\d m\\/sPhase.*A frame\\d+\\.\\d ms/.test({panel})"), tab.run(panel)


def test_a_gamepad_and_a_thumb_steer_too(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.start()")
    velocity = "Hobble.player.actors[0].character.velocity"
    pad = "{ connected: true, axes: [0, -1, 0, 0], buttons: [{ pressed: true }] }"
    tab.run(f"navigator.getGamepads = () => [null, {pad}]")
    assert tab.until(f"Math.hypot(...{velocity}) > 6"), "the first button jogs"
    tab.run("navigator.getGamepads = () => []")
    assert tab.until(f"Math.hypot(...{velocity}) < .01")
    x, y = tab.run(
        "(({ x, y, width }) => [x + width / 2, y + 4])"
        "(document.getElementById('play-pad').getBoundingClientRect())"
    )
    tab.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    assert tab.until(f"Math.hypot(...{velocity}) > 2")
    tab.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    assert tab.until(f"Math.hypot(...{velocity}) < .01")


def test_a_click_on_the_left_shin_hurts_it_and_changes_the_gait(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.view.orbit.yaw = 0")  # from the front no leg hides the other
    tab.run("Hobble.player.start()")
    tab.run("new Promise(requestAnimationFrame)")
    place = """(() => {
      const { view, actors: [{ character, spec }] } = Hobble.player, [, knee, heel] = spec.legs[0];
      const box = document.getElementById("play-view").getBoundingClientRect();
      const at = (j) => view.project(Array.from(character.pose.subarray(3 * j, 3 * j + 3)));
      const [p, q] = [at(knee), at(heel)];
      return [box.x + (p[0] + q[0]) / 2, box.y + (p[1] + q[1]) / 2];
    })()"""
    shin = "Hobble.player.injuries.severity.get('LeftLeg-LeftFoot')"
    for modifiers, severity in ((0, 2), (0, 4), (8, 2)):
        tab.run("new Promise(requestAnimationFrame)")
        x, y = tab.run(place)
        for kind in ("mousePressed", "mouseReleased"):
            tab.send(
                "Input.dispatchMouseEvent",
                type=kind, x=x, y=y, button="left", clickCount=1, modifiers=modifiers,
            )  # fmt: skip
        assert tab.until(f"{shin} === {severity}"), severity
    index = "Hobble.player.actors[0].spec.links.indexOf('LeftLeg-LeftFoot')"
    assert tab.until(f"Hobble.player.actors[0].character.severity[{index}] > .1")
    apart = f"""(() => {{
      const [{{ spec }}] = Hobble.player.actors;
      const hurt = Hobble.character(spec), healthy = Hobble.character(spec);
      hurt.wished[{index}] = 2;
      for (let f = 0; f < 60; f++) for (const c of [hurt, healthy]) c.frame([0, 2.5], null, "walk", () => 0);
      return Math.max(...hurt.pose.map((v, i) => Math.abs(v - healthy.pose[i])));
    }})()"""
    assert tab.run(apart) > 0.01


def test_presets_sliders_and_the_link_to_them(tab: Any) -> None:
    buttons = "[...document.querySelectorAll('#play-presets button')]"
    assert tab.run(f"{buttons}.map((b) => b.textContent)") == [
        "Hurt knee", "Sprained ankle", "Bad back", "Knee and back", "Healthy",
    ]  # fmt: skip
    tab.run(f"{buttons}[2].click()")
    back = "Hobble.player.injuries.severity.get('Hips-LowerBack')"
    assert tab.run(back) == 8
    assert "8" in tab.run("[...document.querySelectorAll('#play-sliders output')].map((o) => o.value)")
    tab.run("Hobble.player.steering.toggle('crouch', true)")
    tab.run("document.getElementById('play-ground').value = 'steps'")
    tab.run("Object.assign(Hobble.player.view.orbit, { yaw: 1.25, distance: 333 })")
    tab.run("document.getElementById('play-share').click()")
    tab.run(f"{buttons}[4].click()")
    assert tab.run("Math.max(...Hobble.player.injuries.severity.values())") == 0
    tab.send("Page.reload")
    assert tab.until(
        f"typeof Hobble !== 'undefined' && Hobble.player && {back} === 8 && Hobble.player.steering.on.crouch"
    )
    assert tab.run("document.getElementById('play-ground').value") == "steps"
    assert tab.run("[Hobble.player.view.orbit.yaw, Hobble.player.view.orbit.distance]") == [1.25, 333]
    tab.run("Hobble.player.steering.toggle('crouch', false)")


def test_the_page_draws_the_body_that_python_draws(tab: Any, character: dict[str, Any]) -> None:
    dressed, rng = character["body"], np.random.default_rng(3)
    points = rng.normal(0, 40, (len(dressed["keep"]), 3))
    found = tab.run(f"Hobble.surface({json.dumps(dressed)}, (j) => {json.dumps(points.tolist())}[j])")
    assert np.abs(np.reshape(found, (-1, 3)) - vertices(dressed, points)).max() < 1e-9


def test_what_is_saved_as_bvh_is_what_was_played(
    tab: Any, character: dict[str, Any], examples: ModuleType, holden31: Skeleton, tmp_path: Path
) -> None:
    made = examples.walker(holden31, 90, 2.2)["positions"]
    spec = {key: character[key] for key in ("names", "parents", "offsets")}
    frames = np.round(made, 4).reshape(len(made), -1).tolist()
    (tmp_path / "played.bvh").write_text(tab.run(f"Hobble.bvh({json.dumps(spec)}, {json.dumps(frames)})"))
    file = read_bvh(tmp_path / "played.bvh")
    assert frame_rate(file.frame_time, file.frame_time_text) == 60
    read = decode(file, still=0.0)
    order = [file.names.index(name) for name in holden31.joints]
    skeleton = replace(holden31, offsets=read.offsets[order])
    _, positions = forward_kinematics(skeleton, read.rotations[:, order], read.root)
    assert np.abs(positions - made).max() < 0.05
    show(tab)
    assert tab.until("Hobble.player.actors[0].frames.length > 20")
    (tmp_path / "own.bvh").write_text(tab.run("Hobble.player.motion()"))
    assert len(read_bvh(tmp_path / "own.bvh")) > 20


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
    assert len(page) < 5e6


def test_a_network_without_links_can_still_be_played(
    examples: ModuleType, holden31: Skeleton, tmp_path: Any
) -> None:
    examples.weights(tmp_path / "weights.npz", holden31, links=False)
    spec = playable(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert spec["links"] == []
    assert spec["presets"] == []
    assert spec["parts"] == {}
