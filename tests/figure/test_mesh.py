"""The body is closed, smooth and of an adult's size. Only its bones move it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from hobble.core import quat
from hobble.core.files import load_npz
from hobble.core.skeleton import NEEDED_ROLES, Skeleton, forward_kinematics, rest_positions
from hobble.figure.mesh import FIGURE, Mesh, body_mesh, mesh_key, modelled_pose
from hobble.figure.pack import links_of_bones, whole_weights
from hobble.motion.skeleton_file import load_skeleton


def edges(mesh: Mesh) -> np.ndarray:
    f = mesh.faces
    return np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])


def closed(mesh: Mesh) -> bool:
    """Each edge is in two triangles, once in each direction."""
    walked = {tuple(edge) for edge in edges(mesh).tolist()}
    return len(walked) == 3 * len(mesh.faces) and walked == {(b, a) for a, b in walked}


@pytest.fixture(scope="module")
def mesh(holden31: Skeleton) -> Mesh:
    return body_mesh(holden31)


def test_the_surface_is_closed_smooth_in_one_piece_and_of_a_persons_volume(
    mesh: Mesh, holden31: Skeleton
) -> None:
    """The normals at the ends of an edge are similar, except on hands, soles and in the face."""
    assert closed(mesh)
    assert closed(replace(mesh, faces=mesh.coarse))
    assert len(mesh.coarse) <= 3_000 < len(mesh.faces) <= 12_000
    a, b = edges(mesh).T
    count = len(mesh.corners)
    pieces, _ = connected_components(coo_array((np.ones(len(a)), (a, b)), (count, count)))
    assert pieces == 1
    turn = np.degrees(np.arccos(np.clip((mesh.normals[a] * mesh.normals[b]).sum(axis=1), -1, 1)))
    fine = [holden31.role(f"{s}_{role}") for s in ("left", "right") for role in ("wrist", "heel", "toe")]
    trunk = ~np.isin(mesh.bones[mesh.bones_of_corner[a, 0]], [*fine, holden31.role("head")])
    assert np.median(turn) < 20
    assert np.quantile(turn[trunk], 0.99) < 50
    a, b, c = mesh.corners[mesh.faces].transpose(1, 0, 2)
    assert 45 < (a * np.cross(b, c)).sum() / 6 / 1000 < 75  # litres; positive, so seen from outside
    assert np.ptp(mesh.corners[:, 1]) == pytest.approx(162, abs=3)
    away, _ = cKDTree(mesh.corners).query(mesh.corners * [-1, 1, 1])
    assert away.max() < 0.1, "left and right are mirror images"


@pytest.mark.parametrize("name", ["mixamo55", "rig22", "ava191", "holden31"])
def test_every_rig_gets_a_body_of_its_size(root: Path, name: str) -> None:
    """Also without roles for spine, chest and neck: they are where a person has them."""
    skeleton = load_skeleton(root / f"config/skeletons/{name}.yaml").skeleton
    if name == "holden31":
        skeleton = replace(skeleton, roles={role: skeleton.roles[role] for role in NEEDED_ROLES})
    made, rest = body_mesh(skeleton), rest_positions(skeleton)
    assert closed(made)
    assert len(made.bones) == 19
    low, high = made.corners[:, 1].min(), made.corners[:, 1].max()
    assert 0.5 < rest[skeleton.role("left_toe"), 1] - low < 6
    assert 12 < high - rest[skeleton.role("head"), 1] < 25
    assert mesh_key(skeleton) == mesh_key(replace(skeleton, links=()))
    assert mesh_key(skeleton) != mesh_key(replace(skeleton, offsets=skeleton.offsets * 1.1))


def test_the_figure_in_its_pose_is_the_sculpted_one(mesh: Mesh, holden31: Skeleton) -> None:
    """holden31 is the skeleton around which it was sculpted. In between, it was turned to the rest pose."""
    pose, sculpted = modelled_pose(holden31), load_npz(FIGURE)
    corners = mesh.posed(pose.positions[mesh.bones], pose.rotations[mesh.bones])
    assert np.abs(corners - sculpted["corners"]).max() < 1e-3


def test_each_triangle_has_its_own_place_in_the_texture(mesh: Mesh) -> None:
    assert (mesh.uv.min(), mesh.uv.max()) == pytest.approx((0, 1), abs=0.02)
    a, b, c = mesh.uv.swapaxes(0, 1)
    twice = np.linalg.det(np.stack([b - a, c - a], axis=1))  # twice the area
    assert 0.4 < np.abs(twice).sum() / 2 < 1
    # The middle of a triangle is in no other triangle, but for some at the edges of charts.
    flat = np.abs(twice) > 1e-9
    inverse = np.linalg.inv(np.stack([b - a, c - a], axis=2)[flat])
    away = mesh.uv.mean(axis=1)[::60, None] - a[flat]
    u, v = np.einsum("tij,ptj->ipt", inverse, away)
    assert (((u > 0) & (v > 0) & (u + v < 1)).sum(axis=1) > 1).mean() < 0.01


def test_a_corner_has_at_most_four_bones_whose_shares_sum_to_one(mesh: Mesh) -> None:
    assert mesh.weights.shape == (len(mesh.corners), 4)
    assert mesh.weights.sum(axis=1) == pytest.approx(1)
    steps = whole_weights(mesh.weights)
    assert steps.sum(axis=1).tolist() == [255] * len(steps)
    assert np.abs(steps / 255 - mesh.weights).max() < 0.02


def test_a_rigid_movement_of_all_bones_moves_the_body_rigidly(mesh: Mesh) -> None:
    turn = quat.from_axis_angle(np.array([0.6, 0.0, 0.8]), 1.1)
    away = np.array([5.0, 6, 7])
    moved = mesh.posed(quat.rotate(turn, mesh.positions) + away, np.tile(turn, (len(mesh.bones), 1)))
    assert np.abs(moved - (quat.rotate(turn, mesh.corners) + away)).max() < 1e-9


def test_a_knee_bends_without_moving_the_other_leg(mesh: Mesh, holden31: Skeleton) -> None:
    local = np.tile(quat.IDENTITY, (2, 31, 1))
    local[1, holden31.role("left_knee")] = quat.from_axis_angle(np.array([1.0, 0, 0]), 1.2)
    turns, places = forward_kinematics(holden31, local, np.zeros((2, 3)))
    straight, bent = (mesh.posed(places[k, mesh.bones], turns[k, mesh.bones]) for k in range(2))
    apart = np.linalg.norm(bent - straight, axis=1)
    below = mesh.corners[:, 1] < places[0, holden31.role("left_knee"), 1] - 12
    assert apart[below & (mesh.corners[:, 0] > 2)].min() > 2
    assert apart[mesh.corners[:, 0] < -2].max() < 1e-6


def test_each_link_colours_the_part_of_the_body_that_it_names(mesh: Mesh, holden31: Skeleton) -> None:
    links = holden31.link_names
    parts = zip(mesh.bones, links_of_bones(holden31, links), strict=True)
    lies = {links[i]: holden31.joints[bone] for bone, part in parts for i in part}
    assert set(lies) == set(links)
    assert lies["LeftUpLeg-LeftLeg"] == "LeftUpLeg"
    assert lies["Hips-LowerBack"] == "Spine"
    assert lies["LeftHand-LThumb"] == "LeftHand"
    skeleton = replace(holden31, joints=("Hips", "L-HipJoint", *holden31.joints[2:]))
    assert any(links_of_bones(skeleton, ("Hips-L-HipJoint",)))
