"""The summary of a run's costs: times of jobs, sizes of files, and what was left from earlier starts."""

import json
from pathlib import Path
from typing import Any

import pytest

from hobble.core.errors import InputError
from hobble.report.provenance import summarise_pipeline


def benchmark(path: Path, seconds: float, memory: str = "100.0") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"s\th:m:s\tmax_rss\tcpu_time\n{seconds}\t0:00:01\t{memory}\t{seconds / 2}\n")


def stage(name: str, **places: Any) -> dict[str, Any]:
    """The summary of one stage."""
    paths = {key: [str(each) for each in value] for key, value in places.items()}
    return summarise_pipeline("c", {name: paths})["stages"][0]


def test_jobs_and_files_are_added_up_and_missing_ones_listed(tmp_path: Path) -> None:
    folder, motion, one = tmp_path / "benchmarks", tmp_path / "motion", tmp_path / "one.json"
    benchmark(folder / "motion_clips" / "a.tsv", 2.0)
    benchmark(folder / "motion_clips" / "b.tsv", 3.0, memory="300.25")
    benchmark(folder / "motion_mirror.tsv", 0.5, memory="-")
    motion.mkdir()
    (motion / "a.npz").write_bytes(b"x" * 100)
    (motion / ".a.npz.1.part").write_bytes(b"x" * 999)  # half-written
    one.write_bytes(b"12345")
    nowhere = str(tmp_path / "nowhere")
    stages = {
        "motion": {"benchmarks": [str(folder)], "files": [str(motion), str(one)]},
        "training": {"benchmarks": [nowhere], "files": [f"{nowhere}.npz"]},
    }
    found = summarise_pipeline("c", stages)
    made, training = found["stages"]
    assert (made["jobs"], made["seconds"], made["longest"]) == (3, 5.5, 3.0)
    assert (made["max_rss_mb"], made["cpu_seconds"]) == (300.2, 2.75)
    assert (made["files"], made["bytes"]) == (2, 105)
    assert {r["rule"]: r["jobs"] for r in made["rules"]} == {"motion_clips": 2, "motion_mirror": 1}
    assert (found["total_seconds"], found["total_bytes"]) == (5.5, 105)
    assert found["missing"] == [nowhere, f"{nowhere}.npz"]
    assert (training["jobs"], training["max_rss_mb"], training["longest"]) == (0, None, 0)
    one.write_text("text\nof another kind\n")
    with pytest.raises(InputError, match="not a Snakemake benchmark"):
        stage("motion", benchmarks=[one.rename(tmp_path / "one.tsv")])


@pytest.mark.parametrize(("seen", "took"), [(3.3, 733.6), (750.0, 750.0)])
def test_the_time_of_a_resumed_training_covers_all_its_calls(
    tmp_path: Path, seen: float, took: float
) -> None:
    """Snakemake's benchmark has only the last call, which may have had nothing left to train."""
    benchmark(tmp_path / "benchmarks" / "training.tsv", seen)
    benchmark(tmp_path / "benchmarks" / "other.tsv", 10.0)
    (tmp_path / "network").mkdir()
    rows = "1,1,9,12.5,.1,\n2,1,18,733.6,.1,\n"
    (tmp_path / "network" / "history.csv").write_text(f"pass,section,samples,seconds,train,held_out\n{rows}")
    training = stage("training", benchmarks=[tmp_path / "benchmarks"], files=[tmp_path / "network"])
    assert (training["seconds"], training["cpu_seconds"]) == (took + 10, (seen + 10) / 2)
    assert {rule["rule"]: rule["seconds"] for rule in training["rules"]} == {"other": 10, "training": took}


def test_times_of_clips_from_earlier_calls_are_counted(tmp_path: Path) -> None:
    """The last call made one clip of two. Before a clip was added there were fewer batches.

    A time that is longer than that of its clips stays.
    """
    folder, made = tmp_path / "benchmarks/motion", tmp_path / ".made"
    for name, seconds in (("clips/00", 2.0), ("clips/walk", 7.0), ("mirror/00", 6.0), ("other/walk", 1.0)):
        benchmark(folder / f"{name}.tsv", seconds)
    for name, seconds in (("clips/motion/a", 3.0), ("clips/motion/b", 1.5), ("mirror/motion/a", 1.0)):
        (made / name).parent.mkdir(parents=True, exist_ok=True)
        record = {"key": "x", "files": [1], "seconds": seconds}
        (made / f"{name}.npz.json").write_text(json.dumps(record))
    rules = [made / "clips", made / "mirror"]
    motion = stage("motion", benchmarks=[folder], files=[], batches=["00"], made=rules)
    found = {rule["rule"]: rule["seconds"] for rule in motion["rules"]}
    assert found == {"clips": 4.5, "mirror": 6.0, "other": 1.0}
    assert (motion["jobs"], motion["seconds"]) == (3, 11.5)
