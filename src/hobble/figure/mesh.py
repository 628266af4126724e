"""The body of a skeleton as a mesh: its bind pose, its surface, and the weights that move it.

In the bind pose, arms and legs are spread, so that no parts touch.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from hobble.core import quat
from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.shape import (
    SIDES,
    BindPose,
    Rod,
    Solid,
    body_scale,
    smooth_difference,
    smooth_union,
    solids_of_person,
)

ARMS_DOWN = np.radians(60.0)  # angle of the arms below the horizontal
LEGS_OUT = np.radians(5.0)  # angle between the legs and the vertical
SHORTEST_BONE = 0.5  # cm; a shorter bone is not turned, because it hardly has a direction


def bind_pose(skeleton: Skeleton) -> BindPose:
    """The bind pose of a skeleton. Its rest pose must stand and face +Z (see config/skeletons/README.md).

    Raises KeyError if a required role is missing: hips, head, and on both sides shoulder, hip, knee, heel and
    toe.
    """
    joint_of = _find_bones(skeleton)
    aims = _bone_directions(joint_of)
    count = len(skeleton.joints)
    rotations, positions = np.tile(quat.IDENTITY, (count, 1)), np.zeros((count, 3))
    heels = {joint_of[f"{side}_heel"] for side in SIDES}  # the feet stay as in the rest pose
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            rotations[j] = rotations[p]
            positions[j] = positions[p] + quat.rotate(rotations[p], skeleton.offsets[j])
        if j in heels:
            rotations[j] = quat.IDENTITY
        elif j in aims:
            below, direction = aims[j]
            bone = quat.rotate(rotations[j], _rest_vector(skeleton, j, below))
            if np.linalg.norm(bone) > SHORTEST_BONE:
                rotations[j] = quat.mul(quat.between(bone, direction), rotations[j])
    known = {role: positions[skeleton.role(role)] for role in skeleton.roles if _has_role(skeleton, role)}
    return BindPose(positions, rotations, joint_of, _with_missing_roles(known))


def _has_role(skeleton: Skeleton, role: str) -> bool:
    """Whether the skeleton has a joint for a role."""
    return skeleton.roles.get(role) in skeleton.joints


def _find_bones(skeleton: Skeleton) -> dict[str, int]:
    """`BindPose.joint_of` for a skeleton."""
    found = {role: skeleton.role(role) for role in skeleton.roles if _has_role(skeleton, role)}
    hips = found["hips"]
    found.setdefault("neck", max(skeleton.parents[found["head"]], 0))
    found.setdefault("chest", _common_joint(skeleton, found["left_shoulder"], found["right_shoulder"]))
    found.setdefault("spine", _first_below(skeleton, hips, found["chest"]))
    for side in SIDES:
        found.setdefault(f"{side}_elbow", found[f"{side}_shoulder"])
        found.setdefault(f"{side}_wrist", found[f"{side}_elbow"])
        for role in ("hip", "knee", "heel", "toe"):
            skeleton.role(f"{side}_{role}")  # raises KeyError with the name of the missing role
    return found


def _chain(skeleton: Skeleton, joint: int) -> list[int]:
    """The joint and all its ancestors, nearest first."""
    out = [joint]
    while skeleton.parents[out[-1]] >= 0:
        out.append(skeleton.parents[out[-1]])
    return out


def _common_joint(skeleton: Skeleton, a: int, b: int) -> int:
    """The nearest common ancestor of joints a and b, or one of them if it is above the other."""
    above = set(_chain(skeleton, b))
    return next(j for j in _chain(skeleton, a) if j in above)


def _first_below(skeleton: Skeleton, top: int, joint: int) -> int:
    """The first joint on the way from `top` down to `joint`; `joint` itself if `top` is not above it."""
    way = _chain(skeleton, joint)
    return way[way.index(top) - 1] if top in way[1:] else joint


def _rest_vector(skeleton: Skeleton, joint: int, below: int) -> Array:
    """Vector (3,) in the rest pose from a joint to its descendant `below`, cm; 0 if it is no descendant."""
    way = _chain(skeleton, below)
    steps = way[: way.index(joint)] if joint in way else []
    return skeleton.offsets[steps].sum(axis=0) if steps else np.zeros(3)


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


def _with_missing_roles(known: dict[str, Array]) -> dict[str, Array]:
    """`BindPose.position_of` from the positions of the roles that the skeleton has.

    The positions of the missing roles are estimated. The factors are rough proportions of a person.
    """
    out = dict(known)
    middle = (out["left_shoulder"] + out["right_shoulder"]) / 2
    out.setdefault("neck", middle + 0.35 * (out["head"] - middle))
    out.setdefault("chest", out["hips"] + 0.62 * (out["neck"] - out["hips"]))
    out.setdefault("spine", out["hips"] + 0.45 * (out["chest"] - out["hips"]))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        upper_arm = 0.33 * np.linalg.norm(out["hips"] - out[f"{side}_heel"])  # length, cm
        out.setdefault(f"{side}_elbow", out[f"{side}_shoulder"] + upper_arm * arm)
        out.setdefault(f"{side}_wrist", out[f"{side}_elbow"] + 0.85 * upper_arm * arm)
    return out


# The surface of blended solids as one closed mesh, by the method of surface nets (Gibson, 1998).


LARGEST_DISTANCE = 12.0  # cm; larger distances to the surface are clipped to this
# A solid changes distances only within this many cm of its bounding box. `Solid.blend` must be smaller.
SOLID_REACH = 7.0
# The corners of a cell of the grid, and the cell's edges as pairs of indices of CORNERS.
CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if (CORNERS[a] != CORNERS[b]).sum() == 1]

# A box in which the grid is finer: its lowest and highest corner (3,), and the grid's spacing there, cm.
FineBox = tuple[Array, Array, float]


def surface_distances(solids: Sequence[Solid], points: Array) -> Array:
    """(N,) signed distance of points (N, 3) from the surface of the blended solids, cm.

    It is negative inside and at most LARGEST_DISTANCE.
    """
    out = np.full(len(points), LARGEST_DISTANCE)
    x, y, z = (np.ascontiguousarray(part) for part in points.T)
    for solid in solids:
        low, high = solid.bounds()
        low, high = low - SOLID_REACH, high + SOLID_REACH
        near = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]) & (z > low[2]) & (z < high[2])
        chosen = np.flatnonzero(near)
        if len(chosen):
            found = solid.distance(x[chosen], y[chosen], z[chosen])
            combine = smooth_difference if solid.is_subtracted else smooth_union
            out[chosen] = combine(out[chosen], found, solid.blend)
    return out


def grid_lines(low: float, high: float, spacing: float, bands: Sequence[tuple[float, float, float]]) -> Array:
    """Coordinates of grid lines from `low` to `high` along one axis, usually `spacing` cm apart.

    bands: (from, to, spacing) of each range in which the lines are closer together.
    """
    lines, at = [low], low
    while at < high:
        at += min([spacing, *(_largest_spacing(at, band) for band in bands)])
        lines.append(at)
    return np.array(lines)


def _largest_spacing(at: float, band: tuple[float, float, float]) -> float:
    """The spacing that a band allows at `at`: the band's own, plus a quarter of the distance from it."""
    low, high, spacing = band
    return spacing + 0.25 * max(low - at, at - high, 0.0)


