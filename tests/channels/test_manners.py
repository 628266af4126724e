"""Manners: moods by the names of clips, diagnoses by a table, both also by the entries of clips."""

from pathlib import Path

import numpy as np
import pytest

from hobble.channels import channel
from hobble.channels.channel import ClipSource
from hobble.channels.diagnosis import read_diagnoses
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton

PATTERNS = {"patterns": {"*_sad_*": {"sad": 1.0}, "*_tired_*": {"tired": 0.5, "old": 0.25}, "*_normal_*": {}}}
TABLE = "file,subject,diagnosis\na/One_1.bvh,1,muscle weakness\na/Two_1.bvh,2,healthy\n"


@pytest.mark.parametrize(
    ("name", "clip", "value", "expected", "warns"),
    [
        ("mood", "walk_tired_1", None, [0.5, 0.25, 0, 0, 0], False),
        ("mood", "walk_sad_1", None, [0, 0, 0, 1, 0], False),
        ("mood", "walk_sad_1", {"angry": 0.75}, [0, 0, 0, 0, 0.75], False),
        ("mood", "walk_1", None, [0, 0, 0, 0, 0], True),
        ("diagnosis", "Two_1", None, [0, 0, 0], False),
        ("diagnosis", "Three_1", None, [0, 0, 0], True),
        ("diagnosis", "One_1", "joint problem", [1, 0, 0], False),
    ],
)
def test_a_manner_holds_in_every_frame_of_a_clip(
    holden31: Skeleton, tmp_path: Path, name: str, clip: str, value: object, expected: list, warns: bool
) -> None:
    table = tmp_path / "who.csv"
    table.write_text(TABLE)
    options, files = (PATTERNS, []) if name == "mood" else ({"table": table.name}, [table])
    source = channel(name).make_source({"clip": clip, "value": value, "options": options}, files)
    motion = Clip(clip, holden31, 60.0, np.tile([1.0, 0, 0, 0], (7, 31, 1)), np.zeros((7, 3)))
    values, warnings = channel(name).read_checked(motion, source, {})
    np.testing.assert_array_equal(values, np.tile(np.float32(expected), (7, 1)))
    assert bool(warnings) is warns
    assert channel(name).is_neutral(source) is not any(expected)


@pytest.mark.parametrize(
    ("name", "value"),
    [*(("mood", value) for value in ("sad", {"glad": 1}, {"sad": 2})), ("diagnosis", "flu")],
)
def test_an_unknown_manner_in_a_clip_entry_is_refused(holden31: Skeleton, name: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"walk\.channels\.{name}: the value: "):
        channel(name).check(ClipSource("walk", value=value), holden31)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("file,who\na.bvh,1\n", "line 1: has no column diagnosis"),
        ("file,diagnosis\na.bvh,flu\n", "line 2: a has the unknown diagnosis 'flu'"),
        ("file,diagnosis\na.bvh,healthy\nb/a.bvh,joint problem\n", "line 3: a is joint problem here and"),
    ],
)
def test_a_malformed_table_of_diagnoses_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "who.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_diagnoses(str(path))


@pytest.mark.shared
def test_the_table_of_the_patients_gives_each_clip_a_known_diagnosis(shared: Path) -> None:
    found = read_diagnoses(str(shared / "mocap" / "patients.csv"))
    counts = {said: list(found.values()).count(said) for said in sorted(set(found.values()))}
    assert counts == {"healthy": 10, "joint problem": 2, "muscle weakness": 20, "neurological defect": 16}
