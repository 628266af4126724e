"""The network in the page gives the same numbers as in Python, and keys, clicks and buttons work."""

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

from hobble.channels.injury.shown import PARTS, body_parts
from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.figure.mesh import body
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.motion.decode import decode, frame_rate
from hobble.motion.read import read_bvh
from hobble.report import opening_walk, straight_walk
from hobble.report.formats import embedded
from hobble.report.playable import playable
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import jointed

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
    layer, kept = character["network"]["layers"][0], network.weights[0][:, :, character["inputColumns"]]
    integers = np.frombuffer(base64.b64decode(layer["weights"]), "<i2").reshape(kept.shape)
    scale = np.frombuffer(base64.b64decode(layer["scale"]), "<f4").reshape(kept.shape[:2])
    error = np.abs(integers * scale[..., None] - kept)
    assert np.all(error <= 0.501 * scale[..., None])
    turning = character["turning"]
    assert character["network"]["layers"][-1]["rows"] == network.layout.y_joint_rotation.start + 3 * len(
        turning
    )


def test_inputs_without_effect_are_left_out(examples: ModuleType, holden31: Skeleton, tmp_path: Path) -> None:
    examples.weights(tmp_path / "weights.npz", holden31)
    network = load_network(tmp_path / "weights.npz")
    x_std = network.x_std.copy()
    unread = network.layout.x_joint_position.start + 3 * holden31.index("LThumb")
    x_std[unread] *= 1e10
    read = playable(replace(network, x_std=x_std), examples.RUNTIME)["inputColumns"]
    assert sorted(set(range(network.layout.x_size)) - set(read)) == [unread]


def target_at(frame: int) -> dict[str, Any]:
    """The target in each frame: walk ahead, turn, strafe, stop, turn on the spot, crouch; hurt in the last
    two thirds.
    """
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
    """The ground that is called "rolling" in the page."""
    return 14 * np.sin(x / 170) * np.cos(z / 140) + 8 * np.sin((x + z) / 260)


