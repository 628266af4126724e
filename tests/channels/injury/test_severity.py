"""Severities of a clip: ranges, rates, mirrors, and Ferre's own matrices."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.channels import ClipSource
from hobble.channels.clip_values import load_values, save_values, write_report
from hobble.channels.injury import CHANNEL
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
from hobble.core.files import read_json
from hobble.core.skeleton import Skeleton

THIGH, ARM = "LeftUpLeg-LeftLeg", "LeftArm-LeftForeArm"


@pytest.fixture
def clip(holden31: Skeleton) -> Clip:
    rotations = np.zeros((300, 31, 4))
    rotations[..., 0] = 1
    return Clip("walk", holden31, 60.0, rotations, np.zeros((300, 3)))


def motion(frames: int = 600, fps: float = 120.0, start: int = 0) -> dict:
    return {"source": "walk.bvh", "source_frames": frames, "source_fps": fps, "source_start": start}


def column(holden31: Skeleton, link: str) -> int:
    return holden31.link_names.index(link)


def test_a_later_line_replaces_an_earlier_one_in_its_frames_and_links():
    first = InjurySpell(1, 8, ((THIGH, 3.0), (ARM, 2.0)), 2)
    later = InjurySpell(5, 9, ((THIGH, 9.0),), 3)
    out, _ = severity_matrix(Status(10, (first, later)), (THIGH, ARM))
    assert out[:, 0].tolist() == [3, 3, 3, 3, 9, 9, 9, 9, 9, 0]
    assert out[:, 1].tolist() == [2] * 8 + [0, 0]


def test_odd_frame_ranges_are_reported_with_their_lines():
    spells = (
        InjurySpell(0, 12, ((THIGH, 3.0),), 2),
        InjurySpell(5, 6, ((THIGH, 4.0), (ARM, 1.0)), 3),
        InjurySpell(11, 14, ((ARM, 4.0),), 4),
        InjurySpell(1, 10, ((ARM, 1.0),), 5),
    )
    out, said = severity_matrix(Status(10, spells), (THIGH, ARM))
    words = ("past the last", "starts at 0", "overlaps the range of line 2", "was ignored")
    for sentence, line, word in zip(said, (2, 2, 3, 4), words, strict=True):
        assert sentence.startswith(f"line {line}: ")
        assert word in sentence
    assert out.shape == (10, 2)
    assert out[0, 0] == 3
    assert out[-1, 0] == 3


@pytest.mark.parametrize(
    ("fps", "start", "expected"),
    [
        (120.0, 0, [0, 2, 4, 6]),
        (120.0048, 0, [0, 2, 4, 6]),
        (120.0, 3, [3, 5, 7, 9]),
        (60.0, 0, [0, 1, 2, 3]),
        (30.0, 0, [0, 0, 1, 1]),
        (24.0, 0, [0, 0, 0, 1]),
    ],
)
def test_each_frame_maps_to_the_source_frame_of_the_same_time(fps, start, expected):
    assert source_rows(4, 100, motion(100, fps, start)).tolist() == expected


def test_one_frame_more_or_less_is_a_warning_and_two_are_refused(clip, tmp_path):
    path = tmp_path / "walk_injuries.txt"
    for frames in (599, 601):
        path.write_text(f"frames:{frames}\n1-{frames} {THIGH}[8];\n")
        severity, (warning,) = clip_severity(clip, path, None, motion())
        assert (severity[:, column(clip.skeleton, THIGH)] == 8).all()
        assert f"walk_injuries.txt, line 1: counts {frames} frames, but walk.bvh has 600" in warning
    path.write_text(f"frames:602\n1-602 {THIGH}[8];\n")
    with pytest.raises(InputError, match=r"line 1: counts 602 frames, but walk.bvh has 600"):
        clip_severity(clip, path, None, motion())


def test_a_status_in_the_data_set_holds_in_all_frames(clip):
    severity, _ = clip_severity(clip, None, f"{THIGH}[4];{ARM}[8.5]", motion())
    assert (severity[:, column(clip.skeleton, THIGH)] == 4).all()
    assert (severity[:, column(clip.skeleton, ARM)] == 8.5).all()
    assert (severity > 0).sum() == 600


def test_on_a_skeleton_without_links_a_hurt_clip_has_no_columns(clip):
    """A data set on a skeleton without links may list hurt clips. Its networks are not trained on them."""
    figure = replace(clip, skeleton=replace(clip.skeleton, links=()))
    severity, warnings = clip_severity(figure, None, f"{THIGH}[4]", motion())
    assert (severity.shape, warnings) == ((300, 0), [])
    said = ClipSource("walk", {}, f"{THIGH}[4]")
    CHANNEL.check(said, figure.skeleton)
    assert not CHANNEL.is_neutral(said)
    with pytest.raises(InputError, match="no such link"):
        CHANNEL.check(ClipSource("walk", {}, "Thigh[4]"), clip.skeleton)


def test_saved_values_keep_their_columns_and_the_report_lists_the_injuries(clip, tmp_path):
    severity, _ = clip_severity(clip, None, f"{THIGH}[4]", motion())
    severity[:60] = 0
    severity[90:120] = severity[90:120] / 2
    hurt = {"seconds": 4.0, "highest": 4.0, "spells": [[1.0, 1.5, 4.0], [1.5, 2.0, 2.0], [2.0, 5.0, 4.0]]}
    save_values(tmp_path / "a.npz", severity, clip.skeleton.link_names)
    save_values(tmp_path / "b.npz", severity, clip.skeleton.link_names)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    read, links = load_values(tmp_path / "a.npz")
    assert (read == severity).all()
    assert links == clip.skeleton.link_names
    write_report(tmp_path / "a.json", "injury", clip, severity, links, ["odd"])
    report = read_json(tmp_path / "a.json")
    written = {"clip": "walk", "channel": "injury", "title": "Injury", "values": {THIGH: hurt}}
    assert report == {**written, "highest": 10.0, "warnings": ["odd"]}


@pytest.mark.shared
@pytest.mark.parametrize("name", ["Run_LLL", "Walk_LLL", "Walk_RUL"])
def test_severities_equal_the_published_matrices_of_ferre(shared: Path, holden31, name):
    stem = shared / "mocap/ferre" / f"Injured_{name}_extended_converted_injuries"
    status = read_status(stem.with_suffix(".txt"), holden31.link_names)
    severity, warnings = severity_matrix(status, holden31.link_names)
    assert (severity == np.loadtxt(stem)).all()
    assert len(warnings) == 1
