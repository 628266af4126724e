"""Reads motion from BVH, glTF and FBX files. FBX is read by way of Blender.

The joints of a glTF file get axes that are parallel to the world's in its rest pose. So all rotations are
zero there, as in a BVH file whose zero pose is a stance. The rest pose is the one in which the mesh was
bound to the joints, if the file has it, since many programs write the pose of some frame into the nodes.
"""

from __future__ import annotations

import base64
import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.core.files import printable, read_bytes
from hobble.core.quat import Array
from hobble.motion.read import EXPORT, MOST_BYTES, MOST_JOINT_POSES, Bvh, frame_rate, read_bvh, refuse_pointer

MOTION_SUFFIXES = (".bvh", ".glb", ".gltf", ".fbx")
ORDER = "ZYX"  # of the rotation channels that the joints of a glTF file get
POSITIONS = tuple(f"{axis}position" for axis in "XYZ")
ROTATIONS = tuple(f"{axis}rotation" for axis in ORDER)
BOUND, MOST_TURN = 0.05, 60.0  # longest bones, degrees; see _bind_pose
MOVES = 1e-3  # longest bones: a joint that moves further relative to its parent gets position channels
LONGEST_STEP, SPARSE = 0.11, 30.0  # seconds: keys that are further apart get frames at 30 Hz between them
MOST_NAMED = 300  # characters of the names of a file's animations in a message
# (node, "translation", "rotation" or "scale") -> times, values, and the interpolation
Keys = dict[tuple[int, str], tuple[Array, Array, str]]
BLENDER_SECONDS = 600  # Blender may take this long for one file
# What Blender runs: reads the FBX file and writes a glTF file with a key for each frame.
BLENDER_SCRIPT = """
import sys, bpy
source, target = sys.argv[-2:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.fbx(filepath=source)
bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_force_sampling=True,
    export_optimize_animation_size=False, export_morph=False, export_materials="NONE")
"""


def read_motion(path: str | Path, animation: str | None = None) -> Bvh:
    """Read a file by its suffix, see MOTION_SUFFIXES. Raises InputError for a bad file.

    animation: name of the animation in a glTF or FBX file; by default the longest.
    """
    path = Path(path)
    readers = {".glb": read_gltf, ".gltf": read_gltf, ".fbx": read_fbx}
    reader = readers.get(path.suffix.lower())
    return reader(path, animation) if reader else read_bvh(path)


def read_fbx(path: Path, animation: str | None = None) -> Bvh:
    """Read an FBX file, which Blender converts to glTF. Raises InputError without Blender, or if it fails."""
    data = read_bytes(path, MOST_BYTES)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, "converted.glb")
        if importlib.util.find_spec("bpy"):
            command = [sys.executable, "-c", BLENDER_SCRIPT]
        elif blender := shutil.which("blender"):
            command = [blender, "--background", "--factory-startup", "--python-expr", BLENDER_SCRIPT, "--"]
        else:
            fix = "Install it (`pip install bpy`, or `blender` on the PATH), or export BVH or glTF."
            raise InputError(path, "only Blender can read FBX files, and it is not installed", fix=fix)
        try:
            command += [str(path.resolve()), str(target)]
            done = subprocess.run(command, capture_output=True, text=True, timeout=BLENDER_SECONDS)
            last = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()][-1:]
        except subprocess.TimeoutExpired:
            last = [f"it took more than {BLENDER_SECONDS} seconds"]
        if not target.is_file():
            problem = f"Blender cannot convert it: {printable(' '.join(last), 200)}"
            raise InputError(path, problem, fix="Export the clip as BVH or glTF.")
        converted = read_gltf(target, animation, path)
    return replace(converted, sha256=hashlib.sha256(data).hexdigest(), bytes=len(data))


def read_gltf(path: Path, animation: str | None = None, named: Path | None = None) -> Bvh:
    """Read an animation of a glTF file (.glb or .gltf).

    animation: its name; by default the longest, with a sentence that names the others. named: the file that
    errors name, by default the same. Raises InputError for a file that is no glTF, or has no animated joints
    or no such animation.
    """
    named, data = named or path, read_bytes(path, MOST_BYTES)
    refuse_pointer(named, data)
    try:
        gltf = _parsed(data)
        animations = _animations(gltf, path)
        chosen, unsure = _chosen(named, animations, animation)
        scene = _Scene.of(gltf, path, animations[chosen])
    except InputError:
        raise
    except Exception as error:  # a missing key, a wrong type, a number that is too large: all mean the same
        problem = f"not a readable glTF file: {printable(error, 200)}"
        raise InputError(named, problem, fix=EXPORT) from None
    checksum = hashlib.sha256(data).hexdigest()
    return replace(scene.as_bvh(named), sha256=checksum, bytes=len(data), unsure=unsure)


