"""Broken frames are found, named and repaired; clips without defects stay the same."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.motion.edit import find_jumps, repair_defects


def with_rest_pose(clip, frames, root=None):
    rotations, place = clip.rotations.copy(), clip.root.copy()
    rotations[frames] = quat.IDENTITY
    if root is not None:
        place[frames] = root
    return replace(clip, rotations=rotations, root=place)


def top_speed(clip):
    return np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max()


def test_a_few_broken_frames_in_the_middle_are_bridged(walk):
    mended, _start, said = repair_defects(with_rest_pose(walk, slice(120, 126), 0.0))
    assert len(mended) == 241
    assert "frames 121 to 126 were bridged by interpolation" in said[0]
    apart = np.linalg.norm(mended.positions - walk.positions, axis=-1)
    assert apart.max() < 5.0
    assert top_speed(mended) < 1.5 * top_speed(walk)


def test_a_jump_at_a_seam_is_smoothed_and_the_path_goes_on(walk):
    first, second = slice(0, 100), slice(60, 160)
    turned = walk.rotations[second].copy()
    arm = walk.skeleton.role("left_shoulder")
    turned[:, arm] = quat.mul(turned[:, arm], quat.from_axis_angle(np.array([0, 0, 1.0]), 0.6))
    root = np.concatenate([walk.root[first], walk.root[second] + [0, 0, 50]])
    seam = replace(walk, rotations=np.concatenate([walk.rotations[first], turned]), root=root)
    mended, _start, said = repair_defects(seam)
    assert "between frames 100 and 101; the motion was smoothed" in said[0]
    assert top_speed(mended) < 1.5 * top_speed(walk)
    assert find_jumps(mended) == []
    assert np.diff(mended.root[:, 2]).min() > 0


def test_a_clip_begins_after_the_frames_that_were_cut_off(walk, bvh, make):
    clip, report = make(bvh(with_rest_pose(walk, slice(0, 3))))
    assert report["source_start"] == 3
    np.testing.assert_allclose(clip.root, walk.root[3::2], atol=1e-6)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("file", "said", "frames"),
    [
        ("pfnn/LocomotionFlat04_000", "Frames 2333 to 2428 cut off", 1166),
        ("cmu/07_12", "Frames 1 to 2 (no pose) cut off", 131),
        ("cmu/03_02", "Frames 1 to 51 cut off", 158),
        ("cmu/16_17", "Frame 475 is off", 259),
    ],
)
def test_known_defects_of_real_files_are_found(shared, make, file, said, frames):
    clip, report = make(shared / f"mocap/{file}.bvh", proportions="clip")
    assert said in " ".join(report["repairs"])
    assert len(clip) == frames
