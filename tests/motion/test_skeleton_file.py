"""Rig files written by hand: each mistake is refused with the file, and with its line if it has one."""

import re

import numpy as np
import pytest

from hobble.cli.clips import skeleton_draft
from hobble.core.errors import InputError
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.skeleton_file import load_skeleton


def role(name: str, joint: str):
    """An edit of a skeleton file: the role gets another joint."""
    return lambda text: re.sub(rf"^  {name}: \w+$", f"  {name}: {joint}", text, flags=re.MULTILINE)


def without(*roles: str):
    return lambda text: re.sub(rf"^  ({'|'.join(roles)}): \w+\n", "", text, flags=re.MULTILINE)


def sides_swapped(text: str) -> str:
    return re.sub(
        r"^(  (?:left|right)_\w+: \w+_)([LR])$", lambda m: m[1] + "LR"["RL".index(m[2])], text, flags=re.M
    )


def far_root(text: str) -> str:
    own = "  Root: {parent: null, offset: [0, 0, 0]}\n  Hips: {parent: Root, offset: [95,"
    return role("hips", "Root")(text.replace("  Hips: {parent: null, offset: [0,", own))


def replaced(old: str, new: str):
    return lambda text: text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("edit", "line", "problem"),
    [
        (role("head", "Chest"), "head", "head is Chest, which does not hang from Neck, the neck"),
        (sides_swapped, "left_shoulder", "left_shoulder is UpperArm_R, whose name says right"),
        (role("chest", "Chest"), "chest", "chest is Chest, but the arms hang from UpperChest"),
        (far_root, "hips", "hips is Root, but the legs hang from Hips"),
        (role("hips", "Spine"), "spine", "spine and hips are the same joint, Spine"),
        (role("left_knee", "LowerLeg"), "left_knee", "there is no joint 'LowerLeg' (is it 'LowerLeg_"),
        (replaced("left_knee:", "left_kne:"), "left_kne", "there is no role left_kne (is it left_knee?)"),
        (without("left_elbow", "head"), "roles", "these roles are missing: head, left_elbow"),
        (replaced("{parent: null", "{parent: Spine"), None, "Hips: its parent 'Spine' must be listed before"),
        (replaced("[0, 10, 0]", "[0, 10]"), "Spine", "joints Spine offset 2: Field required"),
        (replaced("roles:", "rolls:"), None, "needs a section `roles`"),
    ],
)
def test_a_mistake_in_a_skeleton_file_is_refused_in_its_line(root, tmp_path, edit, line, problem):
    text = edit((root / "config/skeletons/rig22.yaml").read_text())
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        load_skeleton(file)
    assert problem in str(refused.value)
    assert (refused.value.line is None) == (line is None)
    if line is not None:
        own = text.split("\n")[refused.value.line - 1]
        assert re.match(rf"\s*{line}\s*:", own), own


@pytest.mark.shared
@pytest.mark.parametrize(
    "edit", [lambda text: text, without("left_toe", "right_toe"), role("left_shoulder", "LeftShoulder1")]
)
def test_a_joint_of_a_wrong_role_shows_in_the_motion(shared, root, tmp_path, edit):
    """A draft gives the same result as no file; without toes nearly the same."""
    clip, target = shared / "mocap/patients/SubjectA1_Cycle1.bvh", root / "config/skeletons/holden31.yaml"
    text = edit(skeleton_draft(clip))
    (tmp_path / "mine.yaml").write_text(text)
    if "LeftShoulder1\n" in text.partition("joints:")[0]:
        with pytest.raises(
            InputError, match=r"LeftForeArm \(left_elbow\).*a joint between them bends.*mine\.yaml\.$"
        ):
            make_clip(clip, target, tmp_path, "a", "holden31", ClipMotion())
        return
    made, report = make_clip(clip, target, tmp_path, "a", "holden31", ClipMotion())
    plain, _ = make_clip(clip, target, target.parent, "a", "holden31", ClipMotion())
    assert report["rig"] == "mine"
    apart = np.linalg.norm(made.positions - plain.positions, axis=-1).mean()
    assert apart < (1e-9 if "left_toe" in text else 3.0)