class _Item(dict[str, Any]):
    """An object of a glTF file; a property that it lacks is None. pygltflib takes ten times as long."""

    def __getattr__(self, name: str) -> Any:
        return self.get(name)


def _parsed(data: bytes) -> _Item:
    """The content of a .gltf file, or of a .glb file with the bytes of its second chunk as `binary`."""
    text, binary = data, b""
    if data[:4] == b"glTF":
        end = 20 + int.from_bytes(data[12:16], "little")  # of the first chunk, which is JSON
        text, binary = data[20:end], data[end + 8 :]
    gltf: _Item = json.loads(text, object_hook=_Item)
    gltf["binary"] = binary
    return gltf


def _chosen(path: Path, animations: dict[str, Keys], wanted: str | None) -> tuple[str, tuple[str, ...]]:
    """The name of the wanted animation, or of the longest with a sentence that names the others."""
    if not animations:
        fix = "Export it with its animation."
        raise InputError(path, "a glTF file without an animation of joints", fix=fix)
    known = printable(", ".join(animations), MOST_NAMED)
    if wanted is not None:
        if wanted not in animations:
            raise InputError(path, f"has no animation {printable(wanted)!r}; it has {known}")
        return wanted, ()
    chosen = max(animations, key=lambda name: _seconds(animations[name]))
    if len(animations) == 1:
        return chosen, ()
    text = f"Of its {len(animations)} animations ({known}), the longest was read: {chosen}"
    return chosen, (f"{text}. The option --animation NAME reads another one.",)


@dataclass(frozen=True)
class _Scene:
    """The nodes of a glTF file that are joints or carry joints, parents first, and one animation.

    rest: for each node its translation, rotation (w, x, y, z) and scale.
    """

    names: list[str]
    parents: list[int]
    rest: list[tuple[Array, Array, Array]]
    keys: Keys

    @classmethod
    def of(cls, gltf: Any, path: Path, channels: Keys) -> _Scene:
        above = {child: i for i, node in enumerate(gltf.nodes) for child in node.children or ()}
        joints = {j for skin in gltf.skins or () for j in skin.joints} or {node for node, _ in channels}
        for joint in list(joints):
            while joint in above:
                joints.add(joint := above[joint])
        order: list[int] = []
        waiting = [j for j in sorted(joints, reverse=True) if j not in above]
        roots = len(waiting)
        while waiting:
            order.append(node := waiting.pop())
            waiting += [child for child in reversed(gltf.nodes[node].children or ()) if child in joints]
        first = int(roots > 1)  # several figures, or a figure beside its mesh, hang from one root
        new = {old: i + first for i, old in enumerate(order)}
        names = ["Scene"] * first
        for old in order:
            name = printable(gltf.nodes[old].name or f"node_{old}", 100)
            names.append(name if name not in names else f"{name}_{old}")
        parents = [-1] * first + [new.get(above.get(old, -1), first - 1) for old in order]
        still = (np.zeros(3), quat.IDENTITY, np.ones(3))
        bound = _bind_pose(gltf, path, above)
        rest = [still] * first + [bound.get(old) or _rest_of(gltf.nodes[old]) for old in order]
        keys = {(new[node], what): key for (node, what), key in channels.items() if node in new}
        return cls(names, parents, rest, keys)

    def as_bvh(self, path: Path) -> Bvh:
        """The animation as a BVH file would have it. path: of the file."""
        times = np.unique(np.concatenate([times for times, _, _ in self.keys.values()]))
        steps = np.diff(times)[np.diff(times) > 1e-3]  # smaller ones are rounding errors
        step = float(np.median(steps)) if len(steps) else 1.0
        fps = frame_rate(step, "") if step < LONGEST_STEP else SPARSE
        frames = round(float(times[-1] - times[0]) * fps) + 1
        if frames * len(self.names) > MOST_JOINT_POSES:
            raise InputError(path, f"{frames} frames of {len(self.names)} joints are too many", fix=EXPORT)
        when = times[0] + np.arange(frames) / fps
        places, turns = self._world(when)
        rest_places, rest_turns = (values[0] for values in self._world(None))
        turns = quat.mul(turns, quat.inv(rest_turns))
        offsets = rest_places - rest_places[self.parents]
        offsets[0] = 0.0
        channels, columns, least = [], [], MOVES * float(np.linalg.norm(offsets, axis=-1).max())
        for j, p in enumerate(self.parents):
            local, place, moves = turns[:, j], places[:, j], True
            if p >= 0:
                local = quat.mul(quat.inv(turns[:, p]), local)
                place = quat.rotate(quat.inv(turns[:, p]), place - places[:, p])
                moves = np.abs(place - offsets[j]).max() > least
            channels.append((POSITIONS if moves else ()) + ROTATIONS)
            columns += [place] if moves else []
            columns.append(np.degrees(quat.to_euler(local, ORDER)))
        values = np.concatenate(columns, axis=1)
        joints = tuple(self.names), tuple(self.parents), offsets, tuple(channels)
        return Bvh(path, *joints, values, 1 / fps, "", {})

    def _world(self, when: Array | None) -> tuple[Array, Array]:
        """Positions (F, J, 3) and rotations (F, J, 4) in the world at F times; at rest for None."""
        frames = 1 if when is None else len(when)
        places, turns = np.zeros((frames, len(self.names), 3)), np.zeros((frames, len(self.names), 4))
        scales = np.ones((frames, len(self.names), 3))
        for j, p in enumerate(self.parents):
            local = []
            for what, value in zip(("translation", "rotation", "scale"), self.rest[j], strict=True):
                key = None if when is None else self.keys.get((j, what))
                if key is None or when is None:
                    local.append(np.broadcast_to(value, (frames, len(value))))
                else:
                    local.append(_at_times(*key, when))
            place, turn, scale = local
            if p >= 0:
                place = places[:, p] + quat.rotate(turns[:, p], scales[:, p] * place)
                turn, scale = quat.mul(turns[:, p], turn), scales[:, p] * scale
            places[:, j], turns[:, j], scales[:, j] = place, turn, scale
        return places, turns