@pytest.fixture(scope="module")
def tab(page: str, tools: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    yield from tools.opened(page, tmp_path_factory.mktemp("play"))


def test_the_page_moves_as_python_does(
    tab: Any, network: Network, character: dict[str, Any], examples: ModuleType
) -> None:
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    expected = []
    for frame in range(FRAMES):
        target = target_at(frame)
        injury = {"LeftUpLeg-LeftLeg": 7.0, "Hips-LowerBack": 3.0} if target["hurt"] else None
        pose = animation.next_pose(
            target["velocity"], target["facing"], target["gait"], injury=injury, terrain=hills
        )
        world, places = jointed(network.skeleton, pose.positions[None], pose.rotations[None])
        expected.append(
            (pose.positions, pose.phase, pose.channels["injury"], pose.rotations, places[0], world[0])
        )
    links = network.channels["injury"]
    script = f"""(() => {{
      const spec = Hobble.material.playable.example, c = Hobble.character(spec), rig = Hobble.rig(spec);
      const hills = (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260);
      const targets = {json.dumps([target_at(f) for f in range(FRAMES)])};
      return targets.map(({{ velocity, facing, gait, hurt }}) => {{
        if (hurt) {{
          c.channelTargets[{links.index("LeftUpLeg-LeftLeg")}] = 7;
          c.channelTargets[{links.index("Hips-LowerBack")}] = 3;
        }}
        c.frame(velocity, facing, gait, hills);
        rig.take(c.posePosition, c.poseRotation);
        const made = [c.posePosition, c.phase, c.channelValues, c.poseRotation, rig.places, rig.turns];
        return made.map((v) => (v.length ? Array.from(v) : v));
      }});
    }})()"""
    found, turning = tab.run(script), character["turning"]
    for frame, ((positions, phase, severity, turns, places, world), (x, p, s, q, at, w)) in enumerate(
        zip(expected, found, strict=True)
    ):
        assert np.abs(np.reshape(x, (-1, 3)) - positions).max() < 1e-3, frame
        assert np.degrees(quat.angle(np.reshape(q, (-1, 4)), turns))[turning].max() < 0.01, frame
        assert np.abs(np.reshape(at, (-1, 3)) - places)[turning].max() < 1e-2, frame
        assert np.degrees(quat.angle(np.reshape(w, (-1, 4)), world))[turning].max() < 0.02, frame
        assert abs(p - phase) < 1e-6
        np.testing.assert_allclose(s, severity, atol=1e-9)
    travelled = np.linalg.norm(expected[-1][0][0] - expected[0][0][0])
    assert travelled > 50, "the example should go somewhere"


def show(tab: Any) -> None:
    tab.run("document.getElementById('play-view').scrollIntoView({ behavior: 'instant', block: 'center' })")
    tab.run("document.getElementById('play-stage').focus({ preventScroll: true })")


def test_the_top_of_the_page_shows_a_hurt_and_a_healthy_figure(tab: Any) -> None:
    """Also after a click on another part and a turn of the dial."""
    tab.run("scrollTo(0, 0)")
    of = "(({ character }) => Array.from(character.channelValues))"
    spec = "Object.values(Hobble.material.playable)[0].channels[0]"
    hero = "Hobble.hero"
    steps = f"for (let f = 0; f < 60; f++) {hero}.step()"  # without waiting for pictures
    tab.run(steps)
    hurt, healthy = tab.run(f"[{of}({hero}.main), {of}({hero}.ghost)]")
    assert max(hurt) == pytest.approx(7.0)
    assert max(healthy) == 0.0
    apart = f"(({{ main, ghost }}) => main.character.root[0] - ghost.character.root[0])({hero})"
    assert 40 < tab.run(apart) < 140
    line = "document.getElementById('hero-line').textContent"
    part = tab.run(f"{hero}.chips[0].textContent")
    tab.run(f"{hero}.chips[0].click()")
    assert f"that its {part} hurts, 7 of 10." in tab.run(line)
    tab.run("document.getElementById('hero-dial').focus()")
    for _ in range(2):
        tab.press("ArrowDown")
    column = tab.run(f"{spec}.sliders['{part}']")
    tab.run(steps)
    assert tab.run(f"{of}({hero}.main)[{column}]") == pytest.approx(5.0)
    assert "5 of 10" in tab.run(line)
    assert max(tab.run(f"{of}({hero}.ghost)")) == 0.0
    tab.press("Home")
    assert "at 0 they walk alike." in tab.run(line)


def test_the_figures_at_the_top_move_as_the_python_runtime_does(
    tab: Any, network: Network, examples: ModuleType, character: dict[str, Any], hero: dict[str, Any]
) -> None:
    """The page has their states at the moment when it opens. Both go on alike for half a second."""
    (one,) = [c for c in character["channels"] if c["name"] == "injury"]
    column = one["columns"][one["sliders"][hero["part"]]]
    for i, values in enumerate(({column: 7.0}, {})):
        animation = ProceduralAnimation(network, **dict(examples.RUNTIME))
        for _ in range(opening_walk.FRAMES + 30):
            pose = animation.next_pose(straight_walk.AHEAD, None, "walk", injury=values)
        seen = tab.run(f"""(() => {{
          const c = Hobble.character(Hobble.material.playable.example);
          c.follow(Hobble.material.hero.walked[{i}]);
          for (let f = 0; f < 30; f++) c.frame({json.dumps(straight_walk.AHEAD)}, null, "walk", () => 0);
          return Array.from(c.posePosition);
        }})()""")
        np.testing.assert_allclose(np.reshape(seen, (-1, 3)), pose.positions, atol=0.05)


def test_keys_move_the_figure(tab: Any) -> None:
    show(tab)
    character = "Hobble.player.actors[0].character"
    where = f"[{character}.px[60], {character}.pz[60]]"
    tab.run("Hobble.player.start()")
    before = tab.run(where)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW", text="w")
    assert tab.until(f"Math.hypot(...{character}.smoothedVelocity) > 2")
    assert tab.until(f"Math.hypot({where}[0] - {before[0]}, {where}[1] - {before[1]}) > 5")
    tab.send("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    assert tab.until(f"Math.hypot(...{character}.smoothedVelocity) < .01")
    panel = "document.getElementById('play-panel').textContent"
    assert tab.until(f"/Speed\\d\\.\\d\\d m\\/sPhase.*Time per frame\\d+\\.\\d ms/.test({panel})"), tab.run(
        panel
    )


def test_a_gamepad_and_a_thumb_steer_too(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.start()")
    velocity = "Hobble.player.actors[0].character.smoothedVelocity"
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
    tab.run("Hobble.player.view.orbit.yaw = 0")  # from the front no leg hides the other
    tab.run("Hobble.player.start()")
    tab.run("new Promise(requestAnimationFrame)")
    place = """(() => {
      const { view, actors: [{ character, spec }] } = Hobble.player, [, knee, heel] = spec.legs[0];
      const box = document.getElementById("play-view").getBoundingClientRect();
      const at = (j) => view.project(Array.from(character.posePosition.subarray(3 * j, 3 * j + 3)));
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
    assert tab.until(f"Hobble.player.actors[0].character.channelValues[{index}] > .1")
    apart = f"""(() => {{
      const [{{ spec }}] = Hobble.player.actors;
      const hurt = Hobble.character(spec), healthy = Hobble.character(spec);
      hurt.channelTargets[{index}] = 2;
      for (let f = 0; f < 60; f++) for (const c of [hurt, healthy]) c.frame([0, 2.5], null, "walk", () => 0);
      return Math.max(...hurt.posePosition.map((v, i) => Math.abs(v - healthy.posePosition[i])));
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


def test_the_page_moves_the_body_as_python_does(tab: Any, holden31: Skeleton) -> None:
    """Corners of the body for random rotations of the bones, equal to a tenth, because the page stores
    integers.
    """
    mesh, rng = body(holden31), np.random.default_rng(3)
    places = mesh.positions + rng.normal(0, 2, mesh.positions.shape)
    turns = quat.normalize(mesh.rotations + rng.normal(0, 0.2, mesh.rotations.shape))
    script = f"""(() => {{
      const {{ figure }} = Hobble.player.actors[0];
      figure.places.set({places.ravel().tolist()});
      figure.turns.set({turns.ravel().tolist()});
      figure.pose(() => [1, 2, 3]);
      return Array.from(figure.corners());
    }})()"""
    found = np.reshape(tab.run(script), (-1, 3))
    assert np.abs(found - mesh.posed(places, turns)).max() < 0.3
    assert np.abs(found - mesh.posed(places, turns)).mean() < 0.03


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
    read = decode(file, still=0.0)
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


def test_every_point_along_the_left_thigh_takes_a_click(tab: Any) -> None:
    show(tab)
    tab.run("Hobble.player.view.orbit.yaw = .3")
    tab.run("Hobble.player.start()")
    tab.run("new Promise(requestAnimationFrame)")
    found = tab.run(LEFT_LEG.format())
    assert [columns and columns[-1] for columns in found] == ["LeftUpLeg-LeftLeg"] * 5


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


def test_the_gait_lab_measures_steps_and_knees(tab: Any, examples: ModuleType, holden31: Skeleton) -> None:
    made = examples.walker(holden31, 180, 2.2)
    legs = [
        [holden31.role(f"{side}_{part}") for part in ("hip", "knee", "heel", "toe")]
        for side in ("left", "right")
    ]
    places = np.round(made["positions"], 4).reshape(180, -1).tolist()
    down = (made["contacts"][:, ::2] > 0.5).tolist()
    found = tab.run(f"""(() => {{
      const lab = Hobble.lab({json.dumps(legs)}), down = {json.dumps(down)};
      {json.dumps(places)}.forEach((at, f) => lab.add(at, down[f]));
      return [lab.knees, lab.steps, lab.stance];
    }})()""")
    for f, (hip, knee, heel, _) in enumerate(legs):
        a, b = (made["positions"][:, j] - made["positions"][:, i] for i, j in ((hip, knee), (knee, heel)))
        cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
        assert found[0][f] == pytest.approx(np.degrees(np.arccos(np.clip(cosine, -1, 1))), abs=0.2)
        lands = 1 + np.flatnonzero(np.diff(made["contacts"][:, 2 * f]) > 0.5)
        other = np.flatnonzero(np.diff(made["contacts"][:, 2 - 2 * f], prepend=0) > 0.5)
        at, before = lands[-1], other[other < lands[-1]][-1]
        step = made["positions"][at, heel] - made["positions"][before, legs[1 - f][2]]
        assert found[1][f] == pytest.approx(np.hypot(step[0], step[2]), abs=0.01)
    assert found[2] == np.array(down).T.tolist()


def test_the_saved_picture_has_a_sky(tab: Any) -> None:
    show(tab)
    least = """new Promise((done) => requestAnimationFrame(() => {
      const canvas = document.getElementById("play-view"), copy = document.createElement("canvas");
      [copy.width, copy.height] = [canvas.width, canvas.height];
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.drawImage(canvas, 0, 0);
      const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
      let least = 255;
      for (let i = 3; i < pixels.length; i += 4) least = Math.min(least, pixels[i]);
      done(least);
    }))"""
    assert tab.run(least) == 255


def test_playing_prints_no_console_message_and_makes_no_request(tab: Any) -> None:
    assert tab.console == []
    assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in tab.requests)


def test_the_largest_network_leaves_room_in_the_page(
    examples: ModuleType, root: Path, tmp_path: Path, page: str
) -> None:
    """With 191 joints, two layers of 512, plotly.js and everything else the page stays under 20 MB."""
    data = yaml.safe_load((root / "config/skeletons/ava191.yaml").read_text())
    skeleton = Skeleton.from_dict({"name": "ava191", **{k: v for k, v in data.items() if k != "maps"}})
    examples.weights(tmp_path / "weights.npz", skeleton, units=512)
    network = load_network(tmp_path / "weights.npz")
    x_std = network.x_std.copy()
    for block in (
        network.layout.x_joint_position,
        network.layout.x_joint_velocity,
    ):  # as training weighs them
        x_std[block].reshape(-1, 3)[[skeleton.index(name) for name in skeleton.unseen]] *= 1e10
    spec = playable(replace(network, x_std=x_std), examples.RUNTIME)
    assert len(embedded(spec)) < 13e6
    assert len(page) < 6e6


def test_a_network_without_links_can_still_be_played(
    examples: ModuleType, holden31: Skeleton, tmp_path: Any
) -> None:
    examples.weights(tmp_path / "weights.npz", holden31, links=False)
    spec = playable(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert spec["channels"] == []
