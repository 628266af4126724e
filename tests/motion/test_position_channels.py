"""Position channels of joints below the hips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np


def test_position_channels_that_repeat_the_offsets_are_dropped_and_reported(walk, bvh, make):
    repeated = replace(walk, translations=np.tile(walk.skeleton.offsets, (len(walk), 1, 1)))
    clip, report = make(bvh(repeated))
    assert clip.translations is None
    assert "only repeat their offsets and were dropped" in report["repairs"][0]
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_that_move_are_kept_and_reported(walk, bvh, make):
    moving = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    moving[:, 3, 1] += np.linspace(0, 5, len(walk))
    clip, report = make(bvh(replace(walk, translations=moving)), proportions="clip")
    assert clip.translations is not None
    np.testing.assert_allclose(clip.translations[:, 3], moving[::2, 3], atol=1e-5)
    assert (
        "30 joints below the root have position channels. Those of LeftLeg change, "
        "those of the others do not." in report["repairs"][0]
    )
    assert "kept" in report["repairs"][1]


def test_joint_movement_that_cannot_be_retargeted_is_dropped_and_reported(walk, bvh, make, scaled):
    moving = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    moving[:, 3, 1] += np.linspace(0, 5, len(walk))
    path = bvh(scaled(replace(walk, translations=moving), 1.1), edit=None)
    clip, report = make(path)
    assert clip.translations is None
    assert "dropped" in report["repairs"][-1]


def test_constant_position_channels_replace_a_wrong_offset(walk, bvh, make):
    repeated = replace(walk, translations=np.tile(walk.skeleton.offsets, (len(walk), 1, 1)))
    clip, report = make(
        bvh(repeated, edit=lambda s: s.replace("0.000000 -4.500000 13.500000", "0 -4.5 0", 1))
    )
    assert "OFFSET of LeftToeBase contradicts its position channels" in report["repairs"][0]
    assert clip.translations is None
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_of_zeros_change_nothing(walk, bvh, make):
    zeros = replace(walk, translations=np.zeros((len(walk), 31, 3)))
    clip, report = make(bvh(zeros))
    assert "zero and were dropped" in report["repairs"][0]
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_zero_positions_on_some_joints_are_added_to_their_offsets_and_reported(walk, bvh, make):
    legs = [j for j, name in enumerate(walk.skeleton.joints) if "Leg" in name or "Foot" in name]
    mixed = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    mixed[:, legs] = 0.0
    path = bvh(replace(walk, translations=mixed))
    for proportions in ("skeleton", "clip"):
        clip, report = make(path, proportions=proportions)
        assert "The position channels of LeftUpLeg, LeftLeg, LeftFoot," in report["repairs"][0]
        assert "were added to the OFFSETs" in report["repairs"][0]
        assert clip.translations is None
        np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_around_0_are_added_to_the_offset(walk, bvh, make):
    added = np.zeros((len(walk), 31, 3))
    arm = walk.skeleton.index("LeftForeArm")
    added[:, arm, 0] = 0.3 + np.sin(np.arange(len(walk)) / 9)
    clip, report = make(bvh(replace(walk, translations=added)), proportions="clip")
    assert (
        "30 joints below the root have position channels. Those of LeftForeArm change, "
        "those of the others do not." in report["repairs"][1]
    )
    np.testing.assert_allclose(clip.translations, (walk.skeleton.offsets + added)[::2], atol=1e-5)
