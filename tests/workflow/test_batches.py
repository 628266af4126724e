"""Which clips share a job, and that a job makes only what is missing, changed or damaged."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.workflow.batch_job import job_pieces, make_each
from hobble.workflow.clip_batches import (
    LEAST_BATCHES,
    MOST_CLIPS_OF_A_BATCH,
    ClipBatch,
    batch_count,
    batch_of,
    dataset_of,
    family_of,
    rules_of_job,
)


class Named(dict):
    """Files or params as a script gets them."""

    def __iter__(self):
        return iter(
            [file for files in self.values() for file in ([files] if isinstance(files, str) else files)]
        )

    def __getattr__(self, name: str) -> Any:
        return self[name]


class Job:
    """A job that copies each clip's source and its notes into two files."""

    def __init__(self, folder: Path, clips: str) -> None:
        self.folder, self.clips, self.made = folder, clips, []
        self.times = 1
        for clip in clips:
            (folder / f"{clip}.txt").write_text(f"{clip}\n")

    def run(self) -> int:
        """Run it as Snakemake does, without its outputs at first. Returns its status."""
        root = self.folder / "results/datasets/d/motion"
        notes = [sorted(map(str, self.folder.glob(f"{clip}_*.note"))) for clip in self.clips]
        output = {kind: [str(root / f"{clip}.{kind}") for clip in self.clips] for kind in ("npz", "json")}
        self.outputs = [Path(path) for paths in output.values() for path in paths]
        for path in self.outputs:
            path.unlink(missing_ok=True)
        self.made.clear()
        job = SimpleNamespace(
            rule="motion_clips__d__0",
            log=[str(self.folder / "job.log")],
            input=Named(
                source=[str(self.folder / f"{clip}.txt") for clip in self.clips],
                notes=[file for files in notes for file in files],
            ),
            output=Named(output),
            params=Named(
                per_clip=[{"clip": clip} for clip in self.clips],
                files_per_clip={"notes": [len(files) for files in notes]},
                times=self.times,
            ),
        )
        try:
            make_each(job, self.make)
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
        found = job.folder / "results/datasets/d/motion"
        assert (found / f"{clip}.npz").read_text().startswith(f"{clip}\n")
        assert json.loads((found / f"{clip}.json").read_text()) == clip


def test_few_clips_have_one_batch_each_and_thousands_share_about_thirty() -> None:
    assert [
        batch_count(n) for n in (1, LEAST_BATCHES, LEAST_BATCHES + 1, LEAST_BATCHES * MOST_CLIPS_OF_A_BATCH)
    ] == [1, 12, 12, 12]
    for clips in range(LEAST_BATCHES * MOST_CLIPS_OF_A_BATCH + 1, 20_000, 97):
        assert MOST_CLIPS_OF_A_BATCH / 2 <= clips / batch_count(clips) <= MOST_CLIPS_OF_A_BATCH


def test_the_batch_of_a_clip_depends_on_its_name_and_batches_split_in_two() -> None:
    names = [f"clip-{n}" for n in range(2500)]
    for name in names:
        assert batch_of(name, 24) % 12 == batch_of(name, 12)
    sizes = [[batch_of(name, 96) for name in names].count(n) for n in range(96)]
    assert sum(sizes) == 2500
    assert max(sizes) < 2 * 2500 / 96


def test_rule_names_give_their_data_set() -> None:
    batch = ClipBatch("cmu__ava x", 7, "07_hurt", ("a b",), True, hurt=True)
    rule = batch.rule("terrain_fits")
    assert (family_of(rule), dataset_of(rule)) == ("terrain_fits", "cmu__ava x")
    assert (family_of("training"), dataset_of("training")) == ("training", "")
    assert rules_of_job(["snakemake", "--target-jobs", f"{rule}:", "--cores", "all"]) == [rule]
    assert rules_of_job(["snakemake", "results/test/report.html"]) == []


def test_clips_and_mirrors_have_their_paths() -> None:
    batch = ClipBatch("d", 0, "a", ("a", "b_hurt2"), True)
    assert batch.of_names("motion/{clip}.npz") == [
        f"results/datasets/d/motion/{name}.npz" for name in ("a", "b_hurt2", "a_mirror", "b_hurt2_mirror")
    ]
    assert batch.of_originals("labels/{clip}.json")[1] == "results/datasets/d/labels/b.json"
    assert ClipBatch("d", 0, "a", ("a",), False).of_mirrors("motion/{clip}.npz") == []