def distance_grid(solids: Sequence[Solid], axes: Sequence[Array]) -> Array:
    """(X, Y, Z) signed distances from the blended solids at the points of a grid, cm.

    axes: coordinates of the grid lines along x, y, z. Far from all solids the distance is LARGEST_DISTANCE.
    """
    out = np.full([len(axis) for axis in axes], LARGEST_DISTANCE, np.float64)
    for solid in solids:
        low, high = solid.bounds()
        reach = max(solid.blend, 2.0) + 1.5
        # The part of the grid near the solid: a slice along each axis.
        parts = tuple(
            slice(
                max(0, int(np.searchsorted(axis, low[i] - reach)) - 1),
                int(np.searchsorted(axis, high[i] + reach)) + 1,
            )
            for i, axis in enumerate(axes)
        )
        grid = np.meshgrid(
            *(axis[part] for axis, part in zip(axes, parts, strict=True)), indexing="ij", sparse=True
        )
        combine = smooth_difference if solid.is_subtracted else smooth_union
        out[parts] = combine(out[parts], solid.distance(*grid), solid.blend)
    return out


def surface_mesh(
    solids: Sequence[Solid], spacing: float, fine: Sequence[FineBox] = ()
) -> tuple[Array, NDArray[np.int64]]:
    """The closed surface: vertices (V, 3), cm, and triangles (T, 3), counter-clockwise seen from outside.

    spacing: cm between points of the grid on which the surface is found. fine: boxes with a finer grid.
    """
    added = [solid for solid in solids if not solid.is_subtracted]
    low = np.min([solid.bounds()[0] for solid in added], axis=0) - 3 * spacing
    high = np.max([solid.bounds()[1] for solid in added], axis=0) + 3 * spacing
    axes = [grid_lines(low[i], high[i], spacing, [(a[i], b[i], s) for a, b, s in fine]) for i in range(3)]
    values = without_touching_sheets(distance_grid(solids, axes))
    vertices, triangles = surface_net(values, axes)
    for _ in range(2):  # move the vertices closer to the surface
        vertices = vertices - vectors_from_surface(solids, vertices, 0.35 * spacing)
    return vertices, triangles


