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
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.figure.mesh import TEXTURE, Mesh, body_mesh
from hobble.figure.pack import whole_weights

METRES = 0.01  # metres per centimetre
LEAST_MOVEMENT = 1e-5  # a joint counts as still if each component of its rotation varies by less than this
COLOUR = (0.72, 0.72, 0.69, 1.0)  # of the body: red, green, blue, opacity
ROOT_LENGTH = 20.0  # cm, of the bone on the ground
# Codes of glTF for the type of numbers, and for the use of an array (vertices, indices of triangles).
COMPONENTS = {"float32": 5126, "uint8": 5121, "uint16": 5123, "uint32": 5125}
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


@dataclass(frozen=True)
class Rig:
    """The bones of the file in the rest pose, which is that of the skeleton, standing on the ground.

    The first bone is `root`, on the ground below the hips. Then come the J joints of the skeleton, then ends:
    a bone without children that gives a length to the one above it. y of a bone's axes points along it.
    Across a limb, x is the axis about which it bends.

    names: (N,). parents: (N,), -1 for `root`. axes: (N, 4) rotations, places: (N, 3) in the world, cm.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    axes: Array = field(repr=False)
    places: Array = field(repr=False)

    def local(self, rotations: Array) -> Array:
        """Rotations (..., N, 4) of the bones relative to their parents, from those of the skeleton."""
        before = quat.inv(np.concatenate([quat.IDENTITY[None], self.axes])[np.array(self.parents) + 1])
        return quat.mul(quat.mul(before, rotations), self.axes)


def rig_of(skeleton: Skeleton, mesh: Mesh) -> Rig:
    """The bones of a skeleton whose body is `mesh`."""
    height = np.array([0.0, -mesh.corners[:, 1].min(), 0.0])
    places = rest_positions(skeleton) + height
    ways = _bone_ways(skeleton)
    names, parents = ["root", *skeleton.joints], [-1, *(p + 1 for p in skeleton.parents)]
    axes = np.array([_axes_along(way) for way in [np.array([0.0, 0, 1]), *ways]])
    sites = {name: np.array(end, float) for name, end in skeleton.end_sites.items() if np.any(end)}
    ends = [(0, np.array([0.0, 0, ROOT_LENGTH]))]
    ends += [(skeleton.index(name) + 1, end) for name, end in sites.items()]
    of = [parent for parent, _ in ends]
    all_places = np.concatenate([[np.zeros(3)], places])
    return Rig(
        (*names, *(f"{names[parent]}_end" for parent in of)),
        (*parents, *of),
        np.concatenate([axes, axes[of]]),
        np.concatenate([all_places, all_places[of] + [way for _, way in ends]]),
    )


def _bone_ways(skeleton: Skeleton) -> list[Array]:
    """For each joint, a vector (3,) along its bone in the rest pose: the straightest way on, of all below."""
    ways: list[Array] = []
    for j, parent in enumerate(skeleton.parents):
        before = ways[parent] if parent >= 0 else np.array([0.0, 1, 0])
        below = [way for _, way in _bones_below(skeleton, j)]
        if not below and np.any(end := skeleton.end_sites.get(skeleton.joints[j], (0.0, 0.0, 0.0))):
            below = [np.array(end, float)]
        straight = [way @ before / np.linalg.norm(way) for way in below]
        ways.append(below[int(np.argmax(straight))] if below else before)
    return ways


def _axes_along(way: Array) -> Array:
    """The axes (4,) of a bone along `way`: y along it, z to the front, or up if the bone points ahead."""
    y = way / np.linalg.norm(way)
    z = np.array([0.0, 0, 1]) if abs(y[2]) < np.sqrt(0.5) else np.array([0.0, 1, 0])
    x = np.cross(y, z)
    x /= np.linalg.norm(x)
    return np.asarray(quat.from_matrix(np.stack([x, y, np.cross(x, y)], axis=1)))


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
    material: dict[str, object] = {"metallicFactor": 0.0, "roughnessFactor": 0.8}
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
    }
    if mesh.uv is None:
        material["baseColorFactor"] = list(COLOUR)
    else:
        material["baseColorTexture"] = {"index": 0}
        document |= {
            "textures": [{"source": 0, "sampler": 0}],
            "samplers": [{}],
            "images": [
                {
                    "name": "clay",
                    "mimeType": "image/jpeg",
                    "bufferView": buffer.add_bytes(TEXTURE.read_bytes()),
                }
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
    uv = np.zeros((len(mesh.faces), 3, 2)) if mesh.uv is None else mesh.uv
    found, faces = np.unique(
        np.column_stack([mesh.faces.ravel(), uv.reshape(-1, 2)]), axis=0, return_inverse=True
    )
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
    }
    if mesh.uv is not None:
        attributes["TEXCOORD_0"] = buffer.add(uv.astype(np.float32), "VEC2", ARRAY)
    wide = np.uint32 if len(corner) > 65535 else np.uint16
    return {
        "attributes": attributes,
        "indices": buffer.add(faces.ravel().astype(wide), "SCALAR", ELEMENTS),
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
