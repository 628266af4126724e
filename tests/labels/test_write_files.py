"""Automatic labels written as files and read again: the same steps, gaits and phase."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.labels.label import label_clip
from hobble.labels.label_files import SourceTime, footsteps_text, write_label_files
from hobble.labels.options import LabelOptions

NAMES = ("w_footsteps.txt", "w_gait.txt", "w.phase")


@pytest.mark.parametrize(("fps", "start"), [(60.0, 0), (120.0, 0), (30.0, 0), (120.0, 8), (100.0, 3)])
def test_written_label_files_read_back_unchanged(walker, tmp_path, fps, start):
    clip = walker(frames=700, start=150, limp=0.4)
    frames = round(len(clip) * fps / 60) + start
    motion = {"source_frames": frames, "source_fps": fps, "source_start": start}
    before, _ = label_clip(clip, [], motion, None, "rocky", LabelOptions())
    files = [tmp_path / name for name in NAMES]
    write_label_files(*files, before, SourceTime(frames, fps, start))
    after, report = label_clip(clip, files, motion, None, "rocky", LabelOptions())
    assert (report.phase_source, report.gait_source) == ("file", "file")
    assert len(after.cycles) == len(before.cycles) > 5
    assert np.abs(after.cycles - before.cycles).max() <= np.ceil(60 / fps)
    assert (after.gait.argmax(axis=1) == before.gait.argmax(axis=1)).mean() > 0.98
    known = before.phase_known & after.phase_known
    assert known.sum() > 0.95 * before.phase_known.sum()
    apart = np.abs((after.phase - before.phase + 0.5) % 1 - 0.5)[known]
    assert apart.max() < 0.04


def test_a_bout_that_ends_with_the_right_foot_is_not_joined_to_the_next(walker):
    clip = walker(frames=700, start=150)
    time = SourceTime(700, 60.0)
    labels, _ = label_clip(
        clip, [], {"source_frames": 700, "source_fps": 60.0, "source_start": 0}, None, "rocky", LabelOptions()
    )
    nan = np.nan
    rows = np.array([[10, 40, 0], [70, nan, 0], [nan, nan, 1], [300, 330, 0], [360, nan, 0]], float)
    text = footsteps_text(replace(labels, footsteps=rows), time)
    assert text.splitlines() == ["11 41 *", "301 331", "361"]
