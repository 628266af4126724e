"""Clips with the same motion are found under any name, and cannot be in both parts of the split."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.database.write import refuse_split_pairs
from hobble.motion.duplicates import clip_digest, duplicate_pairs
from hobble.motion.edit import mirror_clip, resample


def test_trimmed_resampled_shifted_turned_and_mirrored_copies_are_found(walker, holden31):
    clip = walker(holden31, 441, 60.0)
    turn, rotations = quat.yaw(1.0), clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    elsewhere = replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root) + np.array([200, 0, 50]))
    copies = [elsewhere, clip.part(slice(1, None)), clip.part(slice(100, None)), resample(clip, 24.0)]
    others = [mirror_clip(clip, "f"), replace(clip, fps=40.0), replace(clip, root=clip.root * [1, 0.9, 1])]
    clips = [
        replace(each, name=name) for name, each in zip("abcdefgh", [clip, *copies, *others], strict=True)
    ]
    pairs = duplicate_pairs([clip_digest(each, each.name) for each in clips])
    same = "the same motion"
    assert {b: what for a, b, what in pairs if a == "a"} == {
        "b": same, "c": same, "d": f"{same} for 5.7 s", "e": same, "f": "mirrors of each other",
    }  # fmt: skip


def test_a_motion_in_both_splits_is_refused_with_both_names():
    pairs = [("a", "b", "the same file"), ("c", "d", "the same motion"), ("e", "f", "the same motion")]
    splits = {"a": "held_out", "b": "train", "c": "train", "d": "train", "e": "held_out", "f": "held_out"}
    with pytest.raises(HobbleError) as caught:
        refuse_split_pairs("data set mine", pairs, splits)
    said = str(caught.value)
    assert "data set mine: a and b are the same file. The first clip of each pair is held out" in said
    assert 'Add the second ones to held_out: ["b"]' in said
    assert "c and d" not in said
    refuse_split_pairs("data set mine", pairs, dict.fromkeys("abcdef", "train"))
