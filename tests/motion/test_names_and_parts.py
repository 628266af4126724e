"""What names and offsets of joints tell: sides (if they do not, the user has to), fingers."""

import re

import numpy as np
import pytest

from hobble.core.bvh import write_bvh
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.body import pointing_fingers
from tests.motion.other_rigs import PLAIN, nameless, rigged
from tests.motion.scramble import source_of


@pytest.mark.shared
def test_a_rig_whose_names_tell_no_sides_is_refused_until_handedness_is_set(shared, tmp_path, make):
    clip, path = source_of(shared / "mocap/cmu/02_01.bvh", 180), tmp_path / "renamed.bvh"
    write_bvh(
        path, rigged(clip, re.sub("_[lr]\\b", lambda m: {"_l": "Q", "_r": "V"}[m[0]], nameless(PLAIN)))[0]
    )
    write_bvh(tmp_path / "known.bvh", clip)
    with pytest.raises(InputError, match=r"its joint names do not tell left.*Set motion.handedness"):
        make(path)
    right, report = make(path, handedness="right")
    left, known = make(path, handedness="left")[0], make(tmp_path / "known.bvh")[0]
    assert any("motion.handedness: right was used" in note for note in report["notes"])
    for side, other in (("left", "right"), ("right", "left")):
        here, there, mirrored = (
            clip.at_roles()[f"{s}_wrist"] for clip, s in ((right, side), (known, side), (left, other))
        )
        assert np.linalg.norm(here - there[: len(here)], axis=-1).mean() < 2
        assert np.linalg.norm(mirrored * [-1, 1, 1] - here, axis=-1).mean() < 2


@pytest.mark.parametrize(
    ("wrist", "fingers", "chosen"),
    [
        ("Hand", {"Thumb1": 9.0, "Pinky1": 8.0, "Index1": 7.0}, "Index1"),
        ("Bip01 L Hand", {"Bip01 L Finger0": 9.0, "Bip01 L Finger1": 7.0}, "Bip01 L Finger1"),
        ("LeftHand", {"LeftFinger1Metacarpal": 8.0, "LeftFinger2Proximal": 6.0}, "LeftFinger2Proximal"),
        ("Bip01 L Hand", {"Bip01 L Finger0": 7.0}, "Bip01 L Finger0"),
        ("L_Wrist", {"grip": 12.0, "L_Hand": 7.0}, "L_Hand"),
        ("kalo", {"mi": 6.0, "ru": 8.0, "sword": 90.0}, "ru"),
        ("Hand", {"Thumb1": 9.0, "Sword": 90.0}, None),
    ],
)
def test_the_pointing_finger_is_chosen(wrist, fingers, chosen):
    """Of an elbow, a wrist 25 cm from it, and joints that are all children of the wrist."""
    offsets = np.array([[0, 0, 0], [25, 0, 0], *([length, 0, 0] for length in fingers.values())], float)
    skeleton = Skeleton("hand", ("Elbow", wrist, *fingers), (-1, 0, *(1 for _ in fingers)), offsets)
    found = pointing_fingers(skeleton, {"left": 1})
    assert [skeleton.joints[j] for j in found.values()] == ([chosen] if chosen else [])