def vectors_from_surface(solids: Sequence[Solid], points: Array, longest: float) -> Array:
    """(N, 3) vectors from the surface to points (N, 3), estimated from the slope of the distance.

    Vectors longer than `longest` cm are shortened to this length.
    """
    slope, distance = distance_slopes(solids, points)
    squared_slope = (slope * slope).sum(axis=1)
    vectors = (distance / np.maximum(squared_slope, 0.25))[:, None] * slope
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(length, 1e-9))


def distance_slopes(solids: Sequence[Solid], points: Array, h: float = 0.06) -> tuple[Array, Array]:
    """Slope (N, 3) of the distance from the surface at points (N, 3), and the distance (N,) itself.

    The slope points away from the surface. Both are estimated from the distances at the corners of a
    tetrahedron around each point. h: how far the corners are from the point along each axis, cm.
    """
    slope, away = np.zeros_like(points), np.zeros(len(points))
    for corner in np.array([[1.0, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]]):
        found = surface_distances(solids, points + h * corner)
        slope += found[:, None] * corner / (4 * h)
        away += found / 4
    return slope, away


def without_touching_sheets(values: Array) -> Array:
    """The distances `values` (X, Y, Z), changed so that two sheets of the surface never touch along an edge.

    Two sheets touch at a square of the grid if two opposite corners are inside the body and the other two are
    outside. There the outside corner that is nearer to the surface is put inside, which joins the two sheets.
    """
    values = values.copy()
    while True:
        inside, touching = values < 0, 0
        for u, v in ((0, 1), (1, 2), (2, 0)):  # the axes of the square's sides
            # For each of the four corners of a square: the values at this corner of all squares.
            views = []
            for du in (0, 1):
                for dv in (0, 1):
                    view = [slice(None)] * 3
                    view[u], view[v] = slice(du, -1 if du == 0 else None), slice(dv, -1 if dv == 0 else None)
                    views.append(tuple(view))
            a, b, c, d = (inside[view] for view in views)
            # first, second: the corners outside, as indices of `views`
            for first, second, sheets_touch in ((1, 2, a & d & ~b & ~c), (0, 3, b & c & ~a & ~d)):
                squares = np.argwhere(sheets_touch)
                touching += len(squares)
                both = [values[view][tuple(squares.T)] for view in (views[first], views[second])]
                for corner, is_nearer in ((first, both[0] <= both[1]), (second, both[0] > both[1])):
                    values[views[corner]][tuple(squares[is_nearer].T)] = -1e-3  # cm, just inside
        if not touching:
            return values


def surface_net(values: Array, axes: Sequence[Array]) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (V, 3) and triangles (T, 3) of the surface where `values` (X, Y, Z) on a grid change sign.

    axes: coordinates of the grid lines along x, y, z. Each cell of the grid that the surface crosses gets one
    vertex of the mesh: the mean of the points in which the surface crosses the edges of the cell. Around each
    edge of the grid that the surface crosses are four such cells. Their vertices form two triangles.
    """
    inside = values < 0
    shape = np.array(values.shape) - 1
    corners_inside = np.zeros(shape, np.int8)
    for corner in CORNERS:
        corners_inside += inside[tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))]
    cells = np.argwhere((corners_inside > 0) & (corners_inside < 8))
    index = np.full(shape, -1, np.int64)
    index[tuple(cells.T)] = np.arange(len(cells))
    total, crossed = np.zeros((len(cells), 3)), np.zeros((len(cells), 1))
    for a, b in EDGES:
        first, second = cells + CORNERS[a], cells + CORNERS[b]
        va, vb = values[tuple(first.T)], values[tuple(second.T)]
        cross = (va < 0) != (vb < 0)
        # Share of the edge, from a to b, at which the value is 0.
        t = np.where(cross, va / np.where(cross, va - vb, 1.0), 0.0)[:, None]
        pa, pb = (np.stack([axes[i][p[:, i]] for i in range(3)], axis=1) for p in (first, second))
        total += np.where(cross[:, None], pa + t * (pb - pa), 0.0)
        crossed += cross[:, None]
    return total / crossed, _triangles(inside, index)


def _triangles(inside: NDArray[np.bool_], index: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (T, 3), two for each edge of the grid that the surface crosses.

    inside: (X, Y, Z) whether each point of the grid is in the body. index: (X - 1, Y - 1, Z - 1) the vertex
    of each cell, -1 for a cell without one.
    """
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        # Both ends of each grid edge along `axis`. Edges on the border of the grid are left out.
        a = inside[tuple(slice(0, -1) if i == axis else slice(1, -1) for i in range(3))]
        b = inside[tuple(slice(1, None) if i == axis else slice(1, -1) for i in range(3))]
        for is_crossed, flip in ((a & ~b, False), (~a & b, True)):
            edges = np.argwhere(is_crossed)
            edges[:, u] += 1
            edges[:, v] += 1
            around = []  # the vertices of the four cells around each edge
            for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                cells = edges.copy()
                cells[:, u] += du
                cells[:, v] += dv
                around.append(index[tuple(cells.T)])
            p, q, r, s = around
            if flip:  # keeps the triangles counter-clockwise seen from outside
                q, s = s, q
            faces += [np.stack([p, q, r], 1), np.stack([p, r, s], 1)]
    return np.concatenate(faces)


