"""Diagnoses by a table of recordings, and by the entries of clips."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hobble.channels import channel
from hobble.channels.clip_values import read_clip_values
from hobble.channels.diagnosis import read_table
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton

TABLE = "file,subject,diagnosis\na/One_1.bvh,1,muscle weakness\na/Two_1.bvh,2,healthy\n"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "who.csv"
    path.write_text(TABLE)
    return path


@pytest.mark.parametrize(
    ("clip", "value", "expected", "warns"),
    [
        ("One_1", None, [0, 1, 0], False),
        ("Two_1", None, [0, 0, 0], False),
        ("Three_1", None, [0, 0, 0], True),
        ("One_1", "joint problem", [1, 0, 0], False),
    ],
)
def test_a_diagnosis_holds_in_every_frame_of_a_clip(
    holden31: Skeleton, table: Path, clip: str, value: str | None, expected: list[float], warns: bool
) -> None:
    fields = {"clip": clip, "value": value, "options": {"table": table.name}}
    source = channel("diagnosis").make_source(fields, [table])
    rotations = np.tile([1.0, 0, 0, 0], (7, 31, 1))
    values, warnings = read_clip_values(
        "diagnosis", Clip(clip, holden31, 60.0, rotations, np.zeros((7, 3))), source, {}
    )
    np.testing.assert_array_equal(values, np.tile(np.float32(expected), (7, 1)))
    assert bool(warnings) is warns
    assert channel("diagnosis").is_neutral(source) is not any(expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("file,who\na.bvh,1\n", r"line 1: has no column diagnosis"),
        ("file,diagnosis\na.bvh,flu\n", r"line 2: a has the unknown diagnosis 'flu'"),
        (
            "file,diagnosis\na.bvh,healthy\nb/a.bvh,joint problem\n",
            r"line 3: a is joint problem here and healthy",
        ),
    ],
)
def test_a_malformed_table_of_diagnoses_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "who.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_table(str(path))


@pytest.mark.shared
def test_the_table_of_the_patients_gives_each_clip_a_known_diagnosis(shared: Path) -> None:
    found = read_table(str(shared / "mocap" / "patients.csv"))
    counts = {said: list(found.values()).count(said) for said in sorted(set(found.values()))}
    assert counts == {"healthy": 10, "joint problem": 2, "muscle weakness": 20, "neurological defect": 16}
