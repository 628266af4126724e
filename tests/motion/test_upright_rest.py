"""Real rigs without a skeleton file, and rigs whose zero pose nobody could stand in."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.axes import degrees_between
from tests.motion.other_rigs import PLAIN, both, rigged
from tests.motion.scramble import X, compare, source_of


@pytest.mark.shared
def test_a_clip_too_short_to_show_its_feet_is_refused_or_accepted(shared, tmp_path, make):
    """A third of a second of a walk on a rig whose zero pose is a heap."""
    clip = source_of(shared / "mocap/cmu/07_01.bvh", 40)
    write_bvh(tmp_path / "short.bvh", rigged(clip, PLAIN, rest="heap")[0], decimals=8)
    with pytest.raises(InputError, match=r"short.bvh: The height of the ankles is uncertain.*accept_doubt"):
        make(tmp_path / "short.bvh")
    assert make(tmp_path / "short.bvh", accept_doubt=True)[1]["unsure"]
    write_bvh(tmp_path / "stands.bvh", rigged(clip, PLAIN)[0], decimals=8)
    assert "uncertain" not in " ".join(make(tmp_path / "stands.bvh")[1]["unsure"])


@pytest.fixture(scope="module")
def standing(holden31) -> Clip:
    """Five seconds on both feet."""
    still = np.tile(quat.IDENTITY, (300, len(holden31.joints), 1))
    return Clip("stands", holden31, 60.0, still, np.tile([0.0, 95.5, 0.0], (300, 1)))


def bent(clip: Clip, joints: tuple[str, ...], angles: np.ndarray) -> Clip:
    """The clip with joints bent forward by angles (F,), radians."""
    rotations = clip.rotations.copy()
    for name in joints:
        rotations[:, clip.skeleton.index(name)] = quat.from_axis_angle(X, angles)
    return replace(clip, rotations=rotations)


RIG = PLAIN.replace("spine|hips|Spine", "low|hips|LowerBack\nspine|low|Spine")


@pytest.mark.parametrize("rest", ["own", "one axis", "twisted"])
def test_a_bow_does_not_tilt_the_pelvis(standing, tmp_path, make, rest):
    bow = bent(standing, ("LowerBack", "Spine"), 0.7 * (1 - np.cos(np.arange(300) / 30)) / 2)
    first, second, _, names = both(bow, RIG, tmp_path, make, rest=rest)
    assert compare(first, second, names).mean() < 0.7


def squat(clip: Clip, tiptoe: float) -> Clip:
    """A squat in one place, the trunk bent forward, the heels raised by an angle."""
    depth = 0.9 + 0.1 * np.sin(np.arange(300) / 20)
    out = bent(clip, ("LowerBack", "Spine"), 0.4 + 0 * depth)
    for joint, angle in (("UpLeg", -depth), ("Leg", 2 * depth), ("Foot", tiptoe - depth)):
        out = bent(out, (f"Left{joint}", f"Right{joint}"), angle)
    low = out.positions[:, clip.skeleton.role("left_toe"), 1]
    return replace(out, root=out.root - np.outer(low - 2.0, [0.0, 1.0, 0.0]))


def test_a_squat_on_tiptoe_without_a_standing_zero_pose_is_refused(standing, tmp_path, make):
    both(squat(standing, 0.0), RIG, tmp_path, make, rest="one axis")
    with pytest.raises(InputError, match="The height of the ankles is uncertain"):
        both(squat(standing, 0.5), RIG, tmp_path, make, rest="one axis")


def without_toes(clip: Clip, site: tuple[float, float, float] | None) -> Clip:
    """The clip on a rig without balls of the feet, with end sites of the ankles (cm) or without."""
    rig = clip.skeleton
    keep = [j for j, name in enumerate(rig.joints) if "Toe" not in name]
    parents = (-1, *(keep.index(rig.parents[j]) for j in keep[1:]))
    ends = {} if site is None else {"LeftFoot": site, "RightFoot": site}
    legs = Skeleton("legs", tuple(rig.joints[j] for j in keep), parents, rig.offsets[keep], end_sites=ends)
    return replace(clip, skeleton=legs, rotations=clip.rotations[:, keep])


def test_a_foot_points_ahead_even_if_its_end_site_lies_under_the_ankle(walk, bvh, make):
    made, _ = make(bvh(without_toes(walk, (0.1, -6.0, 0.0))))
    clips = made, walk.part(slice(None, None, 2))
    assert degrees_between(*(c.at_roles()["left_toe"] - c.at_roles()["left_heel"] for c in clips)).max() < 8


@pytest.mark.parametrize("site", [None, (0.0, 0.0, 15.0)])
def test_straight_knees_that_bend_backward_make_no_mirror_image(standing, bvh, make, site):
    """As cameras capture people who mostly stand."""
    raised = np.maximum(np.sin(np.arange(300) / 20), 0.0) ** 8
    clip = bent(standing, ("LeftUpLeg", "RightUpLeg"), 0.08 - 1.3 * raised)
    clip = bent(clip, ("LeftLeg", "RightLeg"), 2.2 * raised - 0.16)
    assert make(bvh(without_toes(clip, site)), accept_doubt=True)[1]["handedness"] == "right"