def _animations(gltf: Any, path: Path) -> dict[str, Keys]:
    """The animations of nodes by name, with keys by the file's numbers of nodes."""
    out: dict[str, Keys] = {}
    for number, animation in enumerate(gltf.animations or ()):
        found: Keys = {}
        for channel in animation.channels:
            node, what = channel.target.node, channel.target.path
            if node is None or what not in ("translation", "rotation", "scale"):
                continue
            sampler = animation.samplers[channel.sampler]
            times, values = _numbers(gltf, path, sampler.input)[:, 0], _numbers(gltf, path, sampler.output)
            if what == "rotation":
                values = values[:, [3, 0, 1, 2]]
            found[node, what] = times, values, sampler.interpolation or "LINEAR"
        name = printable(animation.name or f"animation_{number}", 100)
        if found:
            out[name if name not in out else f"{name}_{number}"] = found
    return out


def _seconds(keys: Keys) -> float:
    """How long an animation lasts."""
    return max(float(np.ptp(times)) for times, _, _ in keys.values())


def _bind_pose(gltf: Any, path: Path, above: dict[int, int]) -> dict[int, tuple[Array, Array, Array]]:
    """Translation, rotation and scale of the joints in the pose in which the first skin was bound to them.

    A file does not tell whether the mesh was bound in its own coordinates or in the world's. What turns the
    root joint less from its node is taken, and neither if it turns by more than MOST_TURN. Empty without a
    skin, or if the length of a bone differs by more than BOUND from that of the nodes. above: node -> its
    parent.
    """
    skin = next((i for i, skin in enumerate(gltf.skins or ()) if skin.inverseBindMatrices is not None), None)
    if skin is None:
        return {}
    to_joint = _numbers(gltf, path, gltf.skins[skin].inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    try:
        pose = dict(zip(gltf.skins[skin].joints, np.linalg.inv(to_joint), strict=True))
    except np.linalg.LinAlgError:
        return {}
    meshes = [i for i, node in enumerate(gltf.nodes) if node.skin == skin]
    longest = max(float(np.linalg.norm(_rest_of(gltf.nodes[j])[0])) for j in pose if above.get(j) in pose)
    bound = {}
    for joint, matrix in pose.items():
        node = _rest_of(gltf.nodes[joint])
        if above.get(joint) in pose:
            bound[joint] = _parts_of(np.linalg.inv(pose[above[joint]]) @ matrix)
            if abs(np.linalg.norm(bound[joint][0]) - np.linalg.norm(node[0])) > BOUND * longest:
                return {}
            continue
        base = np.linalg.inv(_world_of(gltf, above.get(joint), above))
        tried = [_parts_of(base @ _world_of(gltf, mesh, above) @ matrix) for mesh in (None, *meshes[:1])]
        turned = [float(np.degrees(quat.angle(turn, node[1]))) for _, turn, _ in tried]
        if min(turned) < MOST_TURN:
            bound[joint] = node[0], tried[int(np.argmin(turned))][1], node[2]
    return bound


def _world_of(gltf: Any, node: int | None, above: dict[int, int]) -> Array:
    """(4, 4) the transform of a node to the world outside of animations. None is the world itself."""
    matrix = np.eye(4)
    while node is not None:
        place, turn, scale = _rest_of(gltf.nodes[node])
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = quat.to_matrix(turn) * scale, place
        matrix, node = own @ matrix, above.get(node)
    return matrix


def _numbers(gltf: Any, path: Path, number: int) -> Array:
    """(N, width) the values of an accessor. Whole numbers stand for shares of their largest value."""
    accessor = gltf.accessors[number]
    view = gltf.bufferViews[accessor.bufferView]
    uri = gltf.buffers[view.buffer].uri
    if uri is None:
        data = gltf.binary
    elif uri.startswith("data:"):
        data = base64.b64decode(uri.partition(",")[2])
    else:
        data = read_bytes(path.parent / Path(uri).name, MOST_BYTES)
    kind = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}[accessor.componentType]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
    size = np.dtype(kind).itemsize
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    strides = (view.byteStride or width * size, size)
    values = np.ndarray((accessor.count, width), kind, data, start, strides).astype(float)
    return values if kind == "<f4" else np.maximum(values / np.iinfo(kind).max, -1.0)


