"""A clip written as glTF is read as the same motion; FBX is read by way of Blender, or asks for it."""

import base64
import importlib.util
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import local_rotations, rest_positions
from hobble.figure.gltf import _write
from hobble.motion.other_formats import BLENDER_SCRIPT, read_motion

X, Y, _ = np.eye(3)
ARMATURE = quat.from_axis_angle(X, -np.pi / 2)  # Blender writes its Z-up figures below such a node


def write_gltf(
    path: Path, clip: Clip, interpolation: str = "LINEAR", posed: bool = False, second: str = ""
) -> Path:
    """Write a clip as Blender does: bones point along Y of their joints; an armature scales it to metres.

    posed: the nodes stand in a contorted pose; how the body rests is told only by its skin. second: name of
    another animation, which lasts half as long.
    """
    skeleton, count, rng = clip.skeleton, len(clip.skeleton.joints), np.random.default_rng(0)
    bones = [next((skeleton.offsets[k] for k in skeleton.children(j)), Y) for j in range(count)]
    rest = np.array([quat.between(Y, bone if np.linalg.norm(bone) > 1 else Y) for bone in bones])
    local_rest, turns = (
        local_rotations(skeleton, rest),
        local_rotations(skeleton, quat.mul(clip.global_rotations, rest)),
    )
    for turned in (local_rest, turns):
        turned[..., 0, :] = quat.mul(quat.inv(ARMATURE), turned[..., 0, :])
    root = quat.rotate(quat.inv(ARMATURE), clip.root)
    places = [quat.rotate(quat.inv(rest[p]), skeleton.offsets[j]) for j, p in enumerate(skeleton.parents)]
    blob, views, accessors = bytearray(), list[dict](), list[dict]()

    def accessor(values: np.ndarray, kind: str) -> int:
        data = values.astype("<f4").tobytes()
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob.extend(data)
        accessors.append(
            {"bufferView": len(accessors), "componentType": 5126, "count": len(values), "type": kind}
        )
        return len(accessors) - 1

    def animation(name: str, fps: float) -> dict:
        times, samplers, channels = accessor(np.arange(len(clip))[:, None] / fps, "SCALAR"), [], []
        tracks = [(j + 1, "rotation", turns[:, j][:, [1, 2, 3, 0]]) for j in range(count)]
        for node, what, values in [*tracks, (1, "translation", root)]:
            if interpolation == "CUBICSPLINE":  # with tangents of neighbouring keys
                slope = np.gradient(quat.continuous(values) if what == "rotation" else values, axis=0) * fps
                values = np.stack([slope, values, slope], axis=1).reshape(-1, values.shape[1])
            output = accessor(values, "VEC4" if what == "rotation" else "VEC3")
            samplers.append({"input": times, "output": output, "interpolation": interpolation})
            channels.append({"sampler": len(channels), "target": {"node": node, "path": what}})
        return {"samplers": samplers, "channels": channels} | ({"name": name} if name else {})

    def node(name: str, children: list[int], rotation: np.ndarray, **more: object) -> dict:
        return {"name": name, "children": children, "rotation": rotation[[1, 2, 3, 0]].tolist(), **more}

    nodes, skin = [node("Armature", [1], ARMATURE, scale=[0.01] * 3)], {"joints": list(range(1, count + 1))}
    for j, name in enumerate(skeleton.joints):
        contorted = quat.mul(turns[0, j], quat.from_axis_angle(rng.normal(size=3), 1.0))
        place = (places[j] if j else root[0]).tolist()
        children = [k + 1 for k in skeleton.children(j)]
        nodes.append(node(name, children, contorted if posed and j else local_rest[j], translation=place))
    if posed:
        bind = np.tile(np.eye(4), (count, 1, 1))
        bind[:, :3, :3] = quat.to_matrix(rest) * 0.01
        bind[:, :3, 3] = rest_positions(skeleton) * 0.01
        columns = np.linalg.inv(bind).transpose(0, 2, 1).reshape(-1, 16)
        skin["inverseBindMatrices"] = accessor(columns, "MAT4")
    animations = [animation("", clip.fps), *([animation(second, 2 * clip.fps)] if second else [])]
    gltf = {"asset": {"version": "2.0"}, "nodes": nodes, "skins": [skin], "animations": animations}
    gltf |= {"bufferViews": views, "accessors": accessors, "scenes": [{"nodes": [0]}]}
    uri = f"data:application/octet-stream;base64,{base64.b64encode(blob).decode()}"
    is_text = path.suffix == ".gltf"
    gltf["buffers"] = [{"byteLength": len(blob)} | ({"uri": uri} if is_text else {})]
    if is_text:
        path.write_text(json.dumps(gltf))
    else:
        _write(path, gltf, bytes(blob))
    return path


