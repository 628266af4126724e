"""Skeletons: their files, their sides, and where their joints are."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton, forward_kinematics, local_rotations

NAMES = ("holden31", "ava191", "mixamo55", "rig22")


@pytest.fixture(params=NAMES)
def skeleton(request, root):
    data = yaml.safe_load((root / f"config/skeletons/{request.param}.yaml").read_text())
    return Skeleton.from_dict({"name": request.param, **data})


def random_pose(skeleton, frames=3, seed=0):
    rng = np.random.default_rng(seed)
    rotations = quat.normalize(rng.normal(size=(frames, len(skeleton.joints), 4)))
    return rotations, rng.normal(size=(frames, 3)) * 100


def test_rest_poses_are_people_standing_upright(skeleton):
    rest = np.tile(quat.IDENTITY, (1, len(skeleton.joints), 1))
    at = forward_kinematics(skeleton, rest, np.zeros((1, 3)))[1][0]
    get = lambda role: at[skeleton.role(role)]  # noqa: E731
    assert get("left_hip")[0] > 5 > -5 > get("right_hip")[0]
    assert get("head")[1] > 35
    assert get("left_toe")[2] > get("left_heel")[2] + 8
    assert 75 < get("hips")[1] - get("left_heel")[1] < 100
    np.testing.assert_allclose(get("left_hip")[1], get("right_hip")[1], atol=0.1)


def renamed(skeleton, left, right):
    """The skeleton with joints such as LeftLeg renamed; `left` and `right` are names that contain Leg."""

    def name(joint):
        match = re.fullmatch("(Left|L(?=[HT])|Right|R(?=[HT]))(.*)", joint)
        return (left if match[1][0] == "L" else right).format(match[2]) if match else joint

    return replace(
        skeleton,
        joints=tuple(name(joint) for joint in skeleton.joints),
        roles={role: name(joint) for role, joint in skeleton.roles.items()},
        links=tuple((name(a), name(b)) for a, b in skeleton.links),
    )


@pytest.mark.parametrize(
    ("left", "right"),
    [("L_{}", "R_{}"), ("{}_L", "{}_R"), ("{}.L", "{}.R"), ("{}_l", "{}_r"), ("l{}", "r{}"), ("L{}", "R{}"),
     ("LEFT_{}", "RIGHT_{}"), ("Bip01 L {}", "Bip01 R {}"), ("CC_Base_L_{}", "CC_Base_R_{}")],
)  # fmt: skip
def test_sides_are_recognised_in_common_naming_styles(holden31, left, right):
    other = renamed(holden31, left, right)
    np.testing.assert_array_equal(other.mirror_joints, holden31.mirror_joints)
    np.testing.assert_array_equal(other.mirror_links, holden31.mirror_links)


def test_a_skeleton_whose_sides_do_not_match_is_not_mirrored(holden31):
    for swap in ("mirror_joints", "mirror_links"):
        with pytest.raises(HobbleError, match="1Arm is the left shoulder and 2Arm the right"):
            getattr(renamed(holden31, "1{}", "2{}"), swap)
    links = tuple(link for link in holden31.links if link != ("RightLeg", "RightFoot"))
    with pytest.raises(HobbleError, match="have LeftLeg-LeftFoot but not RightLeg-RightFoot"):
        _ = replace(holden31, links=links).mirror_links


def test_forward_kinematics_equals_products_of_matrices(skeleton):
    rotations, root = random_pose(skeleton)
    world, positions = forward_kinematics(skeleton, rotations, root)
    matrices = np.zeros((len(skeleton.joints), 4, 4))
    for j, p in enumerate(skeleton.parents):
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(rotations[1, j], scalar_first=True).as_matrix()
        local[:3, 3] = skeleton.offsets[j] if p >= 0 else root[1]
        matrices[j] = local if p < 0 else matrices[p] @ local
    np.testing.assert_allclose(positions[1], matrices[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(quat.to_matrix(world[1]), matrices[:, :3, :3], atol=1e-9)
    assert quat.angle(local_rotations(skeleton, world), rotations).max() < 1e-6


def test_joint_translations_replace_the_offsets_of_joints_below_the_root(holden31):
    rotations, root = random_pose(holden31)
    moved = np.tile(holden31.offsets * 2, (3, 1, 1))
    moved[:, 0] = 999.0
    doubled = forward_kinematics(holden31, rotations, root, moved)[1] - root[:, None]
    plain = forward_kinematics(holden31, rotations, root)[1] - root[:, None]
    np.testing.assert_allclose(doubled, 2 * plain, atol=1e-9)
