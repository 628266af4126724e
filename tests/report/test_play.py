"""Play in the page: keys, clicks, buttons, addresses and the camera work."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.network import Network
from hobble.motion.read import decode_channels, frame_rate, read_bvh
from hobble.runtime.animation import ProceduralAnimation
from tests.report.example_motion import hills


@pytest.fixture(scope="module", autouse=True)
def play_is_shown(tab: Any) -> None:
    tab.run("location.hash = '#play'")
    assert tab.until("document.documentElement.dataset.part === 'play'")


def show(tab: Any) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")


def test_the_top_of_the_page_shows_a_hurt_and_a_healthy_figure(tab: Any) -> None:
    """Also after a click on another part and a turn of the dial."""
    tab.run("scrollTo(0, 0)")
    of = "(({ character }) => Array.from(character.values))"
    spec = "Object.values(Hobble.material.playable)[0].channels[0]"
    hero = "Hobble.hero"
    steps = f"for (let f = 0; f < 60; f++) {hero}.step()"  # without waiting for pictures
    tab.run(steps)
    hurt, healthy = tab.run(f"[{of}({hero}.main), {of}({hero}.beside)]")
    assert max(hurt) == pytest.approx(7.0)
    assert max(healthy) == 0.0
    line = "document.getElementById('hero-line').textContent"
    part = tab.run(f"{hero}.chips[0].textContent")
    tab.run(f"{hero}.chips[0].click()")
    assert f"that its {part} hurts, 7 of 10," in tab.run(line)
    tab.run("document.getElementById('hero-dial').focus()")
    for _ in range(2):
        tab.press("ArrowDown")
    column = tab.run(f"{spec}.sliders['{part}']")
    tab.run(steps)
    assert tab.run(f"{of}({hero}.main)[{column}]") == pytest.approx(5.0)
    assert "5 of 10" in tab.run(line)
    assert max(tab.run(f"{of}({hero}.beside)")) == 0.0
    tab.press("Home")
    assert "At 0 they walk alike." in tab.run(line)


def test_keys_move_the_figure(tab: Any) -> None:
    show(tab)
    character = "Hobble.player.actors[0].character"
    where, speed = f"Array.from({character}.root)", "Math.hypot(...(Hobble.player.target?.velocity ?? [0]))"
    tab.run("Hobble.player.start()")
    assert tab.until(f"{speed} > 2"), "it walks until somebody steers"
    before = tab.run(where)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    assert tab.until(f"{speed} > 2")
    assert tab.until(f"Math.hypot({where}[0] - {before[0]}, {where}[2] - {before[2]}) > 5")
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert tab.until(f"{speed} < .01")
    tab.run("document.getElementById('play-details').open = true")
    panel = "document.getElementById('play-panel').textContent"
    assert tab.until(f"/Speed\\d\\.\\d\\d m\\/sPhase.*Time per frame\\d+\\.\\d ms/.test({panel})"), tab.run(
        panel
    )


@pytest.mark.slow
def test_a_gamepad_and_a_thumb_steer_too(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.start()")
    velocity = "(Hobble.player.target?.velocity ?? [0])"
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


@pytest.mark.slow
def test_on_a_phone_the_buttons_are_below_the_picture_and_no_text_speaks_of_keys(tab: Any) -> None:
    of_keys = "[...document.querySelectorAll('#play kbd, #play .for-keys')]"
    assert tab.run(f"{of_keys}.length") > 9
    tab.size(390, 844)
    show(tab)
    tab.run("document.getElementById('play-stage').scrollIntoView({ block: 'start', behavior: 'instant' })")
    tab.run("Hobble.player.start()")

    def tap(selector: str) -> None:
        x, y = tab.run(
            "(({ x, y, width, height }) => [x + width / 2, y + height / 2])"
            f"(document.getElementById('{selector}').getBoundingClientRect())"
        )
        assert y < 844, selector
        tab.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        tab.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    for button in ("jog", "heal"):
        tap(f"play-{button}")
        pressed = f"document.getElementById('play-{button}').ariaPressed === 'true'"
        assert tab.until(pressed), button
        tap(f"play-{button}")
        assert tab.until(f"!({pressed})"), button
    assert tab.run(f"{of_keys}.filter((e) => e.offsetParent).length") == 0
    tab.size(1280, 900)


def test_a_click_on_the_left_shin_hurts_it_and_changes_the_gait(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.steering.byItself = false")
    tab.run("Hobble.player.view.orbit.yaw = 0")  # from the front no leg hides the other
    tab.run("Hobble.player.start()")
    tab.run("new Promise(requestAnimationFrame)")
    place = """(() => {
      const { view, actors: [{ character, spec }] } = Hobble.player, [, knee, heel] = spec.legs[0];
      const box = document.getElementById("play-view").getBoundingClientRect();
      const at = (j) => view.project(Array.from(character.positions.subarray(3 * j, 3 * j + 3)));
      const [p, q] = [at(knee), at(heel)];
      return [box.x + (p[0] + q[0]) / 2, box.y + (p[1] + q[1]) / 2];
    })()"""
    shin = "Hobble.player.sliders.values.get('injury/LeftLeg-LeftFoot')"
    for modifiers, severity in ((0, 2), (0, 4), (8, 2)):
        tab.run("new Promise(requestAnimationFrame)")
        tab.run("Hobble.player.chase.touch()")
        x, y = tab.run(place)
        for kind in ("mousePressed", "mouseReleased"):
            tab.send(
                "Input.dispatchMouseEvent",
                type=kind, x=x, y=y, button="left", clickCount=1, modifiers=modifiers,
            )  # fmt: skip
        assert tab.until(f"{shin} === {severity}"), severity
    index = "Hobble.player.actors[0].spec.channels[0].columns.indexOf('LeftLeg-LeftFoot')"
    assert tab.until(f"Hobble.player.actors[0].character.values[{index}] > .1")
    apart = f"""(() => {{
      const [{{ spec }}] = Hobble.player.actors;
      const hurt = Hobble.character(spec), healthy = Hobble.character(spec);
      hurt.set({index}, 2);
      for (let f = 0; f < 60; f++) for (const c of [hurt, healthy]) c.frame([0, 2.5], null, "walk", () => 0);
      return Math.max(...hurt.positions.map((v, i) => Math.abs(v - healthy.positions[i])));
    }})()"""
    assert tab.run(apart) > 0.01


def test_presets_set_the_sliders_and_the_address(tab: Any) -> None:
    buttons = "[...document.querySelectorAll('#play-presets button')]"
    assert tab.run(f"{buttons}.map((b) => b.textContent)") == [
        "Hurt knee", "Sprained ankle", "Bad back", "Knee and back", "Healthy",
    ]  # fmt: skip
    tab.run(f"{buttons}[2].click()")
    back = "Hobble.player.sliders.values.get('injury/Hips-LowerBack')"
    assert tab.run(back) == 8
    assert "8" in tab.run("[...document.querySelectorAll('#play-sliders output')].map((o) => o.value)")
    tab.run("Hobble.player.steering.toggle('crouch', true)")
    tab.run("document.getElementById('play-ground').value = 'steps'")
    tab.run("Object.assign(Hobble.player.view.orbit, { yaw: 1.25, distance: 333 })")
    tab.run("document.getElementById('play-share').click()")
    tab.run(f"{buttons}[4].click()")
    assert tab.run("Math.max(...Hobble.player.sliders.values.values())") == 0
    tab.send("Page.reload")
    assert tab.until(
        f"typeof Hobble !== 'undefined' && Hobble.player && {back} === 8 && Hobble.player.steering.on.crouch"
    )
    assert tab.run("document.getElementById('play-ground').value") == "steps"
    assert tab.run("[Hobble.player.view.orbit.yaw, Hobble.player.view.orbit.distance]") == [1.25, 333]
    tab.run("Hobble.player.steering.toggle('crouch', false)")


def test_the_saved_bvh_is_the_motion_that_was_played(
    tab: Any, character: dict[str, Any], examples: ModuleType, holden31: Skeleton, tmp_path: Path
) -> None:
    made = examples.walker(holden31, 90, 2.2)
    spec = {key: character[key] for key in ("names", "parents", "offsets")}
    frames = np.concatenate([made["positions"][:, 0], made["rotations"].reshape(90, -1)], axis=1)
    frames = np.round(frames, 6).tolist()
    (tmp_path / "played.bvh").write_text(tab.run(f"Hobble.bvh({json.dumps(spec)}, {json.dumps(frames)})"))
    file = read_bvh(tmp_path / "played.bvh")
    assert frame_rate(file.frame_time, file.frame_time_text) == 60
    read = decode_channels(file)
    order = [file.names.index(name) for name in holden31.joints]
    skeleton = replace(holden31, offsets=read.offsets[order])
    _, positions = forward_kinematics(skeleton, read.rotations[:, order], read.root)
    assert np.abs(positions - made["positions"]).max() < 0.05
    show(tab)
    assert tab.until("Hobble.player.actors[0].frames.length > 20")
    (tmp_path / "own.bvh").write_text(tab.run("Hobble.player.motion()"))
    assert len(read_bvh(tmp_path / "own.bvh")) > 20


def test_the_view_of_the_inputs_shows_inputs_of_the_network(
    tab: Any, network: Network, examples: ModuleType
) -> None:
    """Ground samples are at the right places, also 25 cm beside the path; velocities are those of Python."""
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    for _ in range(40):
        pose = animation.next_pose([0.5, 2.4], None, "walk", terrain=hills)
    samples, needles = tab.run("""(() => {
      const spec = Hobble.material.playable.example, c = Hobble.character(spec);
      const hills = (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260);
      for (let f = 0; f < 40; f++) c.frame([.5, 2.4], null, "walk", hills);
      return [Hobble.groundSamples(c, spec), Hobble.jointVelocities(c)];
    })()""")
    places = np.reshape([sample["place"] for sample in samples], (12, 3, 3))
    heights = np.reshape([sample["above"] for sample in samples], (12, 3))
    assert np.abs(heights - (places[..., 1] - places[:, 1, 1].mean())).max() < 1e-9
    aside = np.linalg.norm((places - places[:, 1:2])[..., [0, 2]], axis=-1)
    np.testing.assert_allclose(aside, np.tile([25.0, 0, 25.0], (12, 1)), atol=1e-6)
    assert np.ptp(heights) > 1, "the ground is not flat there"
    velocity = animation.state.joint_velocity[0]
    moving = np.linalg.norm(velocity, axis=-1) >= 0.15
    start, end = (np.array([needle[key] for needle in needles]) for key in ("from", "to"))
    np.testing.assert_allclose(end - start, 8 * velocity[moving], atol=1e-2)
    np.testing.assert_allclose(start, pose.positions[moving], atol=1e-2)
    show(tab)
    button = "document.getElementById('play-inputs')"
    tab.run(f"{button}.click()")
    assert tab.run(f"{button}.getAttribute('aria-pressed')") == "true"
    assert "ground heights" in tab.run("document.getElementById('play-note').textContent")
    tab.run(f"{button}.click()")
    assert tab.console == []


LEFT_LEG = """(() => {{
  const {{ view, actors: [actor] }} = Hobble.player, {{ places }} = actor.rig;
  const [hip, knee] = actor.spec.legs[0];
  const at = (j) => [places[3 * j], places[3 * j + 1], places[3 * j + 2]], [a, b] = [at(hip), at(knee)];
  return [.2, .35, .5, .65, .8].map((t) => {{
    const [x, y] = view.project(a.map((v, i) => v + t * (b[i] - v)));
    return actor.under(x, y)?.columns ?? null;
  }});
}})()"""


@pytest.mark.slow
@pytest.mark.parametrize("ground", ["constructor", "toString", "__proto__", "nowhere", "boxes"])
def test_an_address_with_bad_values_is_followed_without_them(tab: Any, ground: str) -> None:
    tab.run("document.getElementById('play-ground').value = 'slope'")
    tab.run(
        f"location.hash = '#play?ground={ground}&camera=,,&hurt=LeftLeg-LeftFoot:3,x:9,Hips-LowerBack:-1'"
    )
    assert tab.until("Hobble.player.sliders.values.get('injury/LeftLeg-LeftFoot') === 3")
    assert tab.run("document.getElementById('play-ground').value") == (
        "boxes" if ground == "boxes" else "slope"
    )
    assert tab.run("Hobble.player.sliders.values.get('injury/Hips-LowerBack')") == 0
    assert tab.run("Hobble.player.view.orbit.distance") >= 140
    assert tab.run("Hobble.player.view.orbit.pitch") > 0.02
    tab.run("Hobble.player.sliders.set([]); location.hash = ''")


def test_the_camera_turns_behind_the_figure_at_any_frame_rate(tab: Any) -> None:
    """The path of the camera depends on the time and not on the number of frames drawn."""
    script = """((rate) => {
      const orbit = { yaw: 0 }, chase = Hobble.chase(orbit, document.createElement("canvas"));
      let eye;
      for (let f = 0; f <= 3 * rate; f++) {
        eye = chase.follow(1e6 + 1000 * f / rate, [0, 90, 150 * f / rate], [1, 0]);
      }
      return [orbit.yaw, 450 - eye[2]];
    })"""
    fast, slow = tab.run(f"{script}(120)"), tab.run(f"{script}(12)")
    assert fast[0] == pytest.approx(slow[0], abs=0.01)
    assert fast[0] == pytest.approx(-np.pi / 2 * (1 - np.exp(-0.9 * 3)), abs=0.02)
    assert 0 < fast[1] < 40
    assert 0 < slow[1] < 40
