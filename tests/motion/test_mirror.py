"""The mirror swaps left and right, as in the original release."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.motion.edit import mirror_clip


def test_every_joint_is_where_its_counterpart_was(walk):
    """Also of a lopsided figure, and of joints that move relative to their parents."""
    offsets = walk.skeleton.offsets.copy()
    offsets[3] *= 1.2
    moving = np.tile(offsets, (len(walk), 1, 1))
    moving[:, 3] += [1.0, 2.0, 3.0]
    clip = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets), translations=moving)
    there = clip.positions[:, clip.skeleton.mirror_joints] * [-1, 1, 1]
    np.testing.assert_allclose(mirror_clip(clip, "m").positions, there, atol=1e-9)


def test_a_rig_whose_sides_hang_differently_is_refused(walk):
    parents = list(walk.skeleton.parents)
    parents[walk.skeleton.index("RThumb")] = walk.skeleton.index("RightForeArm")
    clip = replace(walk, skeleton=replace(walk.skeleton, parents=tuple(parents)))
    with pytest.raises(HobbleError, match="cannot be mirrored"):
        mirror_clip(clip, "m")


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
