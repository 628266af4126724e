"""A body, its skeleton and its motion as one glTF 2.0 file (.glb) in metres, for game engines."""

from __future__ import annotations

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
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.figure.bind import bind
from hobble.figure.mesh import NEEDED, Mesh, body
from hobble.figure.pack import whole_weights

METRES = 0.01  # metres per centimetre
LEAST_MOVEMENT = 1e-5  # a joint counts as still if each component of its rotation varies by less than this
COLOUR = (0.72, 0.72, 0.69, 1.0)
# Codes of glTF: component types (float, unsigned byte, short, int), then buffer targets.
FLOAT, BYTE, SHORT, INT = 5126, 5121, 5123, 5125
ARRAY, ELEMENTS = 34962, 34963


@dataclass(frozen=True)
class BodyMotion:
    """A motion of the body. root: (F, 3) positions, cm. local: (F, J, 4) local rotations of the joints."""

    name: str
    root: Array = field(repr=False)
    local: Array = field(repr=False)
    fps: float


class _Buffer:
    """The buffer of the .glb file, with the views and accessors of its arrays."""

    def __init__(self) -> None:
        self.bytes = bytearray()
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []

    def add(
        self,
        array: NDArray[Any],
        kind: str,
        component: int,
        *,
        target: int | None = None,
        normalized: bool = False,
        bounds: bool = False,
    ) -> int:
        """Append an array. Returns the index of its accessor.

        kind: the array's type in glTF, such as "VEC3". component: code of the type of its numbers. target:
        code of its use. normalized: whether the integers stand for 0 to 1. bounds: whether the accessor
        states the least and greatest values.
        """
        data = np.ascontiguousarray(array)
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        view: dict[str, object] = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": data.nbytes}
        if target:
            view["target"] = target
        self.bytes += data.astype(data.dtype.newbyteorder("<")).tobytes()
        self.views.append(view)
        count = data.size if kind == "SCALAR" else len(data)
        entry: dict[str, object] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": count,
            "type": kind,
        }
        if normalized:
            entry["normalized"] = True
        if bounds:
            flat = data.reshape(count, -1)
            entry["min"], entry["max"] = (getattr(flat, edge)(axis=0).tolist() for edge in ("min", "max"))
        self.accessors.append(entry)
        return len(self.accessors) - 1


def write_glb(path: str | Path, skeleton: Skeleton, motions: Iterable[BodyMotion] = ()) -> None:
    """Write the body of a skeleton, and its motions as animations.

    In the bind pose, the body stands on the ground (height 0).
    """
    mesh, buffer = body(skeleton), _Buffer()
    nodes = _nodes(skeleton, mesh)
    document: dict[str, object] = {
        "asset": {"version": "2.0", "generator": "Hobble"},
        "scene": 0,
        "scenes": [{"name": skeleton.name or "character", "nodes": [0, len(nodes)]}],
        "nodes": [*nodes, {"name": "body", "mesh": 0, "skin": 0}],
        "meshes": [{"name": "body", "primitives": [_primitive(mesh, buffer)]}],
        "materials": [
            {
                "name": "body",
                "pbrMetallicRoughness": {
                    "baseColorFactor": list(COLOUR),
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                },
            }
        ],
        "skins": [
            {
                "name": "body",
                "skeleton": 0,
                "joints": mesh.bones.tolist(),
                "inverseBindMatrices": buffer.add(_inverse_bind_matrices(mesh), "MAT4", FLOAT),
            }
        ],
    }
    if animations := [_animation(motion, buffer) for motion in motions]:
        document["animations"] = animations
    document |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.bytes)}],
    }
    _write(path, document, bytes(buffer.bytes))