@pytest.mark.parametrize(
    ("name", "how"), [("a.glb", {}), ("a.gltf", {"interpolation": "CUBICSPLINE"}), ("a.glb", {"posed": True})]
)
def test_a_gltf_file_gives_the_motion_of_the_bvh_file(tmp_path, walk, bvh, make, name, how):
    from_bvh, report = make(bvh(walk))
    from_gltf, other = make(write_gltf(tmp_path / name, walk, **how))
    assert (other["source_fps"], other["rig"], other["unit"]) == (120.0, report["rig"], 100.0)
    assert np.abs(from_gltf.positions - from_bvh.positions).max() < 0.1


def test_keys_that_are_far_apart_are_interpolated(tmp_path, walk):
    file = read_motion(write_gltf(tmp_path / "sparse.glb", replace(walk.part(slice(0, None, 30)), fps=4.0)))
    assert (len(file), file.frame_time) == (61, 1 / 30)


def test_the_longest_of_several_animations_is_read_or_the_named_one(tmp_path, walk, make):
    path = write_gltf(tmp_path / "two.glb", walk, second="Hurry")
    longest, report = make(path)
    assert (
        "Of its 2 animations (animation_0, Hurry), the longest was read: animation_0" in report["unsure"][0]
    )
    named, report = make(path, animation="Hurry", accept_doubt=True)
    assert (len(named), len(longest)) == (61, 121)
    assert "animations" not in " ".join(report["unsure"])
    with pytest.raises(InputError, match="has no animation 'Run'; it has animation_0, Hurry"):
        make(path, animation="Run")


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("text.glb", b"not a model", "not a readable glTF file"),
        ("far.glb", b"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"),
        ("far.bvh", b"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"),
        ("empty.gltf", b'{"asset": {"version": "2.0"}}', "a glTF file without an animation"),
        ("cut.fbx", b"Kaydara FBX Binary", "Blender"),
    ],
)
def test_a_bad_file_gets_one_message(tmp_path, name, content, problem):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=problem) as error:
        read_motion(tmp_path / name)
    assert str(error.value).startswith(str(tmp_path / name))


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("bpy"), reason="Blender (bpy) is not installed")
def test_an_fbx_file_gives_the_motion_of_the_bvh_file(tmp_path, walk, bvh, make):
    begin, _, _ = BLENDER_SCRIPT.partition("bpy.ops.export")
    script = begin.replace(
        "bpy.ops.import_scene.fbx", "bpy.context.scene.render.fps = 120\nbpy.ops.import_scene.gltf"
    )
    script += "bpy.ops.export_scene.fbx(filepath=target, add_leaf_bones=False)"
    glb = write_gltf(tmp_path / "walk.glb", walk)
    subprocess.run([sys.executable, "-c", script, glb, tmp_path / "other.fbx"], check=True)
    from_bvh, _ = make(bvh(walk))
    from_fbx, _ = make(tmp_path / "other.fbx")
    frames = min(len(from_bvh), len(from_fbx))
    assert np.linalg.norm(from_fbx.positions[:frames] - from_bvh.positions[:frames], axis=-1).mean() < 1.0