def _rest_of(node: Any) -> tuple[Array, Array, Array]:
    """Translation, rotation (w, x, y, z) and scale of a node outside of animations."""
    if node.matrix:
        return _parts_of(np.array(node.matrix, float).reshape(4, 4).T)
    x, y, z, w = node.rotation or (0.0, 0.0, 0.0, 1.0)
    place, scale = node.translation or (0.0, 0.0, 0.0), node.scale or (1.0, 1.0, 1.0)
    return np.array(place, float), np.array([w, x, y, z]), np.array(scale, float)


def _parts_of(matrix: Array) -> tuple[Array, Array, Array]:
    """Translation, rotation and scale of a (4, 4) matrix."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix[:3, 3], quat.from_matrix(matrix[:3, :3] / scale), scale


def _at_times(times: Array, values: Array, interpolation: str, when: Array) -> Array:
    """(F, width) an animated value at F times. It is constant before the first key and after the last one."""
    when = np.clip(when, times[0], times[-1])
    after = np.clip(np.searchsorted(times, when, side="right"), 1, max(len(times) - 1, 1))
    first, last = after - 1, np.minimum(after, len(times) - 1)
    gap = np.maximum(times[last] - times[first], 1e-9)[:, None]
    share = (when - times[first])[:, None] / gap
    is_rotation = values.shape[1] == 4
    if interpolation == "CUBICSPLINE":
        # Each key has three values: the tangent before it, the value, the tangent after it (glTF 2.0, C.5).
        before, value, tangent = values[0::3], values[1::3], values[2::3]
        s, s2, s3 = share, share**2, share**3
        out = (2 * s3 - 3 * s2 + 1) * value[first] + gap * (s3 - 2 * s2 + s) * tangent[first]
        out += (3 * s2 - 2 * s3) * value[last] + gap * (s3 - s2) * before[last]
        return quat.normalize(out) if is_rotation else out
    if interpolation == "STEP":
        share = np.floor(share + 1e-9)
    if is_rotation:
        values = quat.continuous(quat.normalize(values))
        return quat.slerp(values[first], values[last], share[:, 0])
    return values[first] * (1 - share) + values[last] * share
