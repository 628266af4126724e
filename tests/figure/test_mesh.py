"""The body is closed, smooth and of an adult's size. Only its bones move it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from hobble.core.files import load_npz
from hobble.core.skeleton import NEEDED_ROLES, Skeleton, rest_positions
from hobble.figure.mesh import FIGURE, Mesh, body_mesh, mesh_key, modelled_pose
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
