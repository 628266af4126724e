"""Clips are repaired, repeated, mirrored and resampled; copies of a motion are found under any name."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.database.write import refuse_split_pairs
from hobble.motion.duplicates import clip_digest, duplicate_pairs
from hobble.motion.edit import loop_clip, mirror_clip, repair_defects, resample
from hobble.motion.root import root_frames


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
    assert np.diff(mended.root[:, 2]).min() > 0


@pytest.mark.shared
@pytest.mark.parametrize(
    ("file", "said", "frames", "start"),
    [
        ("pfnn/LocomotionFlat04_000", "Frames 2333 to 2428 cut off", 1166, 0),
        ("cmu/07_12", "Frames 1 to 2 (no pose) cut off", 131, 2),
        ("cmu/03_02", "Frames 1 to 51 cut off", 158, 51),
        ("cmu/16_17", "Frame 475 is off", 259, 0),
    ],
)
def test_known_defects_of_real_files_are_found(shared, make, file, said, frames, start):
    clip, report = make(shared / f"mocap/{file}.bvh", proportions="clip")
    assert said in " ".join(report["repairs"])
    assert (len(clip), report["source_start"]) == (frames, start)


@pytest.mark.parametrize("last", [60, 61])  # the 61st frame repeats the first
def test_a_looped_cycle_equals_the_longer_walk(walker, holden31, last):
    walk = walker(holden31, 301, 60.0)
    looped = loop_clip(walk.part(slice(last)), 5)
    assert len(looped) == 300
    np.testing.assert_allclose(looped.root[:, 2], walk.root[:300, 2], atol=0.5)
    assert np.linalg.norm(looped.positions - walk.positions[:300], axis=-1).mean() < 1.0


def test_a_cycle_that_turns_goes_on_turning(walker, holden31):
    walk = walker(holden31, 60, 60.0)
    yaw, rotations = np.linspace(0, np.pi / 3, 60), walk.rotations.copy()
    rotations[:, 0] = quat.mul(quat.yaw(yaw), rotations[:, 0])
    way = np.stack([np.sin(yaw), np.zeros(60), np.cos(yaw)], axis=1) * 100 / 60
    curve = replace(walk, rotations=rotations, root=np.cumsum(way, axis=0) + walk.root * [0, 1, 0])
    looped = loop_clip(curve, 6)
    ahead = root_frames(looped, 0).direction
    turned = np.degrees(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2])))
    assert turned[-1] - turned[0] == pytest.approx(360, abs=15)
    once, often = (np.linalg.norm(np.diff(c.positions, axis=0), axis=-1).max(axis=1) for c in (curve, looped))
    assert often[59::60].max() <= 1.5 * once.max()


def test_every_joint_is_where_its_counterpart_was(walk):
    """Also of a lopsided figure, and of joints that move relative to their parents."""
    offsets = walk.skeleton.offsets.copy()
    offsets[3] *= 1.2
    moving = np.tile(offsets, (len(walk), 1, 1))
    moving[:, 3] += [1.0, 2.0, 3.0]
    clip = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets), translations=moving)
    there = clip.positions[:, clip.skeleton.mirror_joints] * [-1, 1, 1]
    np.testing.assert_allclose(mirror_clip(clip, "m").positions, there, atol=1e-9)


@pytest.mark.shared
def test_mirrored_clips_equal_those_of_the_original_release(shared, make):
    """The release mirrored rotations only, onto bones that differ by up to 1.5 cm from side to side."""
    ours, theirs = (
        make(shared / f"mocap/pfnn/LocomotionFlat09_000{end}.bvh", proportions="clip")[0]
        for end in ("", "_mirror")
    )
    apart = np.linalg.norm(mirror_clip(ours, "m").positions - theirs.positions, axis=-1)
    assert apart[:, 0].max() < 1e-4
    assert apart.mean() < 1.0


def test_trimmed_resampled_shifted_turned_and_mirrored_copies_are_found(walker, holden31):
    clip = walker(holden31, 441, 60.0)
    turn, rotations = quat.yaw(1.0), clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    elsewhere = replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root) + np.array([200, 0, 50]))
    copies = [elsewhere, clip.part(slice(1, None)), clip.part(slice(100, None)), resample(clip, 24.0)]
    others = [mirror_clip(clip, "f"), replace(clip, fps=40.0), replace(clip, root=clip.root * [1, 0.9, 1])]
    clips = [
        replace(each, name=name) for name, each in zip("abcdefgh", [clip, *copies, *others], strict=True)
    ]
    pairs = duplicate_pairs([clip_digest(each, each.name) for each in clips])
    same = "the same motion"
    assert {b: what for a, b, what in pairs if a == "a"} == {
        "b": same, "c": same, "d": f"{same} for 5.7 s", "e": same, "f": "mirrors of each other",
    }  # fmt: skip


def test_a_motion_in_both_splits_is_refused_with_both_names():
    pairs = [("a", "b", "the same file"), ("c", "d", "the same motion")]
    splits = {"a": "held_out", "b": "train", "c": "train", "d": "train"}
    with pytest.raises(HobbleError) as caught:
        refuse_split_pairs("data set mine", pairs, splits)
    said = str(caught.value)
    assert "data set mine: a and b are the same file. The first clip of each pair is held out" in said
    assert 'Add the second ones to held_out: ["b"]' in said
    assert "c and d" not in said
    refuse_split_pairs("data set mine", pairs, dict.fromkeys("abcd", "train"))