def _nodes(skeleton: Skeleton, mesh: Mesh) -> list[dict[str, object]]:
    """A node for each joint in the bind pose. The body stands on the ground."""
    is_person = all(skeleton.roles.get(role) in skeleton.joints for role in NEEDED)
    world = bind(skeleton).rotations if is_person else np.tile(quat.IDENTITY, (len(skeleton.joints), 1))
    local = local_rotations(skeleton, world)
    offsets = np.array(skeleton.offsets, float)
    offsets[0] = [0.0, -mesh.corners[:, 1].min(), 0.0]
    nodes = []
    for j, name in enumerate(skeleton.joints):
        node: dict[str, object] = {
            "name": name,
            "translation": (METRES * offsets[j]).tolist(),
            "rotation": _xyzw(local[j]).tolist(),
        }
        if children := skeleton.children(j):
            node["children"] = children
        nodes.append(node)
    return nodes


def _primitive(mesh: Mesh, buffer: _Buffer) -> dict[str, object]:
    weights = whole_weights(mesh.weights)
    bone = np.where(weights > 0, mesh.bones_of_corner, 0).astype(np.uint8)
    normals = mesh.normals.astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    wide = len(mesh.corners) > 65535
    faces = mesh.faces.ravel().astype(np.uint32 if wide else np.uint16)
    corners = (METRES * mesh.corners).astype(np.float32)
    return {
        "attributes": {
            "POSITION": buffer.add(corners, "VEC3", FLOAT, target=ARRAY, bounds=True),
            "NORMAL": buffer.add(normals, "VEC3", FLOAT, target=ARRAY),
            "JOINTS_0": buffer.add(bone, "VEC4", BYTE, target=ARRAY),
            "WEIGHTS_0": buffer.add(weights, "VEC4", BYTE, target=ARRAY, normalized=True),
        },
        "indices": buffer.add(faces, "SCALAR", INT if wide else SHORT, target=ELEMENTS),
        "material": 0,
    }


def _inverse_bind_matrices(mesh: Mesh) -> NDArray[np.float32]:
    """Inverse bind matrices (B, 16) of the bones, each column by column."""
    turn = quat.to_matrix(quat.inv(mesh.rotations))
    out = np.tile(np.eye(4), (len(mesh.bones), 1, 1))
    out[:, :3, :3] = turn
    out[:, :3, 3] = -METRES * np.einsum("bij,bj->bi", turn, mesh.positions)
    return out.swapaxes(1, 2).reshape(-1, 16).astype(np.float32)


def _animation(motion: BodyMotion, buffer: _Buffer) -> dict[str, object]:
    """The animation of a motion. A joint that does not move has only the first and the last frame."""
    times = (np.arange(len(motion.root)) / motion.fps).astype(np.float32)
    all_times = buffer.add(times, "SCALAR", FLOAT, bounds=True)
    end_times = buffer.add(times[[0, -1]], "SCALAR", FLOAT, bounds=True) if len(times) > 2 else all_times
    samplers: list[dict[str, object]] = []
    channels: list[dict[str, object]] = []

    def add_channel(node: int, path: str, times: int, values: Array, kind: str) -> None:
        output = buffer.add(values.astype(np.float32), kind, FLOAT)
        samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    add_channel(0, "translation", all_times, METRES * motion.root, "VEC3")
    for j, turns in enumerate(np.moveaxis(_xyzw(quat.normalize(quat.continuous(motion.local))), 1, 0)):
        if len(times) > 2 and np.ptp(turns, axis=0).max() < LEAST_MOVEMENT:
            add_channel(j, "rotation", end_times, turns[[0, -1]], "VEC4")
        else:
            add_channel(j, "rotation", all_times, turns, "VEC4")
    return {"name": motion.name, "samplers": samplers, "channels": channels}


def _xyzw(rotation: Array) -> Array:
    """Quaternions in the order of glTF."""
    return rotation[..., [1, 2, 3, 0]]


def _write(path: str | Path, document: dict[str, object], data: bytes) -> None:
    """Write the .glb container: header, JSON padded with spaces, buffer padded with zeros."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)
    header = struct.pack("<4sII", b"glTF", 2, length)
    chunks = [
        struct.pack("<I4s", len(part), kind) + part for part, kind in ((text, b"JSON"), (data, b"BIN\0"))
    ]
    with atomic_path(path) as temporary:
        temporary.write_bytes(b"".join([header, *chunks]))
