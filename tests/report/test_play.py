"""Play in the page: it moves characters as Python does, and keys, clicks, links and the camera work."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.figure.mesh import body_mesh
from hobble.models.network import Network
from hobble.motion.read import decode_channels, frame_rate, read_bvh
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.generated import restore_bone_lengths
from tests.report.browser import Browser

LINK = "RightLeg-RightFoot"  # the one that was hurt in training
WIDTH, HEIGHT = 390, 844  # of a phone, CSS pixels
ACTOR = "Hobble.player.actors[0]"


@pytest.fixture(scope="module", autouse=True)
def play_is_shown(tab: Browser) -> None:
    tab.size(1280, 900)
    tab.run("location.hash = '#play'")
    assert tab.until("document.documentElement.dataset.part === 'play'")


def show(tab: Browser) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")


def test_the_figures_at_the_top_walk_in_step_and_the_slider_hurts_one(tab: Browser) -> None:
    """The other walks a little faster or slower, so that both land at the same time."""
    worst = "Math.max(...character.values.subarray(0, 30))"  # of the injuries
    most = f"[Hobble.hero.main, Hobble.hero.beside].map(({{ character }}) => {worst})"
    frames, phases = tab.run("""(() => {
      const actors = [Hobble.hero.main, Hobble.hero.beside];
      actors.forEach((actor) => actor.start(() => 0));
      for (let f = 0; f < 240; f++) Hobble.hero.step();
      return [actors[0].frames.length, actors.map(({ character }) => character.phase)];
    })()""")
    assert frames == 240
    assert abs((phases[1] - phases[0] + 0.5) % 1 - 0.5) < 0.15
    assert tab.run(most) == pytest.approx([7.0, 0.0])
    for value, words in ((5, "5 of 10"), (0, "At 0 they walk alike.")):
        tab.run(
            f"(() => {{ const s = document.getElementById('hero-much'); s.value = {value};"
            " s.dispatchEvent(new Event('input')); })()"
        )
        tab.run("for (let f = 0; f < 90; f++) Hobble.hero.step()")
        assert tab.run(most) == pytest.approx([value, 0.0])
        assert words in tab.run("document.getElementById('hero-line').textContent")
    part = tab.run("(Hobble.hero.chips[0].click(), Hobble.hero.chips[0].textContent)")
    assert f"{part} hurts, 7 of 10," in tab.run("document.getElementById('hero-line').textContent")


def test_the_page_moves_the_body_as_python_does(tab: Browser, holden31: Skeleton) -> None:
    """Equal to a tenth of a millimetre on average, because the page stores integers."""
    mesh, rng = body_mesh(holden31), np.random.default_rng(3)
    places = mesh.positions + rng.normal(0, 2, mesh.positions.shape)
    turns = quat.normalize(quat.IDENTITY + rng.normal(0, 0.2, (len(places), 4)))
    found = tab.run(f"""(() => {{
      const {{ figure }} = {ACTOR};
      figure.places.set({places.ravel().tolist()});
      figure.turns.set({turns.ravel().tolist()});
      figure.pose(() => [1, 2, 3]);
      const {{ mesh }} = figure, corner = mesh.geometry.boundingSphere.center.clone();
      return Array.from({{ length: mesh.geometry.attributes.position.count }}, (_, v) =>
        mesh.getVertexPosition(v, corner).toArray());
    }})()""")
    away = np.abs(np.reshape(found, (-1, 3)) - mesh.posed(places, turns))
    assert away.max() < 0.3
    assert away.mean() < 0.03


def test_keys_move_the_figure_and_readings_show_it(tab: Browser) -> None:
    show(tab)
    where, speed = (
        f"Array.from({ACTOR}.character.root)",
        "Math.hypot(...(Hobble.player.target?.velocity ?? [0]))",
    )
    tab.run("Hobble.player.start()")
    assert tab.until(f"{speed} > 2"), "it walks until somebody steers"
    before = tab.run(where)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    assert tab.until(f"Math.hypot({where}[0] - {before[0]}, {where}[2] - {before[2]}) > 5")
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert tab.until(f"{speed} < .01")
    tab.run("document.getElementById('play-details').open = true")
    panel = "document.getElementById('play-panel').textContent"
    shown = f"/Speed\\d\\.\\d\\d m\\/sPhase.*Time per frame\\d+\\.\\d ms/.test({panel})"
    assert tab.until(shown), tab.run(panel)
    tab.run("document.getElementById('play-details').open = false")


@pytest.mark.slow
def test_a_gamepad_and_a_thumb_steer_too(tab: Browser) -> None:
    show(tab)
    tab.run("Hobble.player.start()")
    speed = "Math.hypot(...(Hobble.player.target?.velocity ?? [0]))"
    pad = "{ connected: true, axes: [0, -1, 0, 0], buttons: [{ pressed: true }] }"
    tab.run(f"navigator.getGamepads = () => [null, {pad}]")
    assert tab.until(f"{speed} > 6"), "the first button jogs"
    tab.run("navigator.getGamepads = () => []")
    x, y, width = tab.run(
        "(({ x, y, width }) => [x, y, width])(document.getElementById('play-pad').getBoundingClientRect())"
    )
    thumb = {"x": x + width / 2, "y": y + 4}
    tab.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[thumb])
    assert tab.until(f"{speed} > 2")
    tab.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    assert tab.until(f"{speed} < .01")


@pytest.mark.slow
def test_play_on_a_phone_is_four_screens_high_and_speaks_of_no_keys(tab: Browser) -> None:
    """However many parts can be hurt."""
    metrics = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": True}
    tab.send("Emulation.setDeviceMetricsOverride", **metrics)
    tab.send("Emulation.setTouchEmulationEnabled", enabled=True)
    try:
        of_keys = "[...document.querySelectorAll('#play kbd, #play .for-keys')]"
        assert tab.run(f"{of_keys}.filter((e) => e.offsetParent).length") == 0
        x, y = tab.run("""(() => {
          document.getElementById("play-stage").scrollIntoView({ block: "start", behavior: "instant" });
          const { x, y, width, height } = document.getElementById("play-jog").getBoundingClientRect();
          return [x + width / 2, y + height / 2];
        })()""")
        assert y < HEIGHT, "the buttons are on the screen"
        for kind, points in (("touchStart", [{"x": x, "y": y}]), ("touchEnd", [])):
            tab.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        assert tab.until("document.getElementById('play-jog').ariaPressed === 'true'")
        high, wide = tab.run("""(() => {
          for (const box of ["gallery-cards", "play-sliders"].map((id) => document.getElementById(id))) {
            for (let i = 0; i < 20; i++) box.append(box.lastElementChild.cloneNode(true));
          }
          return [document.documentElement.scrollHeight, document.documentElement.scrollWidth];
        })()""")
        assert wide == WIDTH
        assert high <= 4 * HEIGHT
    finally:
        tab.send("Emulation.clearDeviceMetricsOverride")
        tab.send("Emulation.setTouchEmulationEnabled", enabled=False)
        tab.size(1280, 900)


def test_a_click_on_the_right_shin_hurts_it_and_changes_the_gait(tab: Browser) -> None:
    show(tab)
    tab.run("Hobble.player.steering.byItself = false")
    tab.run("Hobble.player.view.orbit.yaw = 0")  # from the front no leg hides the other
    tab.run("Hobble.player.start()")
    place = """(() => {
      const { view, actors: [{ character, spec }] } = Hobble.player, [, knee, heel] = spec.legs[1];
      const box = document.getElementById("play-view").getBoundingClientRect();
      const at = (j) => view.project(Array.from(character.positions.subarray(3 * j, 3 * j + 3)));
      const [p, q] = [at(knee), at(heel)];
      return [box.x + (p[0] + q[0]) / 2, box.y + (p[1] + q[1]) / 2];
    })()"""
    for modifiers, severity in ((0, 2), (0, 4), (8, 2)):
        tab.run("new Promise(requestAnimationFrame)")
        tab.run("Hobble.player.chase.touch()")
        x, y = tab.run(place)
        for kind in ("mousePressed", "mouseReleased"):
            tab.send(
                "Input.dispatchMouseEvent",
                type=kind, x=x, y=y, button="left", clickCount=1, modifiers=modifiers,
            )  # fmt: skip
        assert tab.until(f"Hobble.player.sliders.values.get('injury/{LINK}') === {severity}"), severity
    index = f"{ACTOR}.spec.channels[0].columns.indexOf('{LINK}')"
    assert tab.until(f"{ACTOR}.character.values[{index}] > .1")


def test_a_link_has_the_state_of_play(tab: Browser) -> None:
    value = f"Hobble.player.sliders.values.get('injury/{LINK}')"
    tab.run(f"Hobble.player.sliders.set([[Hobble.player.sliders.channels[0], '{LINK}', 8]])")
    assert "8" in tab.run("[...document.querySelectorAll('#play-sliders output')].map((o) => o.value)")
    tab.run("Hobble.player.steering.toggle('crouch', true)")
    tab.run("document.getElementById('play-ground').value = 'steps'")
    tab.run("Object.assign(Hobble.player.view.orbit, { yaw: 1.25, distance: 333 })")
    tab.run("document.getElementById('play-share').click()")
    tab.run("document.querySelector('#play-presets button').click()")
    assert tab.run(value) == 0
    tab.send("Page.reload")
    assert tab.until(
        f"typeof Hobble !== 'undefined' && Hobble.player && {value} === 8 && Hobble.player.steering.on.crouch"
    )
    assert tab.run("document.getElementById('play-ground').value") == "steps"
    assert tab.run("[Hobble.player.view.orbit.yaw, Hobble.player.view.orbit.distance]") == [1.25, 333]
    for ground, shown in (("constructor", "slope"), ("__proto__", "slope"), ("boxes", "boxes")):
        tab.run("document.getElementById('play-ground').value = 'slope'")
        pairs = f"{LINK}:3,x:9,{LINK}:-1"
        tab.run(f"location.hash = '#play?ground={ground}&camera=,,&hurt={pairs}'")
        assert tab.until(f"{value} === 3")
        assert tab.run("document.getElementById('play-ground').value") == shown
        assert tab.run("Hobble.player.view.orbit.distance") >= 140
        tab.run("Hobble.player.sliders.set([]); location.hash = ''")


def test_the_saved_bvh_is_the_motion_that_was_played(
    tab: Browser, character: dict[str, Any], network: Network, holden31: Skeleton, tmp_path: Path
) -> None:
    animation = ProceduralAnimation(network)
    poses = [animation.next_pose((0.5, 2.0)) for _ in range(90)]
    positions, rotations = (np.array([getattr(p, key) for p in poses]) for key in ("positions", "rotations"))
    world, places = restore_bone_lengths(holden31, positions, rotations)
    spec = {key: character[key] for key in ("names", "parents", "offsets")}
    frames = np.round(np.concatenate([places[:, 0], world.reshape(90, -1)], axis=1), 6).tolist()
    (tmp_path / "played.bvh").write_text(tab.run(f"Hobble.bvh({json.dumps(spec)}, {json.dumps(frames)})"))
    file = read_bvh(tmp_path / "played.bvh")
    assert frame_rate(file.frame_time, file.frame_time_text) == 60
    read, _ = decode_channels(file)
    order = [file.names.index(name) for name in holden31.joints]
    skeleton = replace(holden31, offsets=read.skeleton.offsets[order])
    _, back = forward_kinematics(skeleton, read.rotations[:, order], read.root)
    assert np.abs(back - places).max() < 0.05
