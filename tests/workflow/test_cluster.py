"""Requests to a cluster: number of jobs, and memory and time of each."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from hobble.workflow.batches import LEAST_BATCHES, batch_of
from hobble.workflow.demands import WEEK_MINUTES, Demands, bvh_seconds
from hobble.workflow.project import Project

CLIPS = 40
MANY = "skeleton: holden31\nfolder: many\nmirror: true\nheld_out: [clip-00]\n"


@pytest.fixture
def demands(root: Path) -> Demands:
    return Demands(Project(root, {}))


def profile(root: Path, name: str) -> dict:
    return yaml.safe_load((root / f"profiles/{name}/config.v9+.yaml").read_text())


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
    request = ("--config", f"mocap={tmp_path}", "--", "results/many/report.html")
    planned = workflow.planned(*request)
    stages = ("motion_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips")
    used = len({batch_of(f"clip-{number:02}", LEAST_BATCHES) for number in range(CLIPS)})
    assert {rule: planned.pop(rule) for rule in stages} == dict.fromkeys(stages, used)
    # Whatever is not in a batch is there once for the data set, the configuration or a measurement or its
    # piece, not once for each clip.
    assert {rule for rule, count in planned.items() if count > 1} == {"measure"}, planned


@pytest.mark.parametrize("name", ["slurm", "kubernetes", "s3"])
def test_cluster_profiles_have_the_settings_of_the_default_one(root, name: str) -> None:
    ours, default = profile(root, name), profile(root, "default")
    del default["logger"]  # on a cluster Snakemake's full output says which job went where
    defaults = default.pop("default-resources")
    if name == "kubernetes":  # a pod needs disk space for its inputs
        del defaults["disk_mb"]
    assert {key: ours.get(key) for key in default} == default
    assert ours["default-resources"].items() >= defaults.items()
    assert ("disk_mb" in ours["default-resources"]) == ("disk_mb" in defaults)


def test_a_pod_is_tried_as_often_as_a_job_of_slurm(root) -> None:
    assert profile(root, "kubernetes")["retries"] == profile(root, "slurm")["retries"] == 2


@pytest.mark.workflow
def test_configurations_train_side_by_side(workflow) -> None:
    names = ["holden", "holden-xl", "injured"]
    plan = workflow.run("-np", *(f"results/{name}/network/weights.npz" for name in names))
    trainings = re.findall(r"^rule training:\n    input: (.*)$", plan, re.M)
    assert len(trainings) == len(names)
    assert all("/network/" not in files for files in trainings)


@pytest.mark.workflow
def test_a_gpu_is_requested_if_training_uses_one(workflow) -> None:
    weights = "results/test/network/weights.npz"
    plan = workflow.run("-np", "--config", "training={device: cuda}", "--", weights)
    assert len(re.findall("gpu=1", plan)) == 1
    assert "gpu=1" not in workflow.run("-np", weights)


def test_requests_grow_with_motion_and_attempt(demands) -> None:
    short, long = (demands.job("hurt", "synthetic", [clip]) for clip in ("jog-2", "jog-1"))
    again = demands.job("hurt", "synthetic", ["jog-1"], attempt=2)
    assert short < long
    assert again == pytest.approx((2 * long.mem_mb, 2 * long.runtime), abs=1)
    assert demands.job("hurt", "synthetic", ["jog-1_hurt1"]) == long
    assert demands.job("hurt", "synthetic-ava", ["jog-1"]).mem_mb > long.mem_mb
    both = demands.job("hurt", "synthetic", ["jog-1", "jog-2"])
    assert both == pytest.approx((long.mem_mb, short.runtime + long.runtime), abs=1)
    assert demands.training("ava").mem_mb > demands.training("holden").mem_mb
    assert demands.training("ava", attempt=10_000).runtime == WEEK_MINUTES
    measured = demands.measure("holden", "accuracy")
    assert demands.measure("holden", "accuracy", attempt=3).mem_mb == pytest.approx(
        3 * measured.mem_mb, abs=2
    )


def test_the_length_of_a_clip_is_counted_from_its_rows(tmp_path) -> None:
    assert bvh_seconds(bvh(tmp_path / "a.bvh", 500, 2_000_000_000)) == pytest.approx(5.0)
    assert bvh_seconds(bvh(tmp_path / "b.bvh", 500, 500, "1e9")) <= 500
    assert bvh_seconds(bvh(tmp_path / "c.bvh", 0, 500)) is None
    assert bvh_seconds(bvh(tmp_path / "d.bvh", 5, 5, "1.2.3")) is None
    assert bvh_seconds(tmp_path / "not there.bvh") is None