def test_each_clip_of_a_job_gets_its_files() -> None:
    job = SimpleNamespace(
        input=Named(one=["a", "b"], shared="s", some=["x", "y", "z"], none=[]),
        output=Named(out=["A", "B"], mirror=[]),
        params=Named(
            per_clip=[{"clip": "a", "k": 1}, {"clip": "b", "k": 2}], files_per_clip={"some": [0, 3]}, code="c"
        ),
    )
    first, second = job_pieces(job)
    assert first.input == {"one": "a", "shared": "s", "some": []}
    assert second.input == {"one": "b", "shared": "s", "some": ["x", "y", "z"]}
    assert (second.output, second.params) == ({"out": "B"}, {"clip": "b", "k": 2, "code": "c"})


def test_a_second_run_makes_no_clip_again(job: Job) -> None:
    assert job.run() == 0
    assert job.made == []
    whole(job)


@pytest.mark.parametrize("what", ["source", "notes", "moved notes"])
def test_only_the_changed_clip_is_made_again(job: Job, what: str) -> None:
    if what == "source":
        (job.folder / "b.txt").write_text("b\nmore\n")
    else:
        (job.folder / "b_gait.note").write_text("more")
    if what == "moved notes":
        job.run()
        (job.folder / "b_gait.note").rename(job.folder / "b_phase.note")
    assert job.run() == 0
    assert job.made == ["b"]
    whole(job)
    assert "more" in job.outputs[1].read_text()


def test_changed_params_make_all_clips_again(job: Job) -> None:
    job.times = 2
    assert job.run() == 0
    assert job.made == list("abc")
    assert job.outputs[0].read_text() == "a\na\n"


@pytest.mark.parametrize("word", ["torn", "bug"])
def test_one_bad_clip_does_not_stop_the_others(
    job: Job, word: str, capfd: pytest.CaptureFixture[str]
) -> None:
    for clip in "ab":
        (job.folder / f"{clip}.txt").write_text(f"{clip}\n{word if clip == 'a' else 'other'}\n")
    assert job.run() == 1
    assert job.made == ["a", "b"]
    said = [line for line in capfd.readouterr().err.splitlines() if line]
    assert len(said) == 1
    assert said[0].startswith("motion_clips: ")
    assert ("a.txt: is torn." in said[0]) is (word == "torn")
    (job.folder / "a.txt").write_text("a\nmended\n")
    assert job.run() == 0
    assert job.made == ["a"]
    whole(job)
    assert job.outputs[1].read_text() == "b\nother\n"


def test_a_damaged_kept_file_is_made_again(job: Job) -> None:
    """The damage is in both names of the file, and its time and size stay the same."""
    path = job.outputs[0]
    times = path.stat()
    with path.open("r+b") as file:
        file.write(b"X")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert job.run() == 0
    assert job.made == ["a"]
    whole(job)


def test_with_a_damaged_record_clips_are_made_again(job: Job) -> None:
    for record in (job.folder / "results/datasets/d/.made").rglob(".*.kept"):
        record.write_text(record.read_text()[:20])
    assert job.run() == 0
    assert job.made == list("abc")


def test_a_kept_file_takes_no_space(job: Job) -> None:
    assert all(path.stat().st_nlink == 2 for path in job.outputs)


def test_without_hard_links_it_is_copied(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", refused)
    job.times = 3
    assert job.run() == 0
    assert all(path.stat().st_nlink == 1 for path in job.outputs)
    assert job.run() == 0
    assert job.made == []
    whole(job)


def test_a_full_disk_ends_the_job_with_one_message(
    job: Job, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def full(piece: Any, log: logging.Logger) -> None:
        try:
            raise OSError(28, "No space left on device")
        except OSError as error:
            raise InputError(piece.output["npz"], "the disk is full") from error

    monkeypatch.setattr(job, "make", full)
    job.times = 2
    assert job.run() == 1
    assert capfd.readouterr().err.count("the disk is full") == 1


def test_the_log_says_what_was_kept(job: Job) -> None:
    (job.folder / "c.txt").write_text("c\nnew\n")
    job.run()
    assert "3 pieces, 2 of them kept from before, 0 failed" in (job.folder / "job.log").read_text()
