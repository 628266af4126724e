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

# Seconds of a step of training for each parameter of a network, and for each sample and parameter, on two
# quiet cores of an AMD EPYC 9005: 10,200 samples a second at a batch of 32, 35,600 at 256, 2.4 million
# parameters (docs/training.md).
STEP_SECONDS, SAMPLE_SECONDS = 1.07e-9, 7.6e-12
FAST = "fast"  # the configuration with the recipe that is named if it is much faster
LONG_SECONDS = 300.0  # for a training that takes longer than this


def sentences_about_trainings(demands: Demands, names: Sequence[str]) -> list[str]:
    """How long trainings take, a sentence for each configuration, with a faster recipe for a long one."""
    catalogue, sentences = demands.project.catalogue, []
    measured = slowness(demands)
    fast = (
        catalogue.configuration(FAST).training.model_dump() if FAST in catalogue.names() and names else None
    )
    for name in names:
        training = catalogue.configuration(name).training
        if demands.gpus(name) or not demands.parameter_count(name):
            continue
        seconds = expected_seconds(demands, name, training.model_dump()) * (measured or 1.0) / training.count
        speed = (
            "at the speed of earlier trainings here" if measured else "on two fast cores, longer on others"
        )
        sentence = f"training {name}: about {_minutes(seconds)} {speed}"
        if fast and seconds > LONG_SECONDS:
            faster = expected_seconds(demands, name, fast) * (measured or 1.0) / training.count
            if faster < seconds / 2:
                sentence += f"; about {_minutes(faster)} with --config training={FAST} (docs/training.md)"
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
            ratios.append(float(last["seconds"]) / float(last["samples"]) * samples / expected)
    return median(ratios) if ratios else None


def _minutes(seconds: float) -> str:
    return f"{max(1, round(seconds / 60))} min"
