"""The page moves its characters as the runtime in Python does."""

from __future__ import annotations

import json
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.models.network import Network
from hobble.report.character import AHEAD
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import restore_bone_lengths
from tests.report.example_motion import hills

FRAMES = 120
STEPS = 240  # of the figures at the top


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


def test_the_page_moves_as_python_does(tab: Any, network: Network, examples: ModuleType) -> None:
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    expected = []
    for frame in range(FRAMES):
        target = target_at(frame)
        injury = {"LeftUpLeg-LeftLeg": 7.0, "Hips-LowerBack": 3.0} if target["hurt"] else None
        pose = animation.next_pose(
            target["velocity"], target["facing"], target["gait"], injury=injury, terrain=hills
        )
        world, places = restore_bone_lengths(network.skeleton, pose.positions[None], pose.rotations[None])
        expected.append((pose.phase, pose.channels["injury"], places[0], world[0]))
    links = network.channels["injury"]
    script = f"""(() => {{
      const c = Hobble.character(Hobble.material.playable.example);
      const hills = (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260);
      const targets = {json.dumps([target_at(f) for f in range(FRAMES)])};
      return targets.map(({{ velocity, facing, gait, hurt }}) => {{
        if (hurt) {{
          c.set({links.index("LeftUpLeg-LeftLeg")}, 7);
          c.set({links.index("Hips-LowerBack")}, 3);
        }}
        c.frame(velocity, facing, gait, hills);
        return [c.phase, Array.from(c.values), ...c.skeleton.map((v) => Array.from(v))];
      }});
    }})()"""
    found = tab.run(script)
    for frame, ((phase, severity, places, world), (p, s, at, w)) in enumerate(
        zip(expected, found, strict=True)
    ):
        assert np.abs(np.reshape(at, (-1, 3)) - places).max() < 1e-3, frame
        assert np.degrees(quat.angle(np.reshape(w, (-1, 4)), world)).max() < 0.01, frame
        assert abs(p - phase) < 1e-6
        np.testing.assert_allclose(s, severity, atol=1e-9)
    travelled = np.linalg.norm(expected[-1][2][0] - expected[0][2][0])
    assert travelled > 50, "the example should go somewhere"


def test_the_figures_at_the_top_walk_in_step_as_the_python_runtime_does(
    tab: Any, network: Network, examples: ModuleType, character: dict[str, Any], hero: dict[str, Any]
) -> None:
    """One is hurt; the other walks a little faster or slower, so that both land at the same time.

    They start anew here, since an actor keeps only its last frames, and the tests before may have taken long.
    """
    (one,) = [c for c in character["channels"] if c["name"] == "injury"]
    column = one["columns"][one["sliders"][hero["part"]]]
    frames, phases, seen = tab.run(f"""(() => {{
      const actors = [Hobble.hero.main, Hobble.hero.beside], of = (read) => actors.map(read);
      actors.forEach((actor) => actor.start(() => 0));
      for (let f = 0; f < {STEPS}; f++) Hobble.hero.step();
      return [of(({{ frames }}) => frames.length), of(({{ character }}) => character.phase),
        of(({{ character }}) => Array.from(character.positions))];
    }})()""")
    assert frames[0] == STEPS
    assert abs((phases[1] - phases[0] + 0.5) % 1 - 0.5) < 0.15
    for places, values, count in zip(seen, ({column: 7.0}, {}), frames, strict=True):
        animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
        for _ in range(count):
            pose = animation.next_pose(AHEAD, None, "walk", injury=values)
        np.testing.assert_allclose(np.reshape(places, (-1, 3)), pose.positions, atol=0.01)


def test_the_page_moves_the_body_as_python_does(tab: Any, holden31: Skeleton) -> None:
    """Corners of the body for random rotations of the bones, equal to a tenth, because the page stores
    integers.
    """
    mesh, rng = body_mesh(holden31), np.random.default_rng(3)
    places = mesh.positions + rng.normal(0, 2, mesh.positions.shape)
    turns = quat.normalize(mesh.rotations + rng.normal(0, 0.2, mesh.rotations.shape))
    script = f"""(() => {{
      const {{ figure }} = Hobble.player.actors[0];
      figure.places.set({places.ravel().tolist()});
      figure.turns.set({turns.ravel().tolist()});
      figure.pose(() => [1, 2, 3]);
      const {{ mesh }} = figure, corner = mesh.geometry.boundingSphere.center.clone();
      return Array.from({{ length: mesh.geometry.attributes.position.count }}, (_, v) =>
        mesh.getVertexPosition(v, corner).toArray());
    }})()"""
    found = np.reshape(tab.run(script), (-1, 3))
    assert np.abs(found - mesh.posed(places, turns)).max() < 0.3
    assert np.abs(found - mesh.posed(places, turns)).mean() < 0.03


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
