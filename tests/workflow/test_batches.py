"""Which clips share a job, and that a job makes only what is missing, changed or damaged."""

import json
import logging
import os
import shutil
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.workflow.datasets import LEAST_BATCHES, MOST_CLIPS_OF_A_BATCH, batch_count, batch_of
from hobble.workflow.job import Inputs, make_each


class Named(dict):
    """Files or params as a script gets them."""

    def __iter__(self):
        files = [[file] if isinstance(file, str) else file for file in self.values()]
        return iter([file for some in files for file in some])

    def __getattr__(self, name: str) -> Any:
        return self[name]


class Job:
    """A job that copies each clip's source and its notes into two files."""

    def __init__(self, folder: Path, clips: str) -> None:
        self.folder, self.clips, self.made = folder, clips, []
        self.times = 1
        self.root = folder / "results/datasets/d"
        self.batch = self.root / "batches/motion/0"
        for clip in clips:
            (folder / f"{clip}.txt").write_text(f"{clip}\n")

    def run(self) -> int:
        """Run it as Snakemake does, without its output at first. Returns its status."""
        if self.batch.exists():
            shutil.rmtree(self.batch)
        self.made.clear()
        notes = {clip: sorted(map(str, self.folder.glob(f"{clip}_*.note"))) for clip in self.clips}
        files = {clip: {"source": str(self.folder / f"{clip}.txt"), "notes": notes[clip]} for clip in notes}
        clips = [{"clip": clip, "files": files[clip]} for clip in self.clips]
        job = SimpleNamespace(
            rule="motion_clips",
            log=[str(self.folder / "job.log")],
            input=Named(files=[f for c in clips for f in (c["files"]["source"], *c["files"]["notes"])]),
            output=Named(batch=str(self.batch)),
            params=Named(clips=clips, times=self.times),
        )
        try:
            make_each(job, self.make, writes={"npz": "motion/{clip}.npz", "json": "motion/{clip}.json"})
        except SystemExit as end:
            return int(str(end.code))
        return 0

    def make(self, piece: Any, log: logging.Logger) -> None:
        self.made.append(piece.name)
        text = "".join(Path(file).read_text() for file in [piece.input["source"], *piece.input["notes"]])
        if "torn" in text:
            raise InputError(piece.input["source"], "is torn")
        if "bug" in text:
            raise KeyError("left knee")
        write_text(piece.output["npz"], text * piece.params["times"])
        write_text(piece.output["json"], json.dumps(piece.name))


@pytest.fixture
def job(tmp_path: Path) -> Job:
    made = Job(tmp_path, "abc")
    assert made.run() == 0
    assert made.made == list("abc")
    return made


def whole(job: Job, clips: str = "abc") -> None:
    for clip in clips:
        found = job.batch / "motion"
        assert (found / f"{clip}.npz").read_text().startswith(f"{clip}\n")
        assert json.loads((found / f"{clip}.json").read_text()) == clip


def test_batches_are_of_similar_size_and_split_in_two_as_a_data_set_grows() -> None:
    most = LEAST_BATCHES * MOST_CLIPS_OF_A_BATCH
    assert [batch_count(n) for n in (1, LEAST_BATCHES, LEAST_BATCHES + 1, most)] == [1, 12, 12, 12]
    names = [f"clip-{n}" for n in range(2500)]
    assert all(batch_of(name, 24) % 12 == batch_of(name, 12) for name in names)
    assert max(Counter(batch_of(name, 96) for name in names).values()) < 2 * 2500 / 96


def test_an_input_is_found_wherever_snakemake_has_put_it(tmp_path: Path) -> None:
    stored, batch = tmp_path / "store/results/x.bvh", tmp_path / "store/batches/motion/0"
    for path in (batch / "motion/a.npz", stored):
        path.parent.mkdir(parents=True)
        path.write_text("")
    find = Inputs([str(batch), str(stored), "mine/a.bvh"])
    assert find("motion/a.npz") == str(batch / "motion/a.npz")
    assert find("results/x.bvh") == str(stored)
    assert find("mine/a.bvh") == "mine/a.bvh"
    with pytest.raises(InputError, match=r"motion/b\.npz: is missing in the folder of its batch"):
        find.each("motion/{clip}.npz", ["a", "b"])


def test_only_a_changed_clip_is_made_again(job: Job) -> None:
    for change, made in (
        (lambda: (job.folder / "b.txt").write_text("b\nmore\n"), "b"),
        (lambda: (job.folder / "b_gait.note").write_text("more"), "b"),
        (lambda: (job.folder / "b_gait.note").rename(job.folder / "b_phase.note"), "b"),
        (lambda: None, ""),
        (lambda: setattr(job, "times", 3), "abc"),
    ):
        change()
        assert job.run() == 0
        whole(job)
        assert job.made == list(made)


@pytest.mark.parametrize("word", ["torn", "bug"])
def test_one_bad_clip_does_not_stop_the_others(job: Job, word: str, capfd) -> None:
    for clip in "ab":
        (job.folder / f"{clip}.txt").write_text(f"{clip}\n{word if clip == 'a' else 'other'}\n")
    assert job.run() == 1
    assert job.made == ["a", "b"]
    (said,) = [line for line in capfd.readouterr().err.splitlines() if line]
    assert said.startswith("motion_clips: ")
    assert ("a.txt: is torn." in said) is (word == "torn")
    assert not list((job.root / "motion").glob("a.*")), "no older file is left"
    (job.folder / "a.txt").write_text("a\nmended\n")
    assert job.run() == 0
    assert job.made == ["a"]
    whole(job)


def test_what_is_damaged_is_made_again(job: Job) -> None:
    """The damage is in both names of the file, and its time and size stay the same."""
    path = job.root / "motion/a.npz"
    times = path.stat()
    with path.open("r+b") as file:
        file.write(b"X")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    (record,) = (job.root / ".made").rglob("b.npz.json")
    record.write_text(record.read_text()[:20])
    assert job.run() == 0
    assert job.made == ["a", "b"]
    whole(job)
