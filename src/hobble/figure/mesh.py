"""The body of a skeleton as a mesh: the sculpted figure, fitted to the skeleton, with weights of bones.

benchmarks/derive_body.py sculpts the figure. Its arms and legs are a little spread, as in `modelled_pose`.
"""

import functools
import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.compiled import njit
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import LIMB_PARTS, NEEDED_ROLES, Skeleton, path_between, rest_positions

FIGURE = Path(__file__).with_name("body.npz")
TEXTURE = Path(__file__).with_name("body.jpg")
SIDES = ("left", "right")
ARMS_DOWN = np.radians(45.0)  # angle of the arms below the horizontal
LEGS_OUT = np.radians(5.0)  # angle between the legs and the vertical
SHORTEST_BONE = 0.5  # cm; a shorter bone is not turned, because it hardly has a direction
LEG_LENGTH, TOE_HEIGHT = 81.0, 2.5  # cm, of the figure: from hip to ankle; from sole to ball of the foot
MOST_BONES = 4  # at most this many bones move a corner


@dataclass(frozen=True)
class Pose:
    """World positions (J, 3) in cm and rotations (J, 4) of all joints.

    joint_of: role -> index of the joint that moves the part of the body below it. For "left_knee", this part
    is the shank. If the skeleton has no joint for a role, the index is that of a joint near by. position_of:
    role -> position (3,) of its joint, cm. It is estimated if the skeleton has no joint for the role.
    """

    positions: Array
    rotations: Array
    joint_of: dict[str, int]
    position_of: dict[str, Array]


def modelled_pose(skeleton: Skeleton) -> Pose:
    """A skeleton in the pose of the sculpted figure: arms and legs are spread, so that no parts touch.

    Its rest pose must stand and face +Z (see config/skeletons/README.md). Raises KeyError if one of
    `hobble.core.skeleton.NEEDED_ROLES` is missing.
    """
    joint_of, rest = _find_bones(skeleton), rest_positions(skeleton)
    aims = _bone_directions(joint_of)
    rotations, positions = np.tile(quat.IDENTITY, (len(rest), 1)), np.zeros_like(rest)
    heels = {joint_of[f"{side}_heel"] for side in SIDES}  # the feet stay as in the rest pose
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            rotations[j] = rotations[p]
            positions[j] = positions[p] + quat.rotate(rotations[p], skeleton.offsets[j])
        if j in heels:
            rotations[j] = quat.IDENTITY
        elif j in aims:
            below, direction = aims[j]
            bone = quat.rotate(rotations[j], rest[below] - rest[j])
            if np.linalg.norm(bone) > SHORTEST_BONE:
                rotations[j] = quat.mul(quat.between(bone, direction), rotations[j])
    at = {role: positions[skeleton.role(role)] for role in skeleton.roles}
    # Rough proportions of a person.
    middle = (at["left_shoulder"] + at["right_shoulder"]) / 2
    at.setdefault("neck", middle + 0.35 * (at["head"] - middle))
    at.setdefault("chest", at["hips"] + 0.62 * (at["neck"] - at["hips"]))
    at.setdefault("spine", at["hips"] + 0.45 * (at["chest"] - at["hips"]))
    return Pose(positions, rotations, joint_of, at)


def _find_bones(skeleton: Skeleton) -> dict[str, int]:
    """`Pose.joint_of` for a skeleton."""
    found = {role: skeleton.role(role) for role in {*NEEDED_ROLES, *skeleton.roles}}
    found.setdefault("neck", max(skeleton.parents[found["head"]], 0))
    left, right = (skeleton.path_up(found[f"{side}_shoulder"]) for side in SIDES)
    found.setdefault("chest", next(joint for joint in left if joint in right))
    # The first joint on the way from the hips to the chest, if there is one.
    found.setdefault("spine", path_between(skeleton.parents, found["hips"], found["chest"])[:2][-1])
    return found


