"""The meaning of hand-made label files. Wrong files are refused with file and line."""

from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.labels.label_files import SourceTime, read_footsteps, read_gait, read_gait_keys, read_phase

AT_120 = SourceTime(240, 120.0)


def four_phases(path: Path, time: SourceTime) -> np.ndarray:
    return read_phase(path, SourceTime(4, 60.0), 4)


def gait_keys(path: Path, time: SourceTime) -> np.ndarray:
    return read_gait_keys(path, time, 120)


@pytest.mark.parametrize(
    ("read", "text", "line", "word"),
    [
        (read_footsteps, "1 20\n20 30\n", 2, "frame 20 does not come after 20"),
        (read_footsteps, "1 20\nx 30\n", 2, "'x' is not a number"),
        (read_footsteps, "1 2 3\n", 1, "a line holds"),
        (read_footsteps, "1 20\n30\n\n\n40 50\n", 2, "only the last line"),
        (read_footsteps, "1 20\n30 242\n", 2, "past the clip's last frame, 240"),
        (gait_keys, "1 stand\n20 moonwalk\n", 2, "no such gait: 'moonwalk'. There are stand, walk, jog, run"),
        (gait_keys, "\n", None, "holds no keys"),
        (four_phases, "0.1\n1.1\n0.2\n0.3\n", 2, "outside 0..1"),
        (four_phases, "0.1\nnan\n0.2\n0.3\n", 2, "not a number"),
        (four_phases, "0.1\n0.1 0.2\n0.2\n0.3\n", 2, "2 values instead of 1"),
        (four_phases, "0.1\n0.2\n", None, "has 2 rows, but the clip's file has 4 frames"),
    ],
)
def test_a_wrong_file_is_refused_with_its_line(write, read, text, line, word):
    path = write("a.txt", text)
    with pytest.raises(InputError, match=word) as caught:
        read(path, AT_120)
    assert (caught.value.path, caught.value.line) == (path, line)


def test_a_clip_cut_at_the_start_uses_the_matching_part_of_its_files(write):
    late = SourceTime(240, 120.0, first=7)
    rows = np.round(np.linspace(0, 0.9, 240), 5)
    phase = write("a.phase", "\n".join(f"{r:.5f}" for r in rows))
    assert read_phase(phase, late, 100).tolist() == rows[7:207:2].tolist()
    shares = np.outer(rows, np.eye(8)[1])
    gait = write("a.gait", "\n".join(" ".join(map(str, row)) for row in shares))
    assert read_gait(gait, late, 100)[:, 1].tolist() == rows[7:207:2].tolist()


@pytest.mark.shared
@pytest.mark.parametrize("clip", ["pfnn/LocomotionFlat04_000", "pfnn/LocomotionFlat09_000"])
def test_gait_keys_of_the_release_give_its_gait_file(shared: Path, clip):
    stem = shared / "mocap" / clip
    frames = len((stem.with_suffix(".gait")).read_text().splitlines())
    time = SourceTime(frames, 120.0)
    keys = read_gait_keys(Path(f"{stem}_gait.txt"), time, frames // 2)
    assert keys == pytest.approx(read_gait(stem.with_suffix(".gait"), time, frames // 2), abs=6e-6)
