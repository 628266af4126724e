"""Estimates how long trainings take, for the plan that a user sees before the first job."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from hobble.core.errors import HobbleError
from hobble.workflow.demands import Demands
from hobble.workflow.project import Project

# Seconds of a step of training for each parameter of a network, and for each sample and parameter, on two
# quiet cores of an AMD EPYC 9005: 10,200 samples a second at a batch of 32, 35,600 at 256, 2.4 million
# parameters (docs/training.md).
STEP_SECONDS, SAMPLE_SECONDS = 1.07e-9, 7.6e-12
# Two quiet cores of a Zen 4 machine took 2.7 times as long, and two cores of a Zen 3 machine, which lacks
# AVX-512, 11 times as long at a batch of 256 beside some tests.
SLOWEST = 11.0
FAST = "fast"  # the configuration with the recipe that is named if it is much faster
LONG_SECONDS = 300.0  # for a training that takes longer than this
SHORT_SECONDS = 10.0  # a shorter training is mostly start, checks and saving: it tells nothing of the machine


def sentences_about_plan(project: Project, jobs: Sequence[tuple[str, Mapping[str, str]]]) -> list[str]:
    """How long the trainings of a plan take, a sentence each, with a faster recipe for a long one.

    jobs: rule and wildcards of each job.
    """
    names = [wildcards["configuration"] for rule, wildcards in jobs if rule == "training"]
    demands, catalogue, sentences = Demands(project), project.catalogue, []
    measured = slowness(demands)
    fast = (
        catalogue.configuration(FAST).training.model_dump() if FAST in catalogue.names() and names else None
    )
    for name in names:
        training = catalogue.configuration(name).training
        if demands.gpus(name) or not demands.parameter_count(name):
            continue
        seconds = expected_seconds(demands, name, training.model_dump()) / training.count
        sentence = f"training {name}: {_range(seconds, measured)}"
        if fast and seconds * (measured or SLOWEST) > LONG_SECONDS:
            faster = expected_seconds(demands, name, fast) / training.count
            if faster < seconds / 2:
                sentence += f"; with --config training={FAST} {_range(faster, measured)} (docs/training.md)"
        sentences.append(f"{sentence}.")
    return sentences


def expected_seconds(demands: Demands, configuration: str, training: Mapping[str, Any]) -> float:
    """Seconds of a training on the machine of STEP_SECONDS. training: the keys `passes` and `batch`."""
    samples = demands.training_samples(configuration, training["passes"])
    step = STEP_SECONDS + SAMPLE_SECONDS * training["batch"]
    return samples / training["batch"] * step * demands.parameter_count(configuration)


def slowness(demands: Demands) -> float | None:
    """How many times as long as expected the trainings took whose results are here; None without any."""
    ratios = []
    for name in demands.project.catalogue.names():
        with contextlib.suppress(OSError, ValueError, KeyError, IndexError, HobbleError):
            with open(Path("results", name, "network", "history.csv"), newline="", encoding="utf-8") as file:
                last = list(csv.DictReader(file))[-1]
            training = demands.project.catalogue.configuration(name).training.model_dump()
            expected = expected_seconds(demands, name, training)
            samples = demands.training_samples(name, training["passes"])
            if expected < SHORT_SECONDS:
                continue
            ratios.append(float(last["seconds"]) / float(last["samples"]) * samples / expected)
    return median(ratios) if ratios else None


def _range(seconds: float, measured: float | None) -> str:
    """A time as text: for a machine that has trained before, or from the fastest to the slowest known one."""
    if measured:
        return f"about {_minutes(seconds * measured)} min"
    fastest, slowest = _minutes(seconds), _minutes(seconds * SLOWEST)
    return f"{fastest} min" if fastest == slowest else f"{fastest} to {slowest} min on two quiet cores"


def _minutes(seconds: float) -> int:
    return max(1, round(seconds / 60))
