"""Files that differ from what their jobs wrote, and files that change while a job reads them."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from hobble.core.errors import InputError
from hobble.core.files import write_json
from hobble.workflow import checksums
from hobble.workflow.job import job


@pytest.fixture
def made(tmp_path: Path) -> Path:
    path = tmp_path / "results/datasets/tiny/motion/walk.json"
    write_json(path, {"source_fps": 120.0})
    checksums.record([str(path)])
    return path


def test_checksums_are_in_the_results_folder_of_their_files() -> None:
    where = {
        "results/test/evaluation/injury.csv": "results/test/checksums/evaluation/injury.csv.crc32",
        "results/datasets/tiny/motion/a.json": "results/datasets/tiny/checksums/motion/a.json.crc32",
        "/data/datasets/results/test/report.html": "/data/datasets/results/test/checksums/report.html.crc32",
    }
    for path, record in where.items():
        assert checksums.checksum_path(Path(path)) == Path(record)
    for other in ("data/mine/walk.bvh", "config/test.yaml", "results/test/network/weights.npz", "results/x"):
        assert checksums.checksum_path(Path(other)) is None


def test_every_flipped_bit_is_detected(made: Path) -> None:
    whole = made.read_bytes()
    checksums.verify([str(made)])
    for at in range(len(whole)):
        for bit in range(8):
            flipped = bytearray(whole)
            flipped[at] ^= 1 << bit
            made.write_bytes(flipped)
            with pytest.raises(InputError, match=r"walk\.json: damaged or changed.*makes it again"):
                checksums.verify([str(made)])


def test_damaged_checksums_are_detected_and_missing_ones_accepted(made: Path) -> None:
    record = checksums.checksum_path(made)
    record.write_bytes(b"\xff\0")
    with pytest.raises(InputError, match="damaged"):
        checksums.verify([str(made)])
    record.unlink()
    checksums.verify([str(made), "no/such/results/test/file.json"])


def test_checksums_of_a_folder_cover_the_files_directly_in_it(tmp_path: Path) -> None:
    folder = tmp_path / "results/datasets/tiny/database/injury"
    write_json(folder / "manifest.json", {"rows": 3})
    checksums.record([str(folder)])
    (folder / ".snakemake_timestamp").touch()
    (folder / "rows").mkdir()
    checksums.verify([str(folder)])
    write_json(folder / "manifest.json", {"rows": 4})
    with pytest.raises(InputError, match=r"manifest\.json"):
        checksums.verify([str(folder)])


def run(made: Path, work, output: str = "results/datasets/tiny/labels/walk.json") -> None:
    root = made.parents[4]
    spec = {
        "log": [str(root / "job.log")],
        "rule": "stage",
        "input": [str(made)],
        "output": [str(root / output)],
    }
    with job(SimpleNamespace(**spec)):
        work(root / output)


def test_a_job_refuses_a_damaged_input_and_writes_checksums(made: Path, capsys) -> None:
    done: list[Path] = []

    def work(output: Path) -> None:
        write_json(output, {"contacts": 4})
        done.append(output)

    run(made, work)
    assert checksums.checksum_path(done[0]).is_file()
    made.write_text(json.dumps({"source_fps": 121.0}))
    with pytest.raises(SystemExit):
        run(made, work)
    assert len(done) == 1
    assert "walk.json: damaged or changed" in capsys.readouterr().err


@pytest.mark.parametrize("how", ["rewritten", "replaced", "removed"])
def test_an_input_that_changes_during_a_job_fails_it(made: Path, capsys, how: str) -> None:
    def work(output: Path) -> None:
        same = made.read_bytes()
        made.unlink() if how != "rewritten" else None
        made.write_bytes(same) if how != "removed" else None

    with pytest.raises(SystemExit):
        run(made, work)
    assert (
        "walk.json: changed while it was being read. Run the same command again." in capsys.readouterr().err
    )
