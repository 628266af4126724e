"""Requests to a cluster: number of jobs, memory and time of each. How long a training takes is told first."""

import re
from pathlib import Path

import pytest
import yaml

from hobble.workflow.demands import WEEK_MINUTES, job_request, sentences_about_plan, training_request
from hobble.workflow.project import Project


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


def test_requests_grow_with_motion_and_attempt(root: Path) -> None:
    project = Project(root, {})
    data, holden, ava = project.dataset("synthetic"), *map(project.configuration, ("holden", "ava"))
    short, long = (job_request("hurt", data, [clip]) for clip in ("jog-2", "jog-1"))
    again = job_request("hurt", data, ["jog-1"], attempt=2)
    assert short < long
    assert again == pytest.approx((2 * long.mem_mb, 2 * long.runtime), abs=1)
    assert job_request("hurt", project.dataset("synthetic-ava"), ["jog-1"]).mem_mb > long.mem_mb
    both = job_request("hurt", data, ["jog-1", "jog-2"])
    assert both == pytest.approx((long.mem_mb, short.runtime + long.runtime), abs=1)
    assert training_request(ava).mem_mb > training_request(holden).mem_mb
    assert training_request(ava, attempt=10_000).runtime == WEEK_MINUTES


def test_a_plan_says_how_long_its_trainings_take_and_names_a_faster_recipe(root: Path) -> None:
    project = Project(root, {})
    plan = [("training", {"configuration": name}) for name in ("holden", "test", "matching")]
    slow, quick = sentences_about_plan(project, [*plan, ("report", {"configuration": "fast"})])
    assert re.fullmatch(r"training holden: \d+ to \d+ min on .*; with --config training=fast \d+ to .*", slow)
    assert quick == "training test: 1 min."
