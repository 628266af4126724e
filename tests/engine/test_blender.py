"""The add-on for Blender bakes the walk of the runtime."""

import importlib.util
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.engine import compile_library
from hobble.engine.export import write_blender_addon
from hobble.engine.hob import character_bytes
from hobble.figure.gltf import write_glb
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from tests.engine.networks import network_of

# A Python with the module bpy, if it is not this one.
BLENDER = os.environ.get("HOBBLE_BLENDER") or (sys.executable if importlib.util.find_spec("bpy") else None)


@pytest.mark.skipif(not BLENDER, reason="no bpy: pip install bpy into a Python, and set HOBBLE_BLENDER to it")
@pytest.mark.skipif(platform.system() != "Linux", reason="the library for this test is compiled for Linux")
def test_the_baked_walk_is_that_of_the_runtime(root: Path, tmp_path: Path, holden31: Skeleton) -> None:
    """The same targets and injuries, in Python, lead to the same joints within a millimetre."""
    network = network_of("pfnn", holden31, tmp_path)
    (tmp_path / "libraries").mkdir()
    compile_library(tmp_path / "libraries" / "linux-x64.so")
    (tmp_path / "character.hob").write_bytes(character_bytes(network, Runtime()))
    write_glb(tmp_path / "character.glb", holden31)
    addon = root / "workflow/blender/hobble_blender"
    made = (tmp_path / "libraries", tmp_path / "character.hob", tmp_path / "character.glb")
    write_blender_addon(tmp_path / "hobble_blender.zip", addon, *made)
    script = Path(__file__).with_name("bake_in_blender.py")
    home = os.environ | {"HOME": str(tmp_path), "BLENDER_USER_RESOURCES": str(tmp_path / "blender")}
    command = [str(BLENDER), str(script), str(tmp_path / "hobble_blender.zip")]
    done = subprocess.run(command, capture_output=True, text=True, env=home, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    given = json.loads(done.stdout.splitlines()[-1])

    character = ProceduralAnimation(network, facing=(2.0, 4.0), **dict(Runtime()))  # along the path
    names = list(given["joints"])
    chosen = [names.index(name) for name in holden31.joints]
    worst = 0.0
    for velocity, hurt, found in zip(*(given[key] for key in ("targets", "hurt", "positions")), strict=True):
        pose = character.next_pose(velocity, None, None, injury={"left thigh": hurt})
        worst = max(worst, float(np.abs(np.array(found)[chosen] - pose.positions).max()))
        ground = np.array(found)[names.index("root")]
        assert ground == pytest.approx(pose.root, abs=0.1)
    assert worst < 0.1  # cm
    assert "character walk" in given["actions"]
