from __future__ import annotations

import json
from pathlib import Path

import pytest

from hobble.report.provenance import summarise_pipeline

HEADER = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


def benchmark(path: Path, seconds: float, memory: str = "120.5") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{HEADER}{seconds}\t0:00:01\t{memory}\t1\t1\t1\t0\t0\t90.0\t{seconds / 2}\n")
    return path


def test_jobs_times_and_bytes_are_added_up(tmp_path: Path) -> None:
    folder = tmp_path / "benchmarks" / "motion"
    benchmark(folder / "motion_clips" / "a.tsv", 2.0)
    benchmark(folder / "motion_clips" / "b.tsv", 3.0, memory="300.25")
    benchmark(folder / "motion_mirror.tsv", 0.5, memory="-")
    (tmp_path / "motion").mkdir()
    (tmp_path / "motion" / "a.npz").write_bytes(b"x" * 100)
    (tmp_path / "motion" / ".a.npz.1.part").write_bytes(b"x" * 999)
    one = tmp_path / "one.json"
    one.write_bytes(b"12345")
    stages = {"motion": {"benchmarks": [str(folder)], "files": [str(tmp_path / "motion"), str(one)]}}

    found = summarise_pipeline("c", stages)

    (motion,) = found["stages"]
    assert (motion["jobs"], motion["seconds"], motion["longest"]) == (3, 5.5, 3.0)
    assert (motion["max_rss_mb"], motion["cpu_seconds"]) == (300.2, 2.75)
    assert (motion["files"], motion["bytes"]) == (2, 105)
    assert {r["rule"]: r["jobs"] for r in motion["rules"]} == {"motion_clips": 2, "motion_mirror": 1}
    assert (found["total_seconds"], found["total_bytes"], found["missing"]) == (5.5, 105, [])


@pytest.mark.parametrize(("seen", "took"), [(3.3, 733.6), (750.0, 750.0)])
def test_the_time_of_a_resumed_training_covers_all_its_calls(
    tmp_path: Path, seen: float, took: float
) -> None:
    """Snakemake's benchmark has only the last call, which may have had nothing left to train."""
    benchmark(tmp_path / "benchmarks" / "training.tsv", seen)
    benchmark(tmp_path / "other" / "accuracy.tsv", 10.0)
    (tmp_path / "network").mkdir()
    (tmp_path / "network" / "history.csv").write_text(
        "pass,section,samples,seconds,train_mse,held_out_mse\n1,1,9,12.5,.1,\n2,1,18,733.6,.1,\n"
    )
    stages = {
        "training": {"benchmarks": [str(tmp_path / "benchmarks")], "files": [str(tmp_path / "network")]},
        "evaluation": {"benchmarks": [str(tmp_path / "other")], "files": []},
    }
    found = summarise_pipeline("c", stages)
    training, evaluation = found["stages"]
    assert (training["seconds"], training["longest"], training["jobs"]) == (took, took, 1)
    assert training["rules"][0]["seconds"] == took
    assert training["cpu_seconds"] == seen / 2
    assert evaluation["seconds"] == 10.0
    assert found["total_seconds"] == took + 10.0


def test_times_of_clips_from_earlier_calls_are_counted(tmp_path: Path) -> None:
    """The last call made one clip of two. Before a clip was added there were fewer batches."""
    folder, made = tmp_path / "benchmarks/motion", tmp_path / ".made/motion_clips"
    benchmark(folder / "motion_clips/00.tsv", 2.0)
    benchmark(folder / "motion_clips/walk.tsv", 7.0)
    benchmark(folder / "other/walk.tsv", 1.0)
    (made / "motion").mkdir(parents=True)
    for clip, seconds in (("a", 3.0), ("b", 1.5)):
        record = {"key": "x", "files": [1], "seconds": seconds}
        (made / f"motion/{clip}.npz.json").write_text(json.dumps(record))
    places = {"benchmarks": [str(folder)], "files": [], "batches": ["00"], "made": [str(made)]}
    (motion,) = summarise_pipeline("c", {"motion": places})["stages"]
    assert {rule["rule"]: rule["seconds"] for rule in motion["rules"]} == {"motion_clips": 4.5, "other": 1.0}
    assert (motion["jobs"], motion["seconds"]) == (2, 5.5)


def test_missing_files_are_listed(tmp_path: Path) -> None:
    nowhere = str(tmp_path / "nowhere")
    found = summarise_pipeline("c", {"training": {"benchmarks": [nowhere], "files": [f"{nowhere}.npz"]}})
    assert found["missing"] == [nowhere, f"{nowhere}.npz"]
    assert found["stages"][0]["jobs"] == 0
    assert found["stages"][0]["max_rss_mb"] is None
