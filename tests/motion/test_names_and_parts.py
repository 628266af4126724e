"""What names and offsets of joints tell: sides (if they do not, the user has to), fingers, the spine."""

import re
from itertools import pairwise

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.body import pointing_fingers

FLIP = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def original(shared):
    return shared / "mocap/cmu/02_01.bvh"


@pytest.fixture
def known(original, make):
    """The clip of the file as it is."""
    return make(original)[0]


def renamed(path, folder, names):
    """A file of a second and a half with other joint names."""
    text, rows = path.read_text().split("Frame Time:")
    words = text.split()
    for joint in (b for a, b in pairwise(words) if a in ("ROOT", "JOINT")):
        text = re.sub(rf"(ROOT|JOINT) {joint}\b", rf"\1 {names(joint)}", text)
    text = re.sub(r"Frames: +\d+", "Frames: 180", text)
    out = folder / "renamed.bvh"
    out.write_text("Frame Time:".join([text, "\n".join(rows.split("\n")[:181]) + "\n"]))
    return out


def word(joint: str) -> str:
    """A name that tells neither the joint nor the side."""
    seed = sum(ord(letter) * (i + 1) for i, letter in enumerate(joint))
    return "".join("kmnptvz"[seed // 7**k % 7] + "aeiou"[seed // 5**k % 5] for k in range(4))


def wrists(clip, side):
    return clip.positions[:, clip.skeleton.role(f"{side}_wrist")]


@pytest.mark.shared
def test_a_rig_whose_names_tell_no_sides_is_refused_until_handedness_is_set(original, known, tmp_path, make):
    path = renamed(original, tmp_path, word)
    with pytest.raises(InputError, match=r"its joint names do not tell left.*Set motion.handedness"):
        make(path)
    right, report = make(path, handedness="right")
    left, _ = make(path, handedness="left")
    assert any("motion.handedness: right was used" in note for note in report["notes"])
    for side, other in (("left", "right"), ("right", "left")):
        here = wrists(right, side)
        assert np.linalg.norm(here - wrists(known, side)[: len(here)], axis=-1).mean() < 2
        assert np.linalg.norm(wrists(left, other) * FLIP - here, axis=-1).mean() < 2


def hand(wrist: str, *fingers: tuple[str, float]) -> Skeleton:
    """An elbow, a wrist 25 cm from it, and joints that are all children of the wrist."""
    joints = ("Elbow", wrist, *(name for name, _ in fingers))
    offsets = np.array([[0, 0, 0], [25, 0, 0], *([length, 0, 0] for _, length in fingers)], float)
    return Skeleton("hand", joints, (-1, 0, *(1 for _ in fingers)), offsets)


@pytest.mark.parametrize(
    ("wrist", "fingers", "chosen"),
    [
        ("Hand", [("Thumb1", 9.0), ("Pinky1", 8.0), ("Index1", 7.0)], "Index1"),
        ("Bip01 L Hand", [("Bip01 L Finger0", 9.0), ("Bip01 L Finger1", 7.0)], "Bip01 L Finger1"),
        ("LeftHand", [("LeftFinger1Metacarpal", 8.0), ("LeftFinger2Proximal", 6.0)], "LeftFinger2Proximal"),
        ("Bip01 L Hand", [("Bip01 L Finger0", 7.0)], "Bip01 L Finger0"),
        ("L_Wrist", [("grip", 12.0), ("L_Hand", 7.0)], "L_Hand"),
        ("kalo", [("mi", 6.0), ("ru", 8.0), ("sword", 90.0)], "ru"),
        ("Hand", [("Thumb1", 9.0), ("Sword", 90.0)], None),
    ],
)
def test_the_pointing_finger_is_chosen(wrist, fingers, chosen):
    skeleton = hand(wrist, *fingers)
    found = pointing_fingers(skeleton, {"left": 1})
    assert ({"left": chosen} if chosen else {}) == {s: skeleton.joints[j] for s, j in found.items()}
