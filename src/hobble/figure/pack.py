"""A body for other programs: its bones, and its arrays as integers in base64 for a web page.

Also finds the links that move with each bone. A link is a pair of joints between which a body can be hurt.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.files import to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, path_to_root, rest_positions
from hobble.figure.mesh import Mesh, body_mesh

UNIT = 0.01  # cm; positions of corners are stored as multiples of this
ROOT_LENGTH = 20.0  # cm, of the bone on the ground
SAME_PLACE = 0.1  # cm; joints that are closer together count as being at the same place


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
        below = _bones_below(skeleton, j)
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


def _bones_below(skeleton: Skeleton, joint: int) -> list[Array]:
    """Vectors (3,) from `joint` to its nearest descendants at another place, in the rest pose, cm."""
    out: list[Array] = []
    for child in skeleton.children(joint):
        offset = np.asarray(skeleton.offsets[child], float)
        far = np.linalg.norm(offset) > SAME_PLACE
        out += [offset] if far else [offset + rest for rest in _bones_below(skeleton, child)]
    return out


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
    branching = {skeleton.role(role) for role in ("hips", "chest") if role in skeleton.roles}
    links_of_bones: list[list[int]] = [[] for _ in bones]
    known = ((index, ends) for index, ends in enumerate(link_ends(skeleton.joints, links)) if ends)
    for index, (upper, lower) in known:
        way = path_to_root(skeleton.parents, upper)
        bone = next((joint for joint in way if joint in bones), way[-1])
        if bone in branching:
            bone = next((j for j in bones if lower in skeleton.path_up(j)), bone)
        if bone in bones:
            links_of_bones[bones.index(bone)].append(index)
    return links_of_bones


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
