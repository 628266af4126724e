"""Position channels of joints below the hips."""

from dataclasses import replace

import numpy as np
import pytest


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
