"""Requests to a cluster: number of jobs, memory and time of each. How long a training takes is told first."""

import re
from pathlib import Path

import pytest
import yaml

from hobble.workflow.datasets import LEAST_BATCHES, batch_of
from hobble.workflow.demands import (
    WEEK_MINUTES,
    bvh_seconds,
    job_request,
    measure_request,
    sentences_about_plan,
    training_request,
)
from hobble.workflow.project import Project

CLIPS = 40
MANY = "skeleton: holden31\nfolder: many\nmirror: true\nheld_out: [clip-00]\n"


def bvh(path: Path, rows: int, promised: int, frame_time: str = "0.01") -> Path:
    head = f"HIERARCHY\nROOT Hips\nMOTION\nFrames: {promised}\nFrame Time: {frame_time}\n"
    path.write_text(head + "0.00 1.00 2.00\n" * rows)
    return path


@pytest.mark.workflow
def test_a_stage_has_a_job_for_each_batch_of_clips(workflow, tmp_path) -> None:
    (workflow.folder / "config/datasets/many.yaml").write_text(MANY)
    (workflow.folder / "config/many.yaml").write_text("extends: holden\ndataset: many\nchannels: [injury]\n")
    (tmp_path / "many").mkdir()
    for number in range(CLIPS):
        bvh(tmp_path / f"many/clip-{number:02}.bvh", 100, 100, frame_time=f"0.0100{number:02}")
    planned = workflow.planned("--config", f"mocap={tmp_path}", "--", "results/many/report.html")
    stages = ("motion_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips")
    used = len({batch_of(f"clip-{number:02}", LEAST_BATCHES) for number in range(CLIPS)})
    assert {rule: planned.pop(rule) for rule in stages} == dict.fromkeys(stages, used)
    # Whatever is not in a batch is there once for the data set, the configuration or a measurement.
    assert {rule for rule, count in planned.items() if count > 1} == {"measure"}, planned


@pytest.mark.workflow
def test_trainings_do_not_wait_for_each_other_and_request_a_gpu_if_they_use_one(workflow) -> None:
    names = ["holden", "holden-xl", "injured"]
    plan = workflow.run("-np", *(f"results/{name}/network/weights.npz" for name in names))
    trainings = re.findall(r"^rule training:\n    input: (.*)$", plan, re.M)
    assert len(trainings) == len(names)
    assert all("/network/" not in files for files in trainings)
    assert "gpu=1" not in plan
    weights = "results/test/network/weights.npz"
    assert workflow.run("-np", "--config", "training={device: cuda}", "--", weights).count("gpu=1") == 1


@pytest.mark.parametrize("name", ["slurm", "kubernetes", "s3"])
def test_cluster_profiles_have_the_settings_of_the_default_one(root: Path, name: str) -> None:
    ours, default = (
        yaml.safe_load((root / f"profiles/{each}/config.v9+.yaml").read_text()) for each in (name, "default")
    )
    del default["logger"]  # on a cluster Snakemake's full output says which job went where
    defaults = default.pop("default-resources")
    if name == "kubernetes":  # a pod needs disk space for its inputs
        del defaults["disk_mb"]
    assert {key: ours.get(key) for key in default} == default
    assert ours["default-resources"].items() >= defaults.items()
    assert ("disk_mb" in ours["default-resources"]) == ("disk_mb" in defaults)
    assert name == "s3" or ours["retries"] == 2


def test_requests_grow_with_motion_and_attempt(root: Path) -> None:
    project = Project(root, {})
    data, holden, ava = project.dataset("synthetic"), *map(project.configuration, ("holden", "ava"))
    short, long = (job_request("hurt", data, [clip]) for clip in ("jog-2", "jog-1"))
    again = job_request("hurt", data, ["jog-1"], attempt=2)
    assert short < long
    assert again == pytest.approx((2 * long.mem_mb, 2 * long.runtime), abs=1)
    assert job_request("hurt", data, ["jog-1_hurt1"]) == long
    assert job_request("hurt", project.dataset("synthetic-ava"), ["jog-1"]).mem_mb > long.mem_mb
    both = job_request("hurt", data, ["jog-1", "jog-2"])
    assert both == pytest.approx((long.mem_mb, short.runtime + long.runtime), abs=1)
    assert training_request(ava).mem_mb > training_request(holden).mem_mb
    assert training_request(ava, attempt=10_000).runtime == WEEK_MINUTES
    measured = measure_request(holden, "accuracy")
    again = measure_request(holden, "accuracy", attempt=3)
    assert again.mem_mb == pytest.approx(3 * measured.mem_mb, abs=2)


def test_the_length_of_a_clip_is_counted_from_its_rows(tmp_path) -> None:
    assert bvh_seconds(bvh(tmp_path / "a.bvh", 500, 2_000_000_000)) == pytest.approx(5.0)
    assert bvh_seconds(bvh(tmp_path / "b.bvh", 500, 500, "1e9")) <= 500
    assert bvh_seconds(bvh(tmp_path / "c.bvh", 0, 500)) is None
    assert bvh_seconds(bvh(tmp_path / "d.bvh", 5, 5, "1.2.3")) is None
    assert bvh_seconds(tmp_path / "not there.bvh") is None


def test_a_plan_says_how_long_its_trainings_take_and_names_a_faster_recipe(root: Path) -> None:
    project = Project(root, {})
    plan = [("training", {"configuration": name}) for name in ("holden", "test", "matching")]
    slow, quick = sentences_about_plan(project, [*plan, ("report", {"configuration": "fast"})])
    assert re.fullmatch(r"training holden: \d+ to \d+ min on .*; with --config training=fast \d+ to .*", slow)
    assert quick == "training test: 1 min."
