"""A body, its skeleton and its motion as one glTF 2.0 file (.glb) in metres, for game engines."""

import json
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.files import atomic_path
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import TEXTURE, Mesh, body_mesh
from hobble.figure.pack import Rig, rig_of, whole_weights

METRES = 0.01  # metres per centimetre
LEAST_MOVEMENT = 1e-5  # a joint counts as still if each component of its rotation varies by less than this
# Codes of glTF for the type of numbers, and for the use of an array (vertices, indices of triangles).
COMPONENTS = {"float32": 5126, "uint8": 5121, "uint16": 5123}
ARRAY, ELEMENTS = 34962, 34963


@dataclass(frozen=True)
class BodyMotion:
    """A motion of the body in F frames. hips: (F, 3) positions of the skeleton's root, cm, in the world.

    local: (F, J, 4) local rotations. ground: (F, 3) places on the ground of the bone `root`, which carries
    the character; None: it stays at the origin.
    """

    name: str
    hips: Array = field(repr=False)
    local: Array = field(repr=False)
    fps: float
    ground: Array | None = field(default=None, repr=False)


class _Buffer:
    """The binary data of the .glb file. glTF describes each array in it by a view and an accessor.

    A view says which bytes belong to the array. An accessor says what they mean. Equal arrays are stored
    once.
    """

    def __init__(self) -> None:
        self.bytes = bytearray()
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []
        self._known: dict[tuple[object, ...], int] = {}

    def add_bytes(self, data: bytes, **more: object) -> int:
        """Append bytes, at a multiple of 4. Returns the index of their view."""
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data), **more})
        self.bytes += data
        return len(self.views) - 1

    def add(
        self,
        array: NDArray[Any],
        kind: str,
        target: int | None = None,
        *,
        normalized: bool = False,
        bounds: bool = False,
    ) -> int:
        """Add an array. Returns the index of its accessor.

        kind: the type of an element in glTF, such as "VEC3". target: code of the array's use, such as ARRAY.
        normalized: whether the integers stand for numbers from 0 to 1. bounds: whether the accessor states
        the smallest and largest values.
        """
        data = np.ascontiguousarray(array)
        raw = data.astype(data.dtype.newbyteorder("<")).tobytes()
        key = (kind, data.dtype.str, target, normalized, bounds, raw)
        if key in self._known:
            return self._known[key]
        count = data.size if kind == "SCALAR" else len(data)
        entry: dict[str, object] = {
            "bufferView": self.add_bytes(raw, **({"target": target} if target else {})),
            "componentType": COMPONENTS[data.dtype.name],
            "count": count,
            "type": kind,
        }
        if normalized:
            entry["normalized"] = True
        if bounds:
            flat = data.reshape(count, -1)
            entry["min"], entry["max"] = (getattr(flat, edge)(axis=0).tolist() for edge in ("min", "max"))
        self.accessors.append(entry)
        self._known[key] = len(self.accessors) - 1
        return self._known[key]


def write_glb(path: str | Path, skeleton: Skeleton, motions: Iterable[BodyMotion] = ()) -> None:
    """Write the body of a skeleton, and its motions as animations.

    The file's bones are those of `rig_of`. In the rest pose, the body stands on the ground (height 0).
    """
    mesh, buffer = body_mesh(skeleton), _Buffer()
    bones = rig_of(skeleton, mesh)
    count = len(bones.names)
    material = {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 0.8}
    document: dict[str, object] = {
        "asset": {"version": "2.0", "generator": "Hobble"},
        "scene": 0,
        "scenes": [{"name": skeleton.name or "character", "nodes": [0, count]}],
        "nodes": [*_nodes(bones), {"name": "body", "mesh": 0, "skin": 0}],
        "meshes": [{"name": "body", "primitives": [_primitive(mesh, bones, buffer)]}],
        "materials": [{"name": "clay", "pbrMetallicRoughness": material}],
        "skins": [
            {
                "name": "character",
                "skeleton": 0,
                "joints": list(range(count)),  # also bones that move no part, or Blender makes them empties
                "inverseBindMatrices": buffer.add(_inverse_bind_matrices(bones), "MAT4"),
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{}],
        "images": [
            {"name": "clay", "mimeType": "image/jpeg", "bufferView": buffer.add_bytes(TEXTURE.read_bytes())}
        ],
    }
    if animations := [_animation(motion, bones, buffer) for motion in motions]:
        document["animations"] = animations
    document |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.bytes)}],
    }
    _write(path, document, bytes(buffer.bytes))


