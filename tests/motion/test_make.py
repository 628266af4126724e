"""From files to clips: units, rates, skeletons, frame counts, position channels."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.motion.edit import resample, sample_times
from hobble.motion.read import frame_rate


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


def test_the_frame_rate_can_be_set(walk, bvh, make):
    path = bvh(walk, edit=lambda s: s.replace("0.00833333", "0.06666667"))
    assert (make(path)[1]["source_fps"], len(make(path)[0])) == (15.0, 961)
    right, report = make(path, source_fps=120.0)
    assert report["source_fps"] == 120.0
    np.testing.assert_allclose(right.root, walk.root[::2], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        ("0.0083333", 120), ("0.0166667", 60), ("0.0333", 30), ("0.04", 25), ("0.0416667", 24), ("0.02", 50),
        ("0.01", 100), ("0.0111111", 90), ("0.066667", 15), ("8.33333e-3", 120), ("0.005", 200),
    ],
)  # fmt: skip
def test_rounded_frame_times_mean_standard_rates(text, fps):
    assert frame_rate(float(text), text) == pytest.approx(fps, rel=1e-5)


@pytest.mark.parametrize("rate", [24, 50, 90])
def test_resampling_keeps_time_and_rotates_the_shorter_way(walk, rate):
    times, new = sample_times(len(walk), 120, rate), resample(walk, rate)
    assert len(times) == len(new) == int(240 * rate / 120) + 1
    assert np.abs(np.linalg.norm(new.rotations, axis=-1) - 1).max() < 1e-12
    assert np.sum(new.rotations[1:] * new.rotations[:-1], axis=-1).min() > 0
    np.testing.assert_allclose(new.root[-1], walk.root[round(times[-1])], atol=1e-9)


def wrong_toe(text: str) -> str:
    return text.replace("0.000000 -4.500000 13.500000", "0 -4.5 0", 1)


@pytest.mark.parametrize(
    ("zero", "edit", "said"),
    [
        ((), None, ""),
        ((), wrong_toe, "OFFSET of LeftToeBase contradicts its position channels"),
        (("Leg", "Foot"), None, "The position channels of LeftUpLeg, LeftLeg, LeftFoot,"),
    ],
)
def test_constant_position_channels_become_offsets(walk, bvh, make, zero, edit, said):
    channels, names = np.tile(walk.skeleton.offsets, (len(walk), 1, 1)), walk.skeleton.joints
    channels[:, [j for j, name in enumerate(names) if any(part in name for part in zero)]] = 0.0
    clip, report = make(bvh(replace(walk, translations=channels), edit=edit))
    assert clip.translations is None
    assert said in " ".join(report["repairs"])
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


@pytest.mark.parametrize(("joint", "base"), [("LeftLeg", 1.0), ("LeftForeArm", 0.0)])
def test_position_channels_that_move_are_kept(walk, bvh, make, joint, base):
    """Around the offset (base 1), or around 0 and added to it (base 0)."""
    move = np.zeros((len(walk), 31, 3))
    move[:, walk.skeleton.index(joint), 1] = 0.3 + np.sin(np.arange(len(walk)) / 9)
    path = bvh(replace(walk, translations=base * walk.skeleton.offsets + move))
    clip, _ = make(path, proportions="clip")
    np.testing.assert_allclose(clip.translations, (walk.skeleton.offsets + move)[::2], atol=1e-5)
