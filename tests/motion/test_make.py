"""From files to clips: units, skeletons, frame counts."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.motion.skeleton_file import load_skeleton


def test_a_clip_on_the_target_skeleton_is_unchanged_and_always_the_same(walk, bvh, make):
    clip, report = make(path := bvh(walk))
    again, told = make(path)
    assert (again.rotations.tobytes(), told) == (clip.rotations.tobytes(), report)
    assert report["repairs"] == []
    said = {"unit": 1.0, "up": "+Y", "source_fps": 120.0, "source_frames": 241}
    assert {key: report[key] for key in said} == said
    assert (clip.fps, len(clip), report["frames"]) == (60.0, 121, 121)
    assert quat.angle(clip.rotations, walk.rotations[::2]).max() < 1e-6
    np.testing.assert_allclose(clip.root, walk.root[::2], atol=1e-6)
    np.testing.assert_array_equal(clip.skeleton.offsets, walk.skeleton.offsets)


def scaled(clip, factor):
    """The same motion in another unit."""
    skeleton = replace(clip.skeleton, offsets=clip.skeleton.offsets * factor)
    return replace(clip, skeleton=skeleton, root=clip.root * factor)


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0, 1.0), (1 / 2.54, 2.54), (0.01, 100.0), (10.0, 0.1), (1 / 5.6444, 5.6444), (1 / 30.48, 30.48)],
)
def test_the_unit_is_found_from_the_legs(walk, bvh, make, factor, unit):
    clip, report = make(bvh(scaled(walk, factor), decimals=12))
    assert report["unit"] == unit
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=2e-3 if factor < 1 else 1e-4)


def test_the_unit_can_be_set_and_is_in_doubt_for_a_rig_of_no_known_size(walk, bvh, make):
    clip, report = make(bvh(walk), unit=2.0, proportions="clip")
    assert report["unit"] == 2.0
    np.testing.assert_allclose(clip.positions, 2 * walk.positions[::2], atol=1e-3)
    giant, report = make(bvh(scaled(walk, 500.0)))
    assert any("No unit gives this rig a person's size" in doubt for doubt in report["unsure"])
    np.testing.assert_allclose(giant.positions, make(bvh(walk))[0].positions, atol=0.5)


def test_a_leg_of_length_0_is_refused(walk, bvh, make):
    path = bvh(walk, edit=lambda s: re.sub(r"(JOINT RightLeg\s*\{\s*OFFSET).*", r"\1 0 0 0", s))
    with pytest.raises(InputError, match=r"walk.bvh: the bone from RightUpLeg to RightLeg has no length"):
        make(path)


def carried(clip, turn, place):
    """The clip below a joint "Reference" that turns (F, 4) and moves (F, 3) and also carries a camera."""
    own, n = clip.skeleton, len(clip)
    joints, parents = ("Reference", *own.joints, "Camera"), (-1, *(p + 1 for p in own.parents), 0)
    offsets = np.concatenate([np.zeros((1, 3)), own.offsets, [[0, 180, 300]]])
    skeleton = replace(own, joints=joints, parents=parents, offsets=offsets)
    rotations = np.concatenate([turn[:, None], clip.rotations, turn[:, None]], axis=1)
    rotations[:, 1] = quat.mul(quat.inv(turn), clip.rotations[:, 0])
    moved = np.tile(offsets, (n, 1, 1))
    moved[:, 1] = quat.rotate(quat.inv(turn), clip.root - place)
    return replace(clip, skeleton=skeleton, rotations=rotations, root=place, translations=moved)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("rig", ["holden31", "mixamo55"])
def test_a_joint_above_the_hips_is_merged_into_them_and_reported(walker, bvh, make, root, rig, moves):
    clip = walker(load_skeleton(root / f"config/skeletons/{rig}.yaml").skeleton, 121, 60.0)
    time = moves * np.linspace(0, 1, len(clip))
    turn = quat.mul(quat.yaw(2 * time), quat.from_axis_angle(np.array([1.0, 0, 0]), -np.pi / 2 + 0 * time))
    place = np.stack([50 * time, 20 + 0 * time, 90 * time**2], axis=1)
    made, report = make(bvh(carried(clip, turn, place), name="carried"))
    alone, without = make(bvh(clip))
    np.testing.assert_allclose(made.positions, alone.positions, atol=1e-4)
    assert report["notes"] == [
        "The joints above Hips (Reference) were left out; their motion was added to it."
    ]
    assert report["rig"] == without["rig"] == rig
    assert made.translations is None
