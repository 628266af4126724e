"""All labels of a clip: files have priority over motion, mirrors, reports, and the original's own numbers."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hobble.core.declared import load_report
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import LabelReport, load_labels, save_labels
from hobble.labels.label import label_clip, write_report
from hobble.labels.label_files import SourceTime, footsteps_text, gait_text

MOTION = {"source_frames": 1200, "source_fps": 120.0, "source_start": 0}
FOOTSTEPS = "141 201\n261 321\n381 441 *\n501 561\n621 681\n741"


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs((a - b + 0.5) % 1.0 - 0.5)


def test_hand_made_files_replace_labels_found_from_motion(walker, options, write):
    clip = walker()
    files = [write("w_footsteps.txt", FOOTSTEPS), write("w_gait.txt", "1 jog\n")]
    labels, report = label_clip(clip, files, MOTION, "walk", "rocky", options)
    assert (report.phase_source, report.gait_source) == ("file", "file")
    # 310 to 370 ends in a line with one number. The original makes no rows of it. 250 to 310 stays.
    assert labels.cycles.tolist() == [[70, 130], [250, 310]]
    assert report.cycles_dropped == 3
    assert labels.phase_known[310:371].all()
    assert (labels.gait[:, 2] == 1).all()
    assert labels.phase[70] == 0
    assert labels.phase[100] == 0.5
    assert not labels.phase_known[190:250].any()

    motion_only = options.model_copy(update={"files": False})
    labels, report = label_clip(clip, files, MOTION, "walk", "rocky", motion_only)
    assert (report.phase_source, report.gait_source) == ("automatic", "automatic")
    assert (labels.gait.argmax(axis=1)[60:] == 1).all()


def test_a_phase_file_overrides_footsteps_and_a_gait_file_overrides_keys(walker, options, write):
    clip = walker()
    phase = np.linspace(0, 20, 1200) % 1.0
    gait = np.zeros((1200, 8))
    gait[:, 5] = 1
    files = [write("w_footsteps.txt", FOOTSTEPS), write("w_gait.txt", "1 jog\n")]
    files.append(write("w.phase", "\n".join(f"{p:.5f}" for p in phase)))
    files.append(write("w.gait", "\n".join(" ".join(map(str, row)) for row in gait)))
    labels, _ = label_clip(clip, files, MOTION, None, "rocky", options)
    assert apart(labels.phase, phase[::2]).max() < 1e-5
    assert labels.cycles.tolist() == [[70, 130], [250, 310]]
    assert (labels.gait[:, 4] == 1).all()
    alone, _ = label_clip(clip, files[2:], MOTION, None, "rocky", options)
    landed = alone.footsteps[:, 0][np.isfinite(alone.footsteps[:, 0])]
    assert np.diff(landed) == pytest.approx(1199 / 20 / 2, abs=0.01)


def test_labels_survive_their_file_and_the_picture_is_drawn(walker, options, tmp_path):
    clip = walker()
    labels, report = label_clip(clip, [], MOTION, "walk", "flat", options)
    for name in "ab":
        save_labels(tmp_path / f"{name}.npz", labels)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    again = load_labels(tmp_path / "a.npz")
    for name in ("contacts", "phase", "phase_known", "gait", "footsteps", "cycles"):
        np.testing.assert_equal(getattr(again, name), getattr(labels, name))
    write_report(tmp_path / "a.json", report, labels, clip)
    assert load_report(tmp_path / "a.json", "labels", LabelReport) == report
    curves = json.loads((tmp_path / "a.json").read_text())["curves"]
    assert len(curves["seconds"]) == len(curves["phase"]) == len(curves["speed"]) == 400
    assert curves["speed"][200] == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize(("fps", "start"), [(60.0, 0), (120.0, 0), (30.0, 0), (120.0, 8), (100.0, 3)])
def test_written_label_files_read_back_unchanged(walker, tmp_path, fps, start):
    clip = walker(frames=700, start=150, limp=0.4)
    frames = round(len(clip) * fps / 60) + start
    motion = {"source_frames": frames, "source_fps": fps, "source_start": start}
    before, _ = label_clip(clip, [], motion, None, "rocky", LabelOptions())
    time, files = SourceTime(frames, fps, start), [tmp_path / "w_footsteps.txt", tmp_path / "w_gait.txt"]
    for file, text in zip(files, (footsteps_text, gait_text), strict=True):
        file.write_text(text(before, time))
    after, report = label_clip(clip, files, motion, None, "rocky", LabelOptions())
    assert (report.phase_source, report.gait_source) == ("file", "file")
    assert len(after.cycles) == len(before.cycles) > 5
    assert np.abs(after.cycles - before.cycles).max() <= np.ceil(60 / fps)
    assert (after.gait.argmax(axis=1) == before.gait.argmax(axis=1)).mean() > 0.98
    known = before.phase_known & after.phase_known
    assert known.sum() > 0.95 * before.phase_known.sum()
    assert apart(after.phase, before.phase)[known].max() < 0.04


def test_a_bout_that_ends_with_the_right_foot_is_not_joined_to_the_next(walker, options):
    labels, _ = label_clip(walker(), [], MOTION, None, "rocky", options)
    nan = np.nan
    rows = np.array([[10, 40, 0], [70, nan, 0], [nan, nan, 1], [300, 330, 0], [360, nan, 0]], float)
    text = footsteps_text(replace(labels, footsteps=rows), SourceTime(700, 60.0))
    assert text.splitlines() == ["11 41 *", "301 331", "361"]
