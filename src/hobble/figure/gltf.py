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
from hobble.figure.mesh import NEEDED, Mesh, bind_pose, body_mesh
from hobble.figure.pack import whole_weights

METRES = 0.01  # metres per centimetre
LEAST_MOVEMENT = 1e-5  # a joint counts as still if each component of its rotation varies by less than this
COLOUR = (0.72, 0.72, 0.69, 1.0)  # of the body: red, green, blue, opacity
# Codes of glTF for the type of the numbers (float; unsigned byte, short, int) and for the use of an array
# (data of vertices, indices of triangles).
FLOAT, BYTE, SHORT, INT = 5126, 5121, 5123, 5125
ARRAY, ELEMENTS = 34962, 34963


@dataclass(frozen=True)
class BodyMotion:
    """A motion of the body. root: (F, 3) positions of the root, cm. local: (F, J, 4) local rotations."""

    name: str
    root: Array = field(repr=False)
    local: Array = field(repr=False)
    fps: float


class _Buffer:
    """The binary data of the .glb file. glTF describes each array in it by a view and an accessor.

    A view says which bytes belong to the array. An accessor says what they mean.
    """

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

        kind: the type of an element in glTF, such as "VEC3". component: code of the type of the numbers, such
        as FLOAT. target: code of the array's use, such as ARRAY. normalized: whether the integers stand for
        numbers from 0 to 1. bounds: whether the accessor states the smallest and largest values.
        """
        data = np.ascontiguousarray(array)
        self.bytes += b"\0" * (-len(self.bytes) % 4)  # each array starts at a multiple of 4 bytes
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
    mesh, buffer = body_mesh(skeleton), _Buffer()
    nodes = _nodes(skeleton, mesh)
    document: dict[str, object] = {
        "asset": {"version": "2.0", "generator": "Hobble"},
        "scene": 0,
        # The first node is the root joint. The node of the body comes after those of the joints.
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
    """A glTF node for each joint, in the bind pose. The lowest corner of the body is at height 0."""
    is_person = all(skeleton.roles.get(role) in skeleton.joints for role in NEEDED)
    world = bind_pose(skeleton).rotations if is_person else np.tile(quat.IDENTITY, (len(skeleton.joints), 1))
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
    """The glTF description of the mesh. Its arrays are appended to the buffer."""
    weights = whole_weights(mesh.weights)
    # glTF wants bone 0 where the weight is 0.
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
    """Matrices (B, 16) from the coordinates of the body in the bind pose to those of each bone.

    Each matrix is stored column by column.
    """
    turn = quat.to_matrix(quat.inv(mesh.rotations))
    out = np.tile(np.eye(4), (len(mesh.bones), 1, 1))
    out[:, :3, :3] = turn
    out[:, :3, 3] = -METRES * np.einsum("bij,bj->bi", turn, mesh.positions)
    return out.swapaxes(1, 2).reshape(-1, 16).astype(np.float32)


def _animation(motion: BodyMotion, buffer: _Buffer) -> dict[str, object]:
    """The glTF animation of a motion. A joint that does not turn has only the first and the last frame."""
    times = (np.arange(len(motion.root)) / motion.fps).astype(np.float32)
    # Accessors of the times of all frames, and of the first and the last frame.
    all_times = buffer.add(times, "SCALAR", FLOAT, bounds=True)
    end_times = buffer.add(times[[0, -1]], "SCALAR", FLOAT, bounds=True) if len(times) > 2 else all_times
    samplers: list[dict[str, object]] = []
    channels: list[dict[str, object]] = []

    def add_channel(node: int, path: str, times_accessor: int, values: Array, kind: str) -> None:
        """Animate a property (`path`: "translation" or "rotation") of a node. values: for each time."""
        output = buffer.add(values.astype(np.float32), kind, FLOAT)
        samplers.append({"input": times_accessor, "output": output, "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    add_channel(0, "translation", all_times, METRES * motion.root, "VEC3")
    for j, turns in enumerate(np.moveaxis(_xyzw(quat.normalize(quat.continuous(motion.local))), 1, 0)):
        if len(times) > 2 and np.ptp(turns, axis=0).max() < LEAST_MOVEMENT:
            add_channel(j, "rotation", end_times, turns[[0, -1]], "VEC4")
        else:
            add_channel(j, "rotation", all_times, turns, "VEC4")
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
    chunks = [
        struct.pack("<I4s", len(part), kind) + part for part, kind in ((text, b"JSON"), (data, b"BIN\0"))
    ]
    with atomic_path(path) as temporary:
        temporary.write_bytes(b"".join([header, *chunks]))


# Joint rotations from joint positions.


SAME_PLACE = 0.1  # cm; joints that are closer together count as being at the same place


def fitted_rotations(skeleton: Skeleton, positions: Array) -> Array:
    """World rotations (F, J, 4) that turn the bones to the joint positions (F, J, 3) as well as possible.

    A joint with one bone below it starts at the rotation of its parent and turns by the smallest angle to the
    direction of the bone. A joint with several bones below it gets the rotation that fits them best (Kabsch,
    1976). A joint without bones below it turns with its parent.
    """
    rotations = np.tile(quat.IDENTITY, (*positions.shape[:2], 1))
    for j, parent in enumerate(skeleton.parents):
        of_parent = rotations[:, parent] if parent >= 0 else rotations[:, j]
        below = [(k, rest) for k, rest in _bones_below(skeleton, j) if np.linalg.norm(rest) > SAME_PLACE]
        if not below:
            rotations[:, j] = of_parent
        elif len(below) == 1:
            k, rest = below[0]
            now = positions[:, k] - positions[:, j]
            rotations[:, j] = quat.mul(quat.between(quat.rotate(of_parent, rest), now), of_parent)
        else:
            rest = np.array([offset for _, offset in below])
            now = positions[:, [k for k, _ in below]] - positions[:, j, None]
            rotations[:, j] = _kabsch(rest, now)
    return rotations


def _bones_below(skeleton: Skeleton, joint: int) -> list[tuple[int, Array]]:
    """The nearest descendants at another place: (index, vector (3,) from `joint` in the rest pose, cm)."""
    out: list[tuple[int, Array]] = []
    for child in skeleton.children(joint):
        offset = np.asarray(skeleton.offsets[child], float)
        if np.linalg.norm(offset) > SAME_PLACE:
            out.append((child, offset))
        else:
            out += [(k, offset + rest) for k, rest in _bones_below(skeleton, child)]
    return out


def _kabsch(rest: Array, now: Array) -> Array:
    """Rotations (F, 4) that best turn the K vectors `rest` (K, 3) to the vectors `now` (F, K, 3)."""
    u, _, vt = np.linalg.svd(np.einsum("fki,kj->fij", now, rest))
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., -1] *= sign[:, None]  # a mirror image is not a rotation
    return quat.from_matrix(u @ vt)
