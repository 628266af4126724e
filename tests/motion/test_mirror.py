"""The mirror swaps left and right; mirrored twice, a clip is the same again."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.motion.edit import mirror_clip

FLIP = np.array([-1.0, 1.0, 1.0])


def lopsided(clip):
    offsets = clip.skeleton.offsets.copy()
    offsets[3] *= 1.2
    return replace(clip, skeleton=replace(clip.skeleton, offsets=offsets))


def with_translations(clip):
    moving = np.tile(clip.skeleton.offsets, (len(clip), 1, 1))
    moving[:, 3] += [1.0, 2.0, 3.0]
    return replace(clip, translations=moving)


@pytest.mark.parametrize("change", [lambda clip: clip, lopsided, with_translations])
def test_every_joint_is_where_its_counterpart_was(walk, change):
    clip = change(walk)
    mirrored = mirror_clip(clip, "m")
    there = clip.positions[:, clip.skeleton.mirror_joints] * FLIP
    np.testing.assert_allclose(mirrored.positions, there, atol=1e-9)
    assert mirrored.name == "m"
    assert not np.allclose(mirrored.positions, clip.positions, atol=1)


def test_a_rig_whose_sides_hang_differently_is_refused(walk):
    parents = list(walk.skeleton.parents)
    parents[walk.skeleton.index("RThumb")] = walk.skeleton.index("RightForeArm")
    clip = replace(walk, skeleton=replace(walk.skeleton, parents=tuple(parents)))
    with pytest.raises(HobbleError, match="cannot be mirrored"):
        mirror_clip(clip, "m")


@pytest.mark.shared
def test_mirrored_clips_equal_those_of_the_original_release(shared, make):
    """The release mirrored rotations only, onto bones that differ by up to 1.5 cm from side to side."""
    clip, _ = make(shared / "mocap/pfnn/LocomotionFlat09_000.bvh", proportions="clip")
    theirs, _ = make(shared / "mocap/pfnn/LocomotionFlat09_000_mirror.bvh", proportions="clip")
    ours = mirror_clip(clip, "m")
    apart = np.linalg.norm(ours.positions - theirs.positions, axis=-1)
    assert apart[:, 0].max() < 1e-4
    assert apart.mean() < 1.0