def _nodes(bones: Rig) -> list[dict[str, object]]:
    """A glTF node for each bone, in the rest pose."""
    turns = bones.local(np.tile(quat.IDENTITY, (len(bones.names), 1)))
    nodes = []
    for j, (name, p) in enumerate(zip(bones.names, bones.parents, strict=True)):
        way = bones.places[j]
        if p >= 0:
            way = quat.rotate(quat.inv(bones.axes[p]), way - bones.places[p])
        node: dict[str, object] = {
            "name": name,
            "translation": (METRES * way).tolist(),
            "rotation": np.clip(_xyzw(turns[j]), -1, 1).tolist(),
        }
        if children := [k for k, parent in enumerate(bones.parents) if parent == j]:
            node["children"] = children
        nodes.append(node)
    return nodes


def _primitive(mesh: Mesh, bones: Rig, buffer: _Buffer) -> dict[str, object]:
    """The glTF description of the mesh.

    A corner with several places in the texture is in the file as often.
    """
    table = np.column_stack([mesh.faces.ravel(), mesh.uv.reshape(-1, 2)])
    found, faces = np.unique(table, axis=0, return_inverse=True)
    corner, uv = found[:, 0].astype(int), found[:, 1:]
    weights = whole_weights(mesh.weights[corner])
    # glTF wants bone 0 where the weight is 0.
    bone = np.where(weights > 0, mesh.bones[mesh.bones_of_corner[corner]] + 1, 0).astype(np.uint8)
    normals = mesh.normals[corner].astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corners = METRES * (mesh.corners[corner] + [0.0, -mesh.corners[:, 1].min(), 0.0])
    attributes = {
        "POSITION": buffer.add(corners.astype(np.float32), "VEC3", ARRAY, bounds=True),
        "NORMAL": buffer.add(normals, "VEC3", ARRAY),
        "JOINTS_0": buffer.add(bone, "VEC4", ARRAY),
        "WEIGHTS_0": buffer.add(weights, "VEC4", ARRAY, normalized=True),
        "TEXCOORD_0": buffer.add(uv.astype(np.float32), "VEC2", ARRAY),
    }
    return {
        "attributes": attributes,
        "indices": buffer.add(faces.ravel().astype(np.uint16), "SCALAR", ELEMENTS),
        "material": 0,
    }


def _inverse_bind_matrices(bones: Rig) -> NDArray[np.float32]:
    """Matrices (N, 16) from the coordinates of the body in the rest pose to those of each bone.

    Each matrix is stored column by column.
    """
    turn = quat.to_matrix(quat.inv(bones.axes))
    out = np.tile(np.eye(4), (len(turn), 1, 1))
    out[:, :3, :3] = turn
    out[:, :3, 3] = -METRES * np.einsum("bij,bj->bi", turn, bones.places)
    return out.swapaxes(1, 2).reshape(-1, 16).astype(np.float32)


def _animation(motion: BodyMotion, bones: Rig, buffer: _Buffer) -> dict[str, object]:
    """The glTF animation of a motion. What does not move has only the first and the last frame."""
    count, joints = motion.local.shape[:2]
    times = (np.arange(count) / motion.fps).astype(np.float32)
    ends = [0, -1] if count > 2 else slice(None)
    samplers: list[dict[str, object]] = []
    channels: list[dict[str, object]] = []

    def add_channel(node: int, path: str, values: Array, kind: str) -> None:
        """Animate a property (`path`: "translation" or "rotation") of a node. values: for each time."""
        part = ends if np.ptp(values, axis=0).max() < LEAST_MOVEMENT else slice(None)
        moments = buffer.add(times[part], "SCALAR", bounds=True)
        output = buffer.add(values[part].astype(np.float32), kind)
        samplers.append({"input": moments, "output": output, "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    ground = np.zeros((count, 3)) if motion.ground is None else motion.ground
    add_channel(0, "translation", METRES * ground, "VEC3")
    add_channel(1, "translation", METRES * quat.rotate(quat.inv(bones.axes[0]), motion.hips - ground), "VEC3")
    turns = np.tile(quat.IDENTITY, (count, len(bones.names), 1))
    turns[:, 1 : joints + 1] = motion.local
    turns = quat.normalize(quat.continuous(bones.local(turns)))
    for j in range(1, joints + 1):
        add_channel(j, "rotation", _xyzw(turns[:, j]), "VEC4")
    return {"name": motion.name, "samplers": samplers, "channels": channels}


def _xyzw(rotation: Array) -> Array:
    """Quaternions (..., 4) in the order x, y, z, w of glTF, from the order w, x, y, z."""
    return rotation[..., [1, 2, 3, 0]]


def _write(path: str | Path, document: dict[str, object], data: bytes) -> None:
    """Write the .glb file: a header, the document as JSON, and the data. Sizes are multiples of 4 bytes."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)  # 12 bytes of file header, 8 bytes before each chunk
    header = struct.pack("<4sII", b"glTF", 2, length)
    parts = ((text, b"JSON"), (data, b"BIN\0"))
    chunks = [struct.pack("<I4s", len(part), kind) + part for part, kind in parts]
    with atomic_path(path) as temporary:
        temporary.write_bytes(b"".join([header, *chunks]))