# Skin weights: which bones move each corner (vertex) of a body's mesh, and how much.


MOST_BONES = 4  # at most this many bones move a corner


def nearest_joints(solids: Sequence[Solid], points: Array, joint_of: Mapping[str, int]) -> NDArray[np.int64]:
    """(V,) the joint that moves the part of the body nearest to each of the points (V, 3).

    joint_of: role in `Solid.owners` -> index of the joint that moves this part of the body.
    """
    nearest, owner = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    x, y, z = points.T
    for solid in solids:
        if solid.is_subtracted:  # a hole; its surface is moved by the joint of the solid around it
            continue
        low, high = (corner.reshape(3, 1) for corner in solid.bounds())
        # Points more than 4 cm from the box around a solid are nearer to other solids.
        near_box = np.flatnonzero(((low - 4 < points.T) & (high + 4 > points.T)).all(axis=0))
        distance = np.full(len(points), np.inf)
        distance[near_box] = solid.distance(x[near_box], y[near_box], z[near_box])
        nearer = distance < nearest
        joint = np.zeros(len(points), np.int64)
        along = solid.along(points)
        # Each bone moves the points from its `begin` (cm along the solid) to that of the next bone.
        for begin, role in solid.owners:
            joint[along >= begin] = joint_of[role]
        owner[nearer], nearest[nearer] = joint[nearer], distance[nearer]
    return owner


def skin_weights(
    corners: Array, faces: NDArray[np.int64], owner: NDArray[np.int64], reach: float | Array
) -> tuple[NDArray[np.int64], Array]:
    """The joints (V, 4) that move each corner, and their weights (V, 4), largest first. Weights sum to 1.

    corners: (V, 3), faces: (T, 3) of the mesh. owner: (V,) result of `nearest_joints`. At first each corner
    has weight 1 for its owner. Then the weights spread like heat over about `reach` cm (one number, or one
    for each corner). They spread only along the surface, and so never from a thigh to a hand beside it.
    """
    joints = np.unique(owner)
    # (V, number of joints): 1 for the owner of a corner, else 0. The loop below turns them into weights.
    shares = (owner[:, None] == joints).astype(float)
    edges = np.unique(
        np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0
    )
    a, b = edges.T
    length = np.maximum(np.linalg.norm(corners[a] - corners[b], axis=1), 0.05)
    reaches = np.broadcast_to(np.asarray(reach, float), (len(corners),))
    # Conductance of each edge. The more heat flows along the edges, the farther the weights spread.
    flow = (np.minimum(reaches[a], reaches[b]) / length) ** 2 / 6
    count = len(corners)
    graph = coo_array((np.r_[flow, flow], (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr()
    # One implicit step of the heat equation: (1 + sum of the flows of a corner - flows) new = old.
    system = (diags_array(1 + np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    solve = splu(system).solve
    for _ in range(2):  # two steps, because after one the weights still have a kink at a joint
        shares = solve(shares)
    order = np.argsort(-shares, axis=1)[:, :MOST_BONES]
    weights = np.take_along_axis(shares, order, axis=1)
    if weights.shape[1] < MOST_BONES:
        pad = MOST_BONES - weights.shape[1]
        weights, order = np.pad(weights, ((0, 0), (0, pad))), np.pad(order, ((0, 0), (0, pad)))
    # Only the four largest weights of a corner are kept. So a bone that is fourth at one corner and fifth at
    # the next would suddenly lose its weight. All weights are lowered by 0.01, but not below 0, so that this
    # does not happen to weights of at most 0.01.
    weights = np.maximum(weights - 0.01, 0)
    return joints[order], weights / weights.sum(axis=1, keepdims=True)


# The body of a skeleton as a mesh: corners (vertices), triangles and skin weights. Also poses the mesh.


# For a body in the shape of a person, these lengths are multiplied by `body_scale`.
CORNER_SPACING = 3.0  # cm between corners of the mesh on trunk and limbs
ROD_SPACING = 1.9  # the same on the rods of a skeleton without roles
FINE_SPACING = {"hand": 0.85, "face": 1.2, "foot": 1.8}  # cm between corners on these finer parts
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
    spacing = CORNER_SPACING * scale if is_person else ROD_SPACING
    corners, faces = surface_mesh(solids, spacing, fine)
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
