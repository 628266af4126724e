"""The bones of a body in files for other programs."""

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.figure.mesh import Mesh

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
