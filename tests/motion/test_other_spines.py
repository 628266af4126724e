"""Rigs whose spine or neck has other joints than the target, or joints that move in their parents."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from tests.motion.other_rigs import human, rigged
from tests.motion.scramble import compare

X = np.array([1.0, 0.0, 0.0])
LIMBS = ("{S}{n}", "UpLeg Leg Foot ToeBase", "Shoulder Arm ForeArm Hand")


def named(trunk: str) -> str:
    """A rig with the target's names for its limbs. trunk: `name=joint` from the hips to the head."""
    name, leg, arm = LIMBS
    return human(name, trunk, leg, arm)


@pytest.fixture
def nodding(walk) -> Clip:
    """The walk, with a spine and a neck that bend to and fro."""
    time, rotations = np.arange(len(walk)) / walk.fps, walk.rotations.copy()
    for joint, most in (("LowerBack", 0.25), ("Spine", 0.2), ("Neck1", -0.3)):
        angle = most * np.sin(3 * np.pi * time)
        turn = quat.from_axis_angle(X, angle)
        rotations[:, walk.skeleton.index(joint)] = quat.mul(rotations[:, walk.skeleton.index(joint)], turn)
    return replace(walk, rotations=rotations)


@pytest.fixture
def both(tmp_path, make):
    """The results for a clip and for the same on another rig, and the names that both rigs have."""

    def run(clip: Clip, rig: str, edit=lambda text: text, **how):
        other, names = rigged(clip, rig, **how)
        write_bvh(tmp_path / "plain.bvh", clip, decimals=6)
        write_bvh(tmp_path / "other.bvh", other, "ZXY", decimals=8)
        (tmp_path / "other.bvh").write_text(edit((tmp_path / "other.bvh").read_text()))
        return make(tmp_path / "plain.bvh")[0], make(tmp_path / "other.bvh")[0], names

    return run


@pytest.mark.parametrize(
    "trunk",
    [
        "Hips=Hips ToSpine=LowerBack Spine=Spine Spine1=Spine1 Neck=Neck1 Head=Head",
        "Hips=Hips LowerBack=LowerBack Spine=Spine Spine1=Spine1 Neck=Neck1 Head=Head",
        "Hips=Hips Spine=LowerBack Spine1=Spine Spine2=Spine1 Neck=Neck1 Head=Head",
    ],
)
@pytest.mark.parametrize("rest", ["own", "a pose"])
def test_a_spine_with_the_targets_names_and_other_joints_follows_part_by_part(both, nodding, trunk, rest):
    """`Neck` of these rigs is the target's `Neck1`. By its name it would be 10 cm off."""
    first, second, names = both(nodding, named(trunk), rest=rest)
    assert compare(first, second, names).max() < 0.3


def test_a_spine_that_moves_in_its_parent_bends(both, nodding):
    """The rig has no joint that turns the first bone of the spine, so that the bone's end moves instead."""
    trunk = "Hips=Hips Back=Spine Chest=Spine1 Neck=Neck1 Head=Head"
    first, second, names = both(nodding, named(trunk), six=True)
    off = dict(zip(names, compare(first, second, names), strict=True))
    assert max(off[joint] for joint in ("Spine", "Spine1", "Neck1", "Head")) < 0.5
    swing = second.positions[:, second.skeleton.index("Spine")] - second.root
    assert np.ptp(swing[:, 2]) > 1.5  # cm


def test_a_frame_of_zeros_does_not_turn_the_spine(both, nodding):
    """Some programs write a first frame in which all angles and positions are 0."""

    def with_zeros(text: str) -> str:
        head, rows = text.split("Frame Time:")
        line, _, table = rows.partition("\n")
        zeros = " ".join("0" for _ in table.splitlines()[0].split())
        frames = len(table.splitlines())
        head = head.replace(f"Frames: {frames}", f"Frames: {frames + 1}")
        return f"{head}Frame Time:{line}\n{zeros}\n{table}"

    trunk = "Hips=Hips Back=Spine Chest=Spine1 Neck=Neck1 Head=Head"
    first, second, names = both(nodding, named(trunk), with_zeros, six=True)
    assert len(second) == pytest.approx(len(first), abs=1)
    assert compare(first, second, names).mean() < 1.0
