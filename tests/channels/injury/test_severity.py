"""Severities of a clip: ranges, rates, mirrors, and Ferre's own matrices."""

from pathlib import Path

import numpy as np
import pytest

from hobble.channels.channel import load_values, save_values
from hobble.channels.injury.status import (
    InjurySpell,
    Status,
    clip_severity,
    read_status,
    severity_matrix,
    source_rows,
)
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton

THIGH, ARM = "LeftUpLeg-LeftLeg", "LeftArm-LeftForeArm"


@pytest.fixture
def clip(holden31: Skeleton) -> Clip:
    rotations = np.zeros((300, 31, 4))
    rotations[..., 0] = 1
    return Clip("walk", holden31, 60.0, rotations, np.zeros((300, 3)))


def motion(frames: int = 600, fps: float = 120.0, start: int = 0) -> dict:
    return {"source": "walk.bvh", "source_frames": frames, "source_fps": fps, "source_start": start}


def test_a_later_line_counts_and_odd_ranges_are_reported_with_their_lines():
    ranges = ((0, 12, 2), (5, 9, 3), (11, 14, 4))
    spells = [InjurySpell(a, b, ((THIGH, 3.0 * line), (ARM, 1.0))[: line - 1], line) for a, b, line in ranges]
    out, said = severity_matrix(Status(10, tuple(spells)), (THIGH, ARM))
    assert out[:, 0].tolist() == [6, 6, 6, 6, 9, 9, 9, 9, 9, 6]
    assert out[:, 1].tolist() == [0] * 4 + [1] * 5 + [0]
    for sentence, line, word in zip(said, (2, 2, 4), ("past the last", "at 0", "was ignored"), strict=True):
        assert sentence.startswith(f"line {line}: ")
        assert word in sentence


@pytest.mark.parametrize(
    ("fps", "start", "expected"),
    [(120.0, 0, [0, 2, 4, 6]), (120.0048, 3, [3, 5, 7, 9]), (30.0, 0, [0, 0, 1, 1]), (24.0, 0, [0, 0, 0, 1])],
)
def test_each_frame_maps_to_the_source_frame_of_the_same_time(fps, start, expected):
    assert source_rows(4, 100, motion(100, fps, start)).tolist() == expected


def test_one_frame_more_or_less_is_a_warning_and_two_are_refused(clip, tmp_path):
    path = tmp_path / "walk_injuries.txt"
    for frames in (599, 601):
        path.write_text(f"frames:{frames}\n1-{frames} {THIGH}[8];\n")
        severity, (warning,) = clip_severity(clip, path, None, motion())
        assert (severity.max(axis=1) == 8).all()
        assert f"walk_injuries.txt, line 1: counts {frames} frames, but walk.bvh has 600" in warning
    path.write_text(f"frames:602\n1-602 {THIGH}[8];\n")
    with pytest.raises(InputError, match=r"line 1: counts 602 frames, but walk.bvh has 600"):
        clip_severity(clip, path, None, motion())


def test_a_status_in_the_data_set_holds_in_all_frames_and_survives_its_file(clip, tmp_path):
    severity, _ = clip_severity(clip, None, f"{THIGH}[4];{ARM}[8.5]", motion())
    for link, value in ((THIGH, 4), (ARM, 8.5)):
        assert (severity[:, clip.skeleton.link_names.index(link)] == value).all()
    assert (severity > 0).sum() == 600
    save_values(tmp_path / "a", severity, clip.skeleton.link_names)
    read, links = load_values(tmp_path / "a")
    assert (read == severity).all()
    assert links == clip.skeleton.link_names


@pytest.mark.shared
@pytest.mark.parametrize("name", ["Run_LLL", "Walk_LLL", "Walk_RUL"])
def test_severities_equal_the_published_matrices_of_ferre(shared: Path, holden31, name):
    stem = shared / "mocap/ferre" / f"Injured_{name}_extended_converted_injuries"
    status = read_status(stem.with_suffix(".txt"), holden31.link_names)
    severity, warnings = severity_matrix(status, holden31.link_names)
    assert (severity == np.loadtxt(stem)).all()
    assert len(warnings) == 1
