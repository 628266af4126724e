"""Packs a body for a web page: its arrays become integers in base64.

Also finds the links that move with each bone. A link is a pair of joints between which a body can be hurt.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core.files import to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import Mesh, body_mesh
from hobble.figure.rig import rig_of

UNIT = 0.01  # cm; positions of corners are stored as multiples of this


def packed_body(skeleton: Skeleton) -> dict[str, Any]:
    """The mesh of a skeleton's body, and the data with which a page moves it.

    Most keys are fields of `Mesh`. `corners` are in multiples of `unit` (cm), `normals` of 1/127, `shade` of
    1/255. `bone`, `share`: the `bones_of_corner` and
    `weights` of `Mesh`, weights in multiples of 1/255. `keep`: the joints that are bones of the mesh.
    `places`: positions of these joints in the rest pose. `balls`: result of `part_spheres`. `rig`: the bones
    of `rig_of`, for files, the joints of the skeleton from number 1 on.
    """
    mesh = body_mesh(skeleton)
    bones = rig_of(skeleton, mesh)
    return {
        "unit": UNIT,
        "corners": to_base64(np.round(mesh.corners / UNIT).astype(np.int16)),
        "normals": to_base64(np.round(mesh.normals * 127).astype(np.int8)),
        "shade": to_base64(np.round(mesh.shade * 255).astype(np.uint8)),
        "faces": to_base64(mesh.faces.astype(np.uint16)),
        "coarse": to_base64(mesh.coarse.astype(np.uint16)),
        "bone": to_base64(mesh.bones_of_corner.astype(np.uint8)),
        "share": to_base64(whole_weights(mesh.weights)),
        "keep": mesh.bones.tolist(),
        "places": np.round(mesh.positions, 4).tolist(),
        "balls": np.round(part_spheres(mesh), 2).tolist(),
        "rig": {
            "names": bones.names,
            "parents": bones.parents,
            "joints": len(skeleton.joints),
            "axes": np.round(bones.axes, 7).tolist(),
            "places": np.round(bones.places, 5).tolist(),
        },
    }


def part_spheres(mesh: Mesh) -> Array:
    """(B, 4) a sphere for the part of the body that each bone moves.

    Columns: centre (x, y, z) in the coordinates of the bone, and radius, cm. All are 0 if the bone is the
    main bone of no corner. The spheres stand for the body where a rough shape is enough, for example for its
    shadow on the ground.
    """
    out = np.zeros((len(mesh.bones), 4))
    main_bone = np.take_along_axis(mesh.bones_of_corner, mesh.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    for b in range(len(mesh.bones)):
        if not (moved := main_bone == b).any():
            continue
        local = mesh.corners[moved] - mesh.positions[b]
        low, high = local.min(axis=0), local.max(axis=0)
        # The radius is the geometric mean of the half edges of the box around these corners.
        out[b] = [*(low + high) / 2, float(np.prod((high - low) / 2) ** (1 / 3))]
    return out


def whole_weights(weights: Array) -> NDArray[np.uint8]:
    """Weights (V, 4), which sum to 1, as integers (V, 4), which sum to 255.

    The weights are rounded down. The largest one of each corner gets what is missing.
    """
    whole = np.floor(weights * 255).astype(np.int64)
    whole[np.arange(len(whole)), weights.argmax(axis=1)] += 255 - whole.sum(axis=1)
    return whole.astype(np.uint8)


def links_of_bones(skeleton: Skeleton, links: Sequence[str]) -> list[list[int]]:
    """For each bone of the body, the indices of the `links` that move with it.

    links: names such as "LeftUpLeg-LeftLeg", upper joint first. A link belongs to the bone that moves its
    upper joint. But the body branches at the hips and the chest. A link that starts there belongs to the bone
    to which it leads, such as that of a thigh.
    """
    bones = body_mesh(skeleton).bones.tolist()
    branching = {
        skeleton.role(role) for role in ("hips", "chest") if skeleton.roles.get(role) in skeleton.joints
    }
    links_of_bones: list[list[int]] = [[] for _ in bones]
    for index, ends in enumerate(link_ends(skeleton.joints, links)):
        if ends is None:
            continue
        upper, lower = ends
        bone = upper
        while bone not in bones and skeleton.parents[bone] >= 0:
            bone = skeleton.parents[bone]
        if bone in branching:
            bone = next((j for j in _below(skeleton, lower) if j in bones), bone)
        if bone in bones:
            links_of_bones[bones.index(bone)].append(index)
    return links_of_bones


def _below(skeleton: Skeleton, joint: int) -> list[int]:
    """The joint and all its descendants, nearest first."""
    out = [joint]
    for j in out:
        out += skeleton.children(j)
    return out


def link_ends(joints: Sequence[str], links: Sequence[str]) -> list[tuple[int, int] | None]:
    """(upper, lower) joint index of each link, None if one of its joints is unknown.

    joints: all joint names. links: names of the form "upper-lower". Joint names may contain hyphens, so the
    name of a link is split at each of its hyphens in turn, until both parts are joints.
    """
    pairs: list[tuple[int, int] | None] = []
    for link in links:
        pieces = link.split("-")
        splits = [("-".join(pieces[:i]), "-".join(pieces[i:])) for i in range(1, len(pieces))]
        known = [(joints.index(a), joints.index(b)) for a, b in splits if a in joints and b in joints]
        pairs.append(known[0] if known else None)
    return pairs
