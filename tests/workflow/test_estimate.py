"""How long a training takes is told before the first job, from earlier trainings if these tell it."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from hobble.workflow.demands import Demands
from hobble.workflow.estimate import expected_seconds, sentences_about_plan
from hobble.workflow.project import Project

PLAN = [("training", {"configuration": "limp"})]


@pytest.fixture
def project(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Project:
    """The project, without results."""
    monkeypatch.chdir(tmp_path)
    return Project(root, {})


def _trained(project: Project, name: str, times_as_long: float) -> None:
    """Write the history of a training that took `times_as_long` as expected."""
    demands = Demands(project)
    training = project.catalogue.configuration(name).training.model_dump()
    row = {
        "seconds": times_as_long * expected_seconds(demands, name, training),
        "samples": demands.training_samples(name, training["passes"]),
    }
    folder = Path("results", name, "network")
    folder.mkdir(parents=True)
    with open(folder / "history.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(row))
        writer.writeheader()
        writer.writerow(row)


def test_without_results_the_range_of_known_machines_is_told(project: Project) -> None:
    assert "min on two quiet cores" in sentences_about_plan(project, PLAN)[0]


def test_an_earlier_training_tells_the_speed_of_the_machine(project: Project) -> None:
    _trained(project, "fast", 6.0)
    (sentence,) = sentences_about_plan(project, PLAN)
    demands = Demands(project)
    training = project.catalogue.configuration("limp").training.model_dump()
    minutes = round(6.0 * expected_seconds(demands, "limp", training) / 60)
    assert sentence.startswith(f"training limp: about {minutes} min")


def test_a_tiny_training_which_is_mostly_start_tells_nothing(project: Project) -> None:
    before = sentences_about_plan(project, PLAN)
    _trained(project, "test", 100.0)
    assert sentences_about_plan(project, PLAN) == before
