"""The body of a skeleton as a mesh: corners (vertices), triangles and skin weights. Also poses the mesh."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.bind import SIDES, BindPose, bind_pose
from hobble.figure.shape import body_scale, solids_of_person
from hobble.figure.skin import nearest_joints, skin_weights
from hobble.figure.solids import Rod, Solid
from hobble.figure.surface import LARGEST_DISTANCE, FineBox, distance_slopes, surface_distances, surface_mesh

# For a body in the shape of a person, these lengths are multiplied by `body_scale`.
CORNER_SPACING = 1.9  # cm between corners of the mesh on trunk and limbs
FINE_SPACING = {"hand": 0.64, "face": 0.85, "foot": 1.2}  # cm between corners on these finer parts
# cm over which the weights of two bones blend, for each part of the body. "": all other parts.
BLEND_WIDTH = {"": 3.6, "hand": 0.8, "head": 2.6, "foot": 1.8}
# For shading: (distance from a corner at which it is tested whether the body is near, cm; weight).
OCCLUSION_SAMPLES = ((1.5, 0.30), (4.0, 0.30), (9.0, 0.25))
# The roles that a skeleton must have for a body in the shape of a person.
NEEDED = ("hips", "head", *(f"{s}_{r}" for s in SIDES for r in ("shoulder", "hip", "knee", "heel", "toe")))
# If a role of NEEDED is missing, the body consists of rods: half widths at their upper and lower end, cm.
STICK = (2.6, 1.9)


@dataclass(frozen=True)
class Mesh:
    """A body in its bind pose, centimetres.

    corners, normals: (V, 3). faces: (T, 3) indices of corners, counter-clockwise seen from outside. shade:
    (V,) brightness of each corner: 1 if the body covers none of the corner's surroundings, 0.15 if the body
    covers them all. bones: (B,) joints of the skeleton that move the body. bones_of_corner: (V, 4) the bones
    that move each corner, as indices into `bones`. weights: (V, 4) weights of these bones, which sum to 1.
    positions (B, 3), rotations (B, 4): the bones in the bind pose.
    """

    corners: Array = field(repr=False)
    normals: Array = field(repr=False)
    faces: NDArray[np.int64] = field(repr=False)
    shade: Array = field(repr=False)
    bones: NDArray[np.int64] = field(repr=False)
    bones_of_corner: NDArray[np.int64] = field(repr=False)
    weights: Array = field(repr=False)
    positions: Array = field(repr=False)
    rotations: Array = field(repr=False)

    def posed(self, positions: Array, rotations: Array) -> Array:
        """Corners (V, 3) of the body for world positions (B, 3) and rotations (B, 4) of its bones."""
        turn = quat.to_matrix(quat.mul(rotations, quat.inv(self.rotations)))
        move = positions - np.einsum("bij,bj->bi", turn, self.positions)
        return _skinned(self.corners, self.bones_of_corner, self.weights, turn, move)


@njit(nogil=True)
def _skinned(
    corners: Array, bones_of_corner: Any, weights: Array, turn: Array, move: Array
) -> Array:  # pragma: no cover
    """Corners (V, 3), each moved by the rotations (B, 3, 3) and translations (B, 3) of its bones."""
    out = np.zeros_like(corners)
    for v in range(len(corners)):
        x, y, z = corners[v]
        for k in range(bones_of_corner.shape[1]):
            b, weight = bones_of_corner[v, k], weights[v, k]
            if weight == 0:
                continue
            for i in range(3):
                out[v, i] += weight * (turn[b, i, 0] * x + turn[b, i, 1] * y + turn[b, i, 2] * z + move[b, i])
    return out


def body_mesh(skeleton: Skeleton) -> Mesh:
    """The body of a skeleton: a person if the skeleton has the roles NEEDED, else a rod for every bone.

    The mesh depends only on the joints (with their parents and offsets) and the roles. Skeletons that agree
    in these share one mesh.
    """
    return _build_mesh(_joints_and_roles(skeleton))


def mesh_key(skeleton: Skeleton) -> str:
    """A hash that names the body of a skeleton. Skeletons with the same body get the same name."""
    return hashlib.sha256(_joints_and_roles(skeleton).encode()).hexdigest()[:12]


def _joints_and_roles(skeleton: Skeleton) -> str:
    """The parts of a skeleton on which its mesh depends, as JSON."""
    data = skeleton.to_dict()
    return json.dumps({key: data[key] for key in ("joints", "roles")})


@functools.lru_cache(maxsize=8)
def _build_mesh(joints_and_roles: str) -> Mesh:
    """The mesh of the skeleton with these joints and roles (JSON)."""
    skeleton = Skeleton.from_dict({"name": "body", **json.loads(joints_and_roles)})
    is_person = all(skeleton.roles.get(role) in skeleton.joints for role in NEEDED)
    if is_person:
        pose = bind_pose(skeleton)
        solids, scale, fine = list(solids_of_person(pose)), body_scale(pose), _fine_boxes(pose)
        joint_of = pose.joint_of
    else:
        pose, solids, joint_of = _sticks(skeleton)
        scale, fine = 1.0, []
    corners, faces = surface_mesh(solids, CORNER_SPACING * scale, fine)
    slope, _ = distance_slopes(solids, corners)
    normals = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    owner = nearest_joints(solids, corners, joint_of)
    blend_width = _blend_widths(owner, pose, scale) if is_person else 2.0
    bones_of_corner, weights = skin_weights(corners, faces, owner, blend_width)
    used = np.unique(bones_of_corner)
    return Mesh(
        corners,
        normals,
        faces,
        _shade(solids, corners, normals, scale),
        used,
        np.searchsorted(used, bones_of_corner),
        weights,
        pose.positions[used],
        pose.rotations[used],
    )


def _fine_boxes(pose: BindPose) -> list[FineBox]:
    """The boxes around hands, face and feet, in which the mesh is finer."""
    scale, position_of = body_scale(pose), pose.position_of
    out: list[FineBox] = []
    head = position_of["head"]
    low, high = np.array([-8.0, -6.0, -1.0]), np.array([8.0, 12.0, 13.0])
    out.append((head + scale * low, head + scale * high, FINE_SPACING["face"] * scale))
    for side in SIDES:
        wrist = position_of[f"{side}_wrist"]
        ahead = wrist - position_of[f"{side}_elbow"]
        tip = wrist + 18 * scale * ahead / max(float(np.linalg.norm(ahead)), 1e-9)
        low, high = np.minimum(wrist, tip) - 4 * scale, np.maximum(wrist, tip) + 4 * scale
        out.append((low, high, FINE_SPACING["hand"] * scale))
        ankle, ball = position_of[f"{side}_heel"], position_of[f"{side}_toe"]
        low, high = np.minimum(ankle, ball), np.maximum(ankle, ball)
        low = low - scale * np.array([5.0, 3.5, 6.0])
        high = high + scale * np.array([5.0, 0.0, 9.0])
        out.append((low, high, FINE_SPACING["foot"] * scale))
    return out


def _blend_widths(owner: NDArray[np.int64], pose: BindPose, scale: float) -> Array:
    """(V,) cm over which the weights of two bones blend at each corner.

    owner: (V,) result of `nearest_joints`. scale: `body_scale`.
    """
    wide = np.full(len(owner), BLEND_WIDTH[""])
    for part, roles in (
        ("hand", ("left_wrist", "right_wrist")),
        ("head", ("head", "neck")),
        ("foot", ("left_toe", "right_toe", "left_heel", "right_heel")),
    ):
        wide[np.isin(owner, [pose.joint_of[role] for role in roles])] = BLEND_WIDTH[part]
    return wide * scale


def _shade(solids: Sequence[Solid], corners: Array, normals: Array, scale: float) -> Array:
    """`Mesh.shade` (V,). A corner is dark if points above it, on its normal, are near to the body."""
    shade = np.ones(len(corners))
    for away, weight in OCCLUSION_SAMPLES:
        height = scale * away
        # If nothing else is near, the distance of the point from the body is its height above the corner.
        free = np.clip(
            surface_distances(solids, corners + height * normals), 0, min(height, LARGEST_DISTANCE)
        )
        shade -= weight * (1 - free / height)
    return np.clip(shade, 0, 1)


def _sticks(skeleton: Skeleton) -> tuple[BindPose, list[Solid], dict[str, int]]:
    """A body of rods. Returns the rest pose, a rod for every bone, and joint name -> index."""
    count = len(skeleton.joints)
    positions = np.zeros((count, 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            positions[j] = positions[p] + skeleton.offsets[j]
    joint_of = {name: j for j, name in enumerate(skeleton.joints)}
    pose = BindPose(positions, np.tile(quat.IDENTITY, (count, 1)), joint_of, {})

    def rods() -> Iterator[Solid]:
        for j, p in enumerate(skeleton.parents):
            if p >= 0:
                yield Rod(1.0, ((-np.inf, skeleton.joints[p]),), positions[p], positions[j], *STICK)

    return (
        pose,
        list(rods()) or [Rod(1.0, ((-np.inf, skeleton.joints[0]),), positions[0], positions[0], *STICK)],
        joint_of,
    )
