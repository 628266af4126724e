"""Status files from a table of clip, link, severity, from and to."""

from pathlib import Path

import pytest

from hobble.channels.injury.status import read_status, write_statuses
from hobble.cli.__main__ import main
from hobble.core.errors import InputError

LINKS = ("LeftUpLeg-LeftLeg", "LowerBack-Spine")
HEADER = "clip,link,severity,from,to\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, frames in (("walk", 500), ("run", 90)):
        (tmp_path / f"{name}.bvh").write_text(f"HIERARCHY\nMOTION\nFrames:\t{frames}\nFrame Time: 0.008333\n")
    return tmp_path


def table(folder: Path, text: str) -> Path:
    """With the line ends of Windows, which spreadsheets write."""
    path = folder / "table.csv"
    path.write_bytes((HEADER + text).replace("\n", "\r\n").encode())
    return path


def test_the_command_writes_a_status_file_beside_each_clip_of_the_table(folder, capsys):
    rows = (
        "walk,LeftUpLeg-LeftLeg,7,,\nwalk, LowerBack-Spine ,3,,\n"
        "walk,LowerBack-Spine,4.5,400,\nrun,LowerBack-Spine,2,5,50\n"
    )
    assert main(["injury", str(table(folder, rows)), str(folder)]) == 0
    paths = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [p.name for p in paths] == ["walk_injuries.txt", "run_injuries.txt"]
    assert paths[0].read_text() == (
        "frames:500\n1-500 LeftUpLeg-LeftLeg[7];LowerBack-Spine[3];\n400-500 LowerBack-Spine[4.5];\n"
    )
    assert read_status(paths[1], LINKS).spells[0].last == 50


@pytest.mark.parametrize(
    ("row", "word"),
    [
        ("walk,LeftUpLeg-LeftFoot,7,,\n", "no such link"),
        ("walk,LowerBack-Spine,12,,\n", "severity 12"),
        ("walk,LowerBack-Spine,3,x,\n", "not a frame number"),
        ("walk,LowerBack-Spine,3,9,4\n", "9-4 does not lie"),
        ("walk,LowerBack-Spine,3,1,501\n", "500 frames of walk"),
        ("hop,LowerBack-Spine,3,,\n", "no such clip: hop"),
        ("walk,LowerBack-Spine,3,1,2,3\n", "5 values"),
    ],
)
def test_a_bad_row_is_refused_with_its_line_and_nothing_is_written(folder, row, word):
    with pytest.raises(InputError, match=word) as caught:
        write_statuses(table(folder, "run,LowerBack-Spine,1,,\n" + row), folder, LINKS)
    assert caught.value.line == 3
    assert not list(folder.glob("*_injuries.txt"))


def test_a_file_that_is_not_csv_is_refused_with_one_message(folder, capsys):
    table(folder, 'walk,"' + "x\n" * 99_999)
    with pytest.raises(InputError, match=r"not CSV: field larger.*Look for a quotation mark"):
        write_statuses(folder / "table.csv", folder, LINKS)
    assert main(["injury", str(folder / "table.csv"), str(folder)]) == 1
    assert len(capsys.readouterr().err) < 300 + len(str(folder))
