"""Real clips on other programs' rigs give the same result as the original clips (`scramble.py` tests
more).
"""

from __future__ import annotations

import pytest

from tests.motion.scramble import outcome

MOST = 1.0  # cm, mean over all joints
FILES = ("02_01", "16_11", "07_04", "105_16", "09_03", "08_03")


@pytest.mark.shared
@pytest.mark.parametrize("seed", range(0, 24))
def test_a_clip_on_a_scrambled_rig_is_recovered(shared, tmp_path, seed):
    one = outcome(shared / f"mocap/cmu/{FILES[seed % len(FILES)]}.bvh", seed, tmp_path, 420)
    assert one.off is not None, one
    assert one.off.mean() < MOST, one


@pytest.mark.shared
@pytest.mark.parametrize("seed", [50, 80, 100, 212])
def test_a_rig_without_a_neck_leans_like_one_with_a_neck(shared, tmp_path, seed):
    """By the line from chest to head alone, these four would be 1.1 to 1.2 cm off, and the arms 2.2."""
    files = sorted((shared / "mocap/cmu").glob("*.bvh"))
    one = outcome(files[seed * 7 % len(files)], seed, tmp_path, 900)
    assert not one.how.neck
    assert one.right, one
    assert "neck" in one.said


DOUBTFUL = {24: "ankles", 50: "neck", 104: "balls of the feet"}


@pytest.mark.shared
@pytest.mark.parametrize("seed", DOUBTFUL)
def test_what_cannot_be_known_from_a_rig_is_noted(shared, tmp_path, seed):
    """Files that are more than 1 cm off because information is missing in them have a note."""
    files = sorted((shared / "mocap/cmu").glob("*.bvh"))
    one = outcome(files[seed * 7 % len(files)], seed, tmp_path, 900)
    assert DOUBTFUL[seed] in one.said, one
