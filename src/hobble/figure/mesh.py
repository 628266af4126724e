"""The body of a skeleton as a mesh: corners, triangles, skin weights, and posing."""

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
from hobble.figure.bind import SIDES, BindPose, bind
from hobble.figure.shape import person, scale
from hobble.figure.skin import owners, spread
from hobble.figure.solids import Rod, Solid
from hobble.figure.surface import FAR, Fine, distances, slopes, surface

STEP = 1.9  # cm between corners of the mesh on trunk and limbs
FINE_STEPS = {"hand": 0.64, "face": 0.85, "foot": 1.2}  # cm between corners on finer parts
# cm over which the weights of two bones blend; "": all other parts
BLEND_WIDTH = {"": 3.6, "hand": 0.8, "head": 2.6, "foot": 1.8}
OCCLUSION_SAMPLES = (
    (1.5, 0.30),
    (4.0, 0.30),
    (9.0, 0.25),
)  # distances (cm) at which surroundings are sampled for shading, with weights
NEEDED = ("hips", "head", *(f"{s}_{r}" for s in SIDES for r in ("shoulder", "hip", "knee", "heel", "toe")))
STICK = (2.6, 1.9)  # cm, half widths at both ends of a bone, for a skeleton without roles


@dataclass(frozen=True)
class Mesh:
    """A body in its bind pose, centimetres.

    corners, normals: (V, 3). faces: (T, 3) indices of corners, counter-clockwise seen from outside. shade:
    (V,) how little of a corner's surroundings is covered by the body, 0 to 1. bones: (B,) joints of the
    skeleton that move the body. bones_of_corner: (V, 4) the bones that move each corner, as indices into
    `bones`. weights: (V, 4) their weights, which sum to 1. positions (B, 3), rotations (B, 4): the bones in
    the bind pose.
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
        """Corners (V, 3) with the bones at world positions (B, 3) and rotations (B, 4)."""
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


def body(skeleton: Skeleton) -> Mesh:
    """The body of a skeleton: a person if the skeleton has the roles NEEDED, else a rod for every bone.

    It depends only on joints, offsets and roles. Skeletons that agree in these share one mesh.
    """
    return _mesh_of(_mesh_key_text(skeleton))


def key(skeleton: Skeleton) -> str:
    """A name for the body of a skeleton. Skeletons with the same body get the same name."""
    return hashlib.sha256(_mesh_key_text(skeleton).encode()).hexdigest()[:12]


def _mesh_key_text(skeleton: Skeleton) -> str:
    data = skeleton.to_dict()
    return json.dumps({key: data[key] for key in ("joints", "roles")})


@functools.lru_cache(maxsize=8)
def _mesh_of(text: str) -> Mesh:
    skeleton = Skeleton.from_dict({"name": "body", **json.loads(text)})
    known = all(skeleton.roles.get(role) in skeleton.joints for role in NEEDED)
    if known:
        stand = bind(skeleton)
        solids, size, fine = list(person(stand)), scale(stand), _fine(stand)
        bones = stand.bones
    else:
        stand, solids, bones = _sticks(skeleton)
        size, fine = 1.0, []
    corners, faces = surface(solids, STEP * size, fine)
    slope, _ = slopes(solids, corners)
    normals = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    owner = owners(solids, corners, bones)
    bones_of_corner, weights = spread(corners, faces, owner, _reach(owner, stand, size) if known else 2.0)
    used = np.unique(bones_of_corner)
    return Mesh(
        corners,
        normals,
        faces,
        _shade(solids, corners, normals, size),
        used,
        np.searchsorted(used, bones_of_corner),
        weights,
        stand.positions[used],
        stand.rotations[used],
    )


def _fine(stand: BindPose) -> list[Fine]:
    """The boxes in which the mesh is finer: hands, face, feet."""
    size, at = scale(stand), stand.at
    out: list[Fine] = []
    head = at["head"]
    low, high = np.array([-8.0, -6.0, -1.0]), np.array([8.0, 12.0, 13.0])
    out.append((head + size * low, head + size * high, FINE_STEPS["face"] * size))
    for side in SIDES:
        wrist = at[f"{side}_wrist"]
        ahead = wrist - at[f"{side}_elbow"]
        tip = wrist + 18 * size * ahead / max(float(np.linalg.norm(ahead)), 1e-9)
        out.append(
            (np.minimum(wrist, tip) - 4 * size, np.maximum(wrist, tip) + 4 * size, FINE_STEPS["hand"] * size)
        )
        ankle, ball = at[f"{side}_heel"], at[f"{side}_toe"]
        low, high = np.minimum(ankle, ball), np.maximum(ankle, ball)
        low = low - size * np.array([5.0, 3.5, 6.0])
        high = high + size * np.array([5.0, 0.0, 9.0])
        out.append((low, high, FINE_STEPS["foot"] * size))
    return out


def _reach(owner: NDArray[np.int64], stand: BindPose, size: float) -> Array:
    """The distance (V,) in cm over which the weights of two bones blend at each corner."""
    wide = np.full(len(owner), BLEND_WIDTH[""])
    for part, roles in (
        ("hand", ("left_wrist", "right_wrist")),
        ("head", ("head", "neck")),
        ("foot", ("left_toe", "right_toe", "left_heel", "right_heel")),
    ):
        wide[np.isin(owner, [stand.bones[role] for role in roles])] = BLEND_WIDTH[part]
    return wide * size


def _shade(solids: Sequence[Solid], corners: Array, normals: Array, size: float) -> Array:
    """`Mesh.shade` (V,), from the distances to the body at points along each normal (OCCLUSION_SAMPLES)."""
    shade = np.ones(len(corners))
    for away, weight in OCCLUSION_SAMPLES:
        reach = size * away
        found = np.clip(distances(solids, corners + reach * normals), 0, min(reach, FAR))
        shade -= weight * (1 - found / reach)
    return np.clip(shade, 0, 1)


def _sticks(skeleton: Skeleton) -> tuple[BindPose, list[Solid], dict[str, int]]:
    """The rest pose, a rod for every bone in it, and joint name -> index."""
    count = len(skeleton.joints)
    positions = np.zeros((count, 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            positions[j] = positions[p] + skeleton.offsets[j]
    bones = {name: j for j, name in enumerate(skeleton.joints)}
    stand = BindPose(positions, np.tile(quat.IDENTITY, (count, 1)), bones, {})

    def rods() -> Iterator[Solid]:
        for j, p in enumerate(skeleton.parents):
            if p >= 0:
                yield Rod(1.0, ((-np.inf, skeleton.joints[p]),), positions[p], positions[j], *STICK)

    return (
        stand,
        list(rods()) or [Rod(1.0, ((-np.inf, skeleton.joints[0]),), positions[0], positions[0], *STICK)],
        bones,
    )
