"""Moods by the names of clips and by their entries."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.channels import ClipSource, channel
from hobble.channels.clip_values import read_clip_values
from hobble.channels.mood import CHANNEL
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton

PATTERNS = {"patterns": {"*_sad_*": {"sad": 1.0}, "*_tired_*": {"tired": 0.5, "old": 0.25}, "*_normal_*": {}}}


def source(clip: str, value: object = None) -> ClipSource:
    return ClipSource(clip, value=value, options=CHANNEL.options_of(PATTERNS))


@pytest.fixture
def clip(holden31: Skeleton) -> Clip:
    rotations = np.tile([1.0, 0, 0, 0], (7, 31, 1))
    return Clip("walk_tired_1", holden31, 60.0, rotations, np.zeros((7, 3)))


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("walk_tired_1", None, [0.5, 0.25, 0, 0, 0]),
        ("walk_sad_1", None, [0, 0, 0, 1, 0]),
        ("walk_normal_1", None, [0, 0, 0, 0, 0]),
        ("walk_sad_1", {"angry": 0.75}, [0, 0, 0, 0, 0.75]),
    ],
)
def test_a_mood_holds_in_every_frame_of_a_clip(clip: Clip, name: str, value: object, expected: list) -> None:
    values, warnings = read_clip_values("mood", clip, source(name, value), {})
    np.testing.assert_array_equal(values, np.tile(np.float32(expected), (7, 1)))
    assert warnings == []
    assert channel("mood").is_neutral(source(name, value)) is not any(expected)


@pytest.mark.parametrize("value", ["sad", {"glad": 1}, {"sad": 2}, {"sad": "much"}])
def test_an_unknown_mood_in_a_clip_entry_is_refused(holden31: Skeleton, value: object) -> None:
    with pytest.raises(InputError, match=r"walk\.channels\.mood: cannot be .*sad"):
        channel("mood").check(source("walk", value), holden31)