def _bone_directions(joint_of: dict[str, int]) -> dict[int, tuple[int, Array]]:
    """For joints of arms and legs: joint -> (joint below it, direction (3,) of the bone between them)."""
    out = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):  # the left side is at +X
        # The arms point a little to the front (+Z).
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        leg = np.array([sign * np.sin(LEGS_OUT), -np.cos(LEGS_OUT), 0.0])
        for a, b, direction in (
            ("shoulder", "elbow", arm), ("elbow", "wrist", arm), ("hip", "knee", leg), ("knee", "heel", leg),
        ):  # fmt: skip
            upper, lower = joint_of[f"{side}_{a}"], joint_of[f"{side}_{b}"]
            if upper != lower:
                out[upper] = (lower, direction / np.linalg.norm(direction))
    return out


@dataclass(frozen=True)
class Mesh:
    """A body in the rest pose of its skeleton, centimetres.

    corners, normals: (V, 3). faces: (T, 3) indices of corners, counter-clockwise seen from outside. coarse:
    fewer triangles between some of the corners, for slow machines. shade: (V,) brightness of each corner: 1
    if the body covers none of the corner's surroundings, 0.15 if the body covers them all. uv: (T, 3, 2)
    where each corner of a triangle is in the texture, x to the right and y down, from 0 to 1. bones: (B,)
    joints of the skeleton that move the body. bones_of_corner: (V, 4) the bones that move each corner, as
    indices into `bones`. weights: (V, 4) weights of these bones, which sum to 1. positions: (B, 3) of the
    bones in the rest pose, in which no bone is turned.
    """

    corners: Array = field(repr=False)
    normals: Array = field(repr=False)
    faces: NDArray[np.int64] = field(repr=False)
    coarse: NDArray[np.int64] = field(repr=False)
    shade: Array = field(repr=False)
    uv: Array = field(repr=False)
    bones: NDArray[np.int64] = field(repr=False)
    bones_of_corner: NDArray[np.int64] = field(repr=False)
    weights: Array = field(repr=False)
    positions: Array = field(repr=False)

    def posed(self, positions: Array, rotations: Array) -> Array:
        """Corners (V, 3) of the body for world positions (B, 3) and rotations (B, 4) of its bones."""
        turn = quat.to_matrix(rotations)
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
    """The body of a skeleton.

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
    figure, pose, rest = load_npz(FIGURE), modelled_pose(skeleton), rest_positions(skeleton)
    roles, bones, weights = figure["roles"].tolist(), figure["bones"], figure["weights"].astype(float)
    weights /= weights.sum(axis=1, keepdims=True)
    sculpted = dict(zip(roles, figure["joints"].astype(float), strict=True))
    fit, fit_move = _fit(sculpted, pose.position_of, roles)
    corners, normals = figure["corners"].astype(float), figure["normals"].astype(float)
    linear = np.einsum("vk,vkij->vij", weights, fit[bones])
    corners = np.einsum("vij,vj->vi", linear, corners) + np.einsum("vk,vki->vi", weights, fit_move[bones])
    normals = np.linalg.solve(linear.swapaxes(1, 2), normals[..., None])[..., 0]
    # The corners in the rest pose are those that the bones move to the modelled ones. So a figure whose arms
    # hang has the shape that was sculpted.
    joints = np.array([pose.joint_of[role] for role in roles])
    turn = quat.to_matrix(pose.rotations[joints])
    move = pose.positions[joints] - np.einsum("bij,bj->bi", turn, rest[joints])
    linear = np.einsum("vk,vkij->vij", weights, turn[bones])
    moved = corners - np.einsum("vk,vki->vi", weights, move[bones])
    corners = np.linalg.solve(linear, moved[..., None])[..., 0]
    normals = np.einsum("vij,vi->vj", linear, normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    used = np.unique(joints)
    shares = np.zeros((len(corners), len(used)))  # of a joint that has several roles, they are added up
    np.add.at(shares, (np.arange(len(corners))[:, None], np.searchsorted(used, joints)[bones]), weights)
    order = np.argsort(-shares, axis=1)[:, :MOST_BONES]
    return Mesh(
        corners,
        normals,
        figure["faces"].astype(np.int64),
        figure["coarse"].astype(np.int64),
        figure["shade"] / 255,
        figure["uv"] / 65535,
        used,
        order,
        np.take_along_axis(shares, order, axis=1),
        rest[used],
    )


def _fit(figure: dict[str, Array], body: dict[str, Array], roles: list[str]) -> tuple[Array, Array]:
    """Matrices (B, 3, 3) and vectors (B, 3) that fit each bone's part of the figure to a body.

    figure, body: role -> position of its joint in the modelled pose.
    """
    bones = [(f"{s}_{a}", f"{s}_{b}") for s in SIDES for a, b in (("heel", "knee"), ("knee", "hip"))]
    length = sum(float(np.linalg.norm(body[a] - body[b])) for a, b in bones)
    scale = max(length / (2 * LEG_LENGTH), 0.05)
    before, after = _bone_axes(figure, 1.0), _bone_axes(body, scale)
    fit, move = [], []
    for role in roles:
        (old_origin, old), (origin, new) = before[role], after[role]
        least = 0.3 * scale * np.linalg.norm(old[:, 1])
        if np.linalg.norm(new[:, 1]) < least:  # the two joints of this bone are at the same place
            new = np.stack([new[:, 0], 0.3 * scale * old[:, 1], new[:, 2]], axis=1)
        fit.append(new @ np.linalg.inv(old))
        move.append(origin - fit[-1] @ old_origin)
    return np.array(fit), np.array(move)


def _bone_axes(at: dict[str, Array], scale: float) -> dict[str, tuple[Array, Array]]:
    """For each role: where its bone begins, and a matrix whose columns go across, along and out of the bone.

    The lengths of the columns are sizes of the body. Those along a bone go from joint to joint. at: role ->
    position. scale: size of the body, where no joint tells a size.
    """
    x, y, z = scale * np.eye(3)
    hips, shoulders = (at[f"left_{role}"] - at[f"right_{role}"] for role in ("hip", "shoulder"))
    hips, shoulders = hips * [1.0, 0, 0], shoulders * [1.0, 0, 0]
    middle = (at["left_hip"] + at["right_hip"]) / 2
    out = {
        "hips": (middle, [hips, at["spine"] - middle, z]),
        "spine": (at["spine"], [(hips + shoulders) / 2, at["chest"] - at["spine"], z]),
        "chest": (at["chest"], [shoulders, at["neck"] - at["chest"], z]),
        "neck": (at["neck"], [x, at["head"] - at["neck"], z]),
        "head": (at["head"], [x, y, z]),
    }
    for side in SIDES:
        shoulder, elbow, wrist, hip, knee, heel, toe = (at[f"{side}_{part}"] for part in LIMB_PARTS)
        hand = scale * _unit(wrist - elbow)
        for role, start, along in (
            ("hip", hip, knee - hip), ("knee", knee, heel - knee), ("shoulder", shoulder, elbow - shoulder),
            ("elbow", elbow, wrist - elbow), ("wrist", wrist, hand),
        ):  # fmt: skip
            across = scale * _unit(np.cross(along, z))
            out[f"{side}_{role}"] = (start, [across, along, scale * _unit(np.cross(across, along))])
        way = (toe - heel) * [1.0, 0.0, 1.0]
        way = way if np.linalg.norm(way) > scale else z
        across, tall = scale * _unit(np.cross(y, way)), max(heel[1] - toe[1] + TOE_HEIGHT * scale, 3 * scale)
        out[f"{side}_heel"] = (heel, [across, way, tall * np.array([0.0, 1, 0])])
        out[f"{side}_toe"] = (toe, [across, scale * _unit(way), y])
    return {role: (origin, np.stack(columns, axis=1)) for role, (origin, columns) in out.items()}


def _unit(v: Array) -> Array:
    return v / max(float(np.linalg.norm(v)), 1e-9)
