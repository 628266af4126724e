"""The arms of one captured clip with the legs of another."""

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.hurt.combine import combine_clips, joints_of_part
from hobble.labels.clip_labels import Labels

Labelled = tuple[Clip, Labels]


@pytest.fixture(scope="module")
def clips(made) -> tuple[Labelled, Labelled]:
    """A walk with a hurt left shank and a jog with a hurt left forearm, captured by Ferre et al."""
    walk, jog = (made(f"ferre/Injured_{name}") for name in ("Walk_LLL_extended_converted", "Jog_LLA"))
    return walk[:2], jog[:2]


def mean_poses(of: Labelled, joints: list[int]) -> Array:
    """(12, J, 4) mean rotations of joints, relative to the joint above, in each twelfth of a cycle."""
    clip, labels = of
    known = np.zeros(len(clip), bool)
    for first, last in labels.cycles:
        known[first : last + 1] = True
    bins = np.minimum((labels.phase * 12).astype(int), 11)
    local = clip.rotations[:, joints] * np.sign(clip.rotations[:, joints, :1])
    return np.stack([local[known & (bins == b)].mean(axis=0) for b in range(12)])


@pytest.mark.shared
@pytest.mark.parametrize("part", ["arms", "left arm", "upper body"])
def test_the_result_has_the_legs_of_one_clip_and_the_arm_of_the_other(clips, part: str) -> None:
    (walk, walk_labels), (jog, jog_labels) = clips
    both = combine_clips(walk, walk_labels, jog, jog_labels, part, "both")
    kept = [j for j in range(len(walk.skeleton.joints)) if j not in joints_of_part(walk.skeleton, part)]
    np.testing.assert_array_equal(both.positions[:, kept], walk.positions[:, kept])
    arm = joints_of_part(walk.skeleton, "left arm")
    of_both, of_walk, of_jog = (mean_poses(of, arm) for of in ((both, walk_labels), *clips))
    assert np.abs(of_both - of_jog).mean() < 0.5 * np.abs(of_walk - of_jog).mean()
    # No jump where a cycle of the jog begins again: no arm is faster than in the jog, played at the walk's
    # cadence.
    speed, jog_speed = (np.abs(np.diff(c.rotations[:, arm], axis=0)).max() for c in (both, jog))
    assert speed < 1.5 * jog_speed
