"""The arms of one captured clip with the legs of another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.hurt.combine import combine_clips, joints_of_part
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip
from hobble.labels.options import LabelOptions
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.skeleton_file import find_skeleton, skeleton_folder

Labelled = tuple[Clip, Labels]


@pytest.fixture(scope="module")
def clips(shared: Path) -> tuple[Labelled, Labelled]:
    """A walk with a hurt left shank and a jog with a hurt left forearm, captured by Ferre et al."""
    out = []
    for name in ("Injured_Walk_LLL_extended_converted", "Injured_Jog_LLA"):
        file, skeleton = shared / "mocap/ferre" / f"{name}.bvh", find_skeleton("holden31")
        clip, report = make_clip(file, skeleton, skeleton_folder(), name, "holden31", ClipMotion())
        out.append((clip, label_clip(clip, [], report, None, "rocky", LabelOptions())[0]))
    return out[0], out[1]


def mean_poses(of: Labelled, joints: list[int], role: str) -> Array:
    """(12, J, 3) mean places of joints in the coordinates of the joint `role`, in each twelfth of a cycle."""
    clip, labels = of
    origin = clip.skeleton.role(role)
    turn = quat.inv(clip.global_rotations[:, origin])
    local = quat.rotate(turn[:, None], clip.positions - clip.positions[:, [origin]])[:, joints]
    bins = np.minimum((labels.phase * 12).astype(int), 11)
    known = np.zeros(len(clip), bool)
    for first, last in labels.cycles:
        known[first : last + 1] = True
    return np.stack([local[known & (bins == b)].mean(axis=0) for b in range(12)])


def apart(one: Labelled, other: Labelled, joints: list[int], role: str) -> float:
    """cm between the mean poses of two walks, over phases and joints."""
    one_poses, other_poses = (mean_poses(of, joints, role) for of in (one, other))
    return float(np.linalg.norm(one_poses - other_poses, axis=-1).mean())


@pytest.mark.shared
@pytest.mark.parametrize("part", ["arms", "left arm", "upper body"])
def test_the_result_is_nearer_to_both_clips_than_either_alone(clips, part: str) -> None:
    (walk, walk_labels), (jog, jog_labels) = clips
    both = combine_clips(walk, walk_labels, jog, jog_labels, part, "both"), walk_labels
    skeleton = walk.skeleton
    taken = joints_of_part(skeleton, part)
    kept = [j for j in range(len(skeleton.joints)) if j not in taken]
    np.testing.assert_array_equal(both[0].positions[:, kept], walk.positions[:, kept])

    arms = joints_of_part(skeleton, "left arm")

    def away(of: Labelled) -> float:
        """From the jog in the arm that is taken, plus from the walk in the legs."""
        legs = [skeleton.role(f"{side}_{role}") for side in ("left", "right") for role in ("knee", "heel")]
        return apart(of, clips[1], arms, "chest") + apart(of, clips[0], legs, "hips")

    assert away(both) < 0.5 * min(away(clips[0]), away(clips[1]))
    # No jump where a cycle of the jog begins again: no arm is faster than in the jog, played at the walk's
    # cadence.
    speed, of_jog = (
        np.linalg.norm(np.diff(c.rotations[:, arms], axis=0), axis=-1).max() for c in (both[0], jog)
    )
    assert speed < 1.5 * of_jog


@pytest.mark.shared
def test_a_clip_without_steps_is_refused(clips) -> None:
    (walk, labels), (jog, jog_labels) = clips
    none = Labels(**{**vars(jog_labels), "cycles": np.zeros((0, 2), int)})
    with pytest.raises(HobbleError, match="Injured_Jog_LLA has no gait cycle"):
        combine_clips(walk, labels, jog, none, "arms", "x")
