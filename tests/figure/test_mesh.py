"""The body is closed, smooth and of an adult's size. Only its bones move it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from hobble.core import quat
from hobble.core.files import load_npz
from hobble.core.skeleton import Skeleton, forward_kinematics, rest_positions
from hobble.figure.mesh import FIGURE, Mesh, body_mesh, mesh_key, modelled_pose
from hobble.figure.pack import links_of_bones, part_spheres, whole_weights
from hobble.figure.rig import fitted_rotations


def rig(root: Path, name: str) -> Skeleton:
    data = yaml.safe_load((root / f"config/skeletons/{name}.yaml").read_text())
    return Skeleton.from_dict({"name": name, **{k: v for k, v in data.items() if k != "maps"}})


def edges(mesh: Mesh) -> np.ndarray:
    f = mesh.faces
    return np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])


def closed(mesh: Mesh) -> bool:
    """Each edge is in two triangles, once in each direction."""
    walked = edges(mesh)
    return len(np.unique(walked, axis=0)) == len(walked) and {tuple(e) for e in walked.tolist()} == {
        tuple(e[::-1]) for e in walked.tolist()
    }


@pytest.fixture(scope="module")
def mesh(holden31: Skeleton) -> Mesh:
    return body_mesh(holden31)


def test_the_surface_is_closed_in_one_piece_and_of_a_persons_volume(mesh: Mesh) -> None:
    assert closed(mesh)
    a, b = edges(mesh).T
    count = len(mesh.corners)
    pieces, _ = connected_components(coo_array((np.ones(len(a)), (a, b)), (count, count)))
    assert pieces == 1
    a, b, c = mesh.corners[mesh.faces].transpose(1, 0, 2)
    assert 45 < (a * np.cross(b, c)).sum() / 6 / 1000 < 75  # litres; positive, so seen from outside
    assert np.ptp(mesh.corners[:, 1]) == pytest.approx(162, abs=3)


@pytest.mark.parametrize("name", ["mixamo55", "rig22", "ava191"])
def test_every_rig_gets_a_body_of_its_size(root: Path, name: str) -> None:
    skeleton = rig(root, name)
    made, rest = body_mesh(skeleton), rest_positions(skeleton)
    assert closed(made)
    assert len(made.bones) == 19
    low, high = made.corners[:, 1].min(), made.corners[:, 1].max()
    assert 0.5 < rest[skeleton.role("left_toe"), 1] - low < 6
    assert 12 < high - rest[skeleton.role("head"), 1] < 25


def test_the_figure_in_its_pose_is_the_sculpted_one(mesh: Mesh, holden31: Skeleton) -> None:
    """holden31 is the skeleton around which it was sculpted. In between, it was turned to the rest pose."""
    pose, sculpted = modelled_pose(holden31), load_npz(FIGURE)
    corners = mesh.posed(pose.positions[mesh.bones], pose.rotations[mesh.bones])
    assert np.abs(corners - sculpted["corners"]).max() < 1e-3


def test_the_surface_is_small_and_smooth(mesh: Mesh, holden31: Skeleton) -> None:
    """The normals at the ends of an edge are similar, except on hands, soles and in the face."""
    assert len(mesh.faces) <= 12_000
    a, b = edges(mesh).T
    turn = np.degrees(np.arccos(np.clip((mesh.normals[a] * mesh.normals[b]).sum(axis=1), -1, 1)))
    fine = [
        holden31.role(f"{side}_{role}") for side in ("left", "right") for role in ("wrist", "heel", "toe")
    ]
    trunk = ~np.isin(mesh.bones[mesh.bones_of_corner[a, 0]], [*fine, holden31.role("head")])
    assert np.median(turn) < 20
    assert np.quantile(turn[trunk], 0.99) < 50


def test_each_triangle_has_its_own_place_in_the_texture(mesh: Mesh) -> None:
    assert mesh.uv is not None
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


def test_left_and_right_of_the_body_are_mirror_images(mesh: Mesh) -> None:
    away, _ = cKDTree(mesh.corners).query(mesh.corners * [-1, 1, 1])
    assert away.max() < 0.1


def test_a_corner_has_at_most_four_bones_and_their_shares_sum_to_one(mesh: Mesh) -> None:
    assert mesh.bones_of_corner.shape == mesh.weights.shape == (len(mesh.corners), 4)
    assert mesh.weights.sum(axis=1) == pytest.approx(1)
    assert mesh.weights.min() >= 0
    steps = whole_weights(mesh.weights)
    assert steps.sum(axis=1).tolist() == [255] * len(steps)
    assert np.abs(steps / 255 - mesh.weights).max() < 0.02


def test_in_the_rest_pose_the_corners_are_where_they_were_modelled(mesh: Mesh) -> None:
    assert np.abs(mesh.posed(mesh.positions, mesh.rotations) - mesh.corners).max() < 1e-9


def test_a_rigid_movement_of_all_bones_moves_the_body_rigidly(mesh: Mesh) -> None:
    turn = quat.from_axis_angle(np.array([0.6, 0.0, 0.8]), 1.1)
    away = np.array([5.0, 6, 7])
    moved = mesh.posed(quat.rotate(turn, mesh.positions) + away, quat.mul(turn, mesh.rotations))
    assert np.abs(moved - (quat.rotate(turn, mesh.corners) + away)).max() < 1e-9


def test_a_knee_bends_without_moving_the_other_leg(mesh: Mesh, holden31: Skeleton) -> None:
    local = np.tile(quat.IDENTITY, (1, 31, 1))
    local[0, holden31.role("left_knee")] = quat.from_axis_angle(np.array([1.0, 0, 0]), 1.2)
    straight, bent = (
        forward_kinematics(holden31, rotations, np.zeros((1, 3)))
        for rotations in (np.tile(quat.IDENTITY, (1, 31, 1)), local)
    )
    apart = np.linalg.norm(
        mesh.posed(bent[1][0, mesh.bones], bent[0][0, mesh.bones])
        - mesh.posed(straight[1][0, mesh.bones], straight[0][0, mesh.bones]),
        axis=1,
    )
    at = straight[1][0]
    below = mesh.corners[:, 1] < at[holden31.role("left_knee"), 1] - 12
    assert apart[below & (mesh.corners[:, 0] > 2)].min() > 2
    assert apart[mesh.corners[:, 0] < -2].max() < 1e-6


def test_each_link_colours_the_part_of_the_body_that_it_names(mesh: Mesh, holden31: Skeleton) -> None:
    links = holden31.link_names
    lies = {
        links[i]: holden31.joints[bone]
        for bone, part in zip(mesh.bones, links_of_bones(holden31, links), strict=True)
        for i in part
    }
    assert set(lies) == set(links)
    assert lies["LeftUpLeg-LeftLeg"] == "LeftUpLeg"
    assert lies["RightArm-RightForeArm"] == "RightArm"
    assert lies["Hips-LowerBack"] == "Spine"
    assert lies["LeftHand-LThumb"] == "LeftHand"


def test_links_of_joints_with_hyphens() -> None:
    skeleton = Skeleton("x", ("a-b", "c"), (-1, 0), np.array([[0.0, 0, 0], [0, 10, 0]]))
    assert links_of_bones(skeleton, ("a-b-c",)) == [[0]]


def test_a_skeleton_without_roles_gets_a_rod_for_every_bone() -> None:
    offsets = np.array([[0.0, 0, 0], [0, 20, 0], [15, 0, 0]])
    made = body_mesh(Skeleton("x", ("a", "b", "c"), (-1, 0, 1), offsets))
    assert closed(made)
    assert made.corners.max(axis=0) == pytest.approx([16.9, 22.6, 2.6], abs=0.4)


def test_every_bone_has_a_ball_that_stands_for_its_part(mesh: Mesh) -> None:
    found = part_spheres(mesh)
    assert found.shape == (len(mesh.bones), 4)
    assert (found[:, 3] > 1).all()
    assert found[:, 3].max() < 25


def test_skeletons_with_the_same_bones_share_one_body(holden31: Skeleton) -> None:
    assert mesh_key(holden31) == mesh_key(replace(holden31, links=()))
    assert mesh_key(holden31) != mesh_key(replace(holden31, offsets=holden31.offsets * 1.1))


def test_fitted_rotations_reproduce_the_joint_positions(holden31: Skeleton) -> None:
    rng = np.random.default_rng(0)
    local = quat.exp(rng.normal(0, 0.2, (6, 31, 3)))
    _, places = forward_kinematics(holden31, local, rng.normal(size=(6, 3)))
    turns = fitted_rotations(holden31, places)
    for j, p in enumerate(holden31.parents):
        if p >= 0:
            there = places[:, p] + quat.rotate(turns[:, p], holden31.offsets[j])
            assert np.abs(there - places[:, j]).max() < 1e-6, holden31.joints[j]
