"""A character drives other rigs: AVA's 191 joints, Mixamo's, and those of strangers' files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.caller_targets import Axes
from hobble.runtime.retarget import RigDriver, load_rig, plan_rig
from tests.motion.conftest import make_walk
from tests.runtime.walking import walk

# These joints of ava191 are elsewhere in hand and pelvis than those of holden31 that they follow.
ELSEWHERE = ("Index", "Thumb", "Ass")


def both(rig) -> list[tuple[int, int]]:
    """Joints of ava191, and of holden31, that are at the same places of the body."""
    pairs = rig.maps["holden31"].items()
    mine, theirs = rig.skeleton.index, load_rig("holden31").skeleton.index
    return [(mine(a), theirs(b)) for a, b in pairs if not any(word in a for word in ELSEWHERE)]


def test_191_joints_are_where_the_31_of_a_clip_are(holden31) -> None:
    """Poses whose bones have the skeleton's lengths: the joints that both have are at the same places."""
    clip, rig = make_walk(holden31, 241, 120.0), load_rig("ava191")
    driver = RigDriver(plan_rig(holden31, rig))
    positions, rotations = driver(clip.positions, clip.global_rotations)
    mine, theirs = np.transpose(both(rig))
    assert np.linalg.norm(positions[:, mine] - clip.positions[:, theirs], axis=-1).max() < 0.12
    assert quat.angle(rotations[:, mine], clip.global_rotations[:, theirs]).max() < np.radians(1)


@pytest.mark.parametrize("name", ["mixamo55", "rig22", "ava191"])
@pytest.mark.parametrize("axes", [Axes(), Axes("left", "Z", "m", size=1.5)])
def test_a_driven_rig_keeps_its_bones_and_its_feet(network, name: str, axes: Axes) -> None:
    """In any axes: bones have the rig's lengths, balls of the feet are where the scaled character's are."""
    options = {"axes": axes, "characters": 2}
    unit = axes.scale
    with_rig = ProceduralAnimation(network, rig=name, **options)
    rig, legs = with_rig.skeleton, ("left_toe", "right_toe")
    ratio = with_rig.axes.size / axes.size
    own = ProceduralAnimation(network, axes=replace(axes, size=axes.size * ratio), characters=2)
    velocity = np.array([(0.5, 2.0), (1.0, 1.0)]) * unit * ratio
    for _ in range(60):
        mine, driven = (c.next_pose(velocity, terrain=lambda x, z: 0 * x) for c in (own, with_rig))
    matrix = axes.matrix
    for j, p in enumerate(rig.parents):
        if p >= 0:
            bone = quat.rotate(driven.rotations[:, p], matrix @ rig.offsets[j] * unit)
            np.testing.assert_allclose(
                driven.positions[:, j] - driven.positions[:, p], bone, atol=1e-6 * unit
            )
    np.testing.assert_allclose(driven.root, mine.root, atol=1e-9)
    for role in legs:
        apart = driven.positions[:, rig.role(role)] - mine.positions[:, network.skeleton.role(role)]
        assert np.linalg.norm(apart, axis=-1).max() < 0.5 * unit


@pytest.mark.shared
def test_a_strangers_mixamo_rig_walks(shared: Path, steady) -> None:
    """It stands upright, faces ahead and puts its feet on the ground."""
    character = ProceduralAnimation(steady, rig=shared / "wild" / "rigs/taeil/124_01_ret_MIXAMO_rest.bvh")
    rig, pose = character.skeleton, walk(character, 60, target_velocity=(0, 2.0))[-1]
    at = {role: pose.positions[rig.role(role)] for role in rig.roles}
    up = at["head"] - at["hips"]
    assert up[1] > 0.9 * np.linalg.norm(up)
    left = at["left_hip"] - at["right_hip"]
    assert left[0] > 0.8 * np.linalg.norm(left)
    toes = np.array([at["left_toe"], at["right_toe"]])
    assert -2 < toes[:, 1].min() < 12
    assert (toes - [at["left_heel"], at["right_heel"]])[:, 2].min() > 3  # they point ahead
