"""What a job asks of a cluster: memory and time, by how long its clip is and how many joints the figure has.

All is known from the configuration and the size of the user's files, never from a file that a job has yet to
make: the jobs of a clip travel as one, and are weighed before the first has run. The figures were measured on
clips of 10,000 and 40,000 frames; `benchmarks/demands.py` holds them against the logs of a finished run.
"""

from __future__ import annotations

import functools
import math
import os
import re
from pathlib import Path

from hobble.channels import channel
from hobble.measures.registry import measure
from hobble.models import model
from hobble.rows.layout import RowLayout
from hobble.training.options import Machines
from hobble.workflow.clips import original
from hobble.workflow.project import Project

ENGINE_MB = 400  # Snakemake, twice in a cluster's job: as the step that SLURM starts, and beside the script
PYTHON_MB = 400  # Python with numpy, scipy and the package
MEMORY_MARGIN = 1.5  # asked for each megabyte measured
TIME_MARGIN = 10  # the share of a second's work that a second on a busy, old machine may do
MEASURED_JOINTS = 31  # of the figure that was measured
ASSUMED_FRAMES = 20_000  # frames, of a clip that has yet to be downloaded
VISITS_PER_PASS = 10  # of a row in a pass of training, as of the original recipe
HEADER_BYTES = 1 << 20  # bytes, of a BVH file, within which its motion begins
WEEK_MINUTES = 7 * 24 * 60  # minutes, the longest that a job asks for


class Demands:
    """What one project's jobs ask for. It grows with the attempt, so that a killed job gets more."""

    def __init__(self, project: Project) -> None:
        self.project = project

    def memory(self, dataset: str, clip: str, each: float, attempt: int = 1) -> int:
        """Megabytes for a job of one clip that takes `each` for a thousand frames of 31 joints."""
        return _megabytes(each * self.thousands(dataset, clip), attempt)

    def minutes(self, dataset: str, clip: str, each: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a job of one clip that takes `each` seconds for a thousand frames, `least` at least."""
        return _minutes(each * self.thousands(dataset, clip), attempt, least)

    def memory_of_longest(self, dataset: str, each: float, rows: float = 0.0, attempt: int = 1) -> int:
        """Megabytes for a job that takes one clip after another, and `rows` bytes for each frame of all."""
        longest = max(self.thousands(dataset, clip) for clip in self.project.clips.of(dataset))
        return _megabytes(each * longest + rows * self.all_thousands(dataset) / 1e3, attempt)

    def minutes_of_all(self, dataset: str, each: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a job that takes `each` seconds for a thousand frames of all clips and mirrors."""
        return _minutes(each * self.all_thousands(dataset), attempt, least)

    def measure_memory(self, configuration: str, name: str, attempt: int = 1) -> int:
        """Megabytes for the measurement `name`."""
        cost = measure(name).cost
        more = math.ceil(MEMORY_MARGIN * cost.memory_mb * attempt)
        return more + self.evaluation_memory(configuration, cost.memory_each, attempt)

    def measure_minutes(self, configuration: str, name: str, attempt: int = 1) -> int:
        """Minutes for the measurement `name`."""
        cost = measure(name).cost
        each = cost.seconds_each * self._measured_share(configuration, name)
        return self.evaluation_minutes(configuration, each, attempt, cost.minutes)

    def _measured_share(self, configuration: str, name: str) -> float:
        """The share of a data set's frames that a measurement reads: all, or those of a sample."""
        if "sample_frames" not in measure(name).options.model_fields:
            return 1.0
        section = self.project.configurations.section(configuration, "evaluation", "sample_frames")
        dataset = self.project.configurations.dataset(configuration)
        frames = 1e3 * self.all_thousands(dataset) * MEASURED_JOINTS / self._joints(dataset)
        return min(1.0, section["sample_frames"] / max(frames, 1.0))

    def evaluation_memory(self, configuration: str, each: float, attempt: int = 1) -> int:
        """Megabytes for a measurement of a network on one clip of its data set after another."""
        return self.memory_of_longest(self.project.configurations.dataset(configuration), each, 0.0, attempt)

    def evaluation_minutes(self, configuration: str, each: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a measurement that takes `each` seconds for a thousand frames of the data set."""
        dataset = self.project.configurations.dataset(configuration)
        return self.minutes_of_all(dataset, each, attempt, least)

    def training_memory(self, configuration: str, attempt: int = 1) -> int:
        """Megabytes for a training on each machine.

        Each process has PyTorch, the part of the database it holds, weights and their moments.
        """
        training = self.project.configurations.section(configuration, "training")
        each = 500 + training["memory_mb"] + 32e-6 * self.weights(configuration)
        return _megabytes(self.machines(configuration).each * each, attempt)

    def training_minutes(self, configuration: str, attempt: int = 1) -> int:
        """Minutes for a training, as long as a week; killed by its limit it goes on from its last checkpoint.

        It does some 6.4e9 products of weights in a second (10,700 samples of 342-512-512-311, two cores).
        """
        training = self.project.configurations.section(configuration, "training")
        dataset = self.project.configurations.dataset(configuration)
        frames = 1e3 * self.all_thousands(dataset) * MEASURED_JOINTS / self._joints(dataset)
        samples = frames * VISITS_PER_PASS * training["passes"]
        seconds = samples * self.weights(configuration) / 4 / 6.4e9
        return _minutes(seconds / self.machines(configuration).count, attempt, least=60)

    def machines(self, configuration: str) -> Machines:
        """On what a configuration trains."""
        return self.project.catalogue.configuration(configuration).training

    def training_threads(self, configuration: str) -> int:
        """Two for one process, one for each of several on a CPU, two for each GPU that SLURM gives."""
        machines = self.machines(configuration)
        return 2 if machines.gpus else max(2, machines.processes)

    def gpus(self, configuration: str) -> int:
        """GPUs of a training on one machine: those it is told to use, 1 for `device: cuda`.

        `auto` takes what it finds, but asks for none.
        """
        machines = self.machines(configuration)
        if machines.gpus:
            return machines.gpus if machines.nodes == 1 else 0
        return int(self.project.configurations.section(configuration, "training")["device"] == "cuda")

    def gres(self, configuration: str) -> str:
        """GPUs on each of several machines, as SLURM says it; else nothing."""
        machines = self.machines(configuration)
        return f"gpu:{machines.gpus}" if machines.gpus and machines.nodes > 1 else ""

    # Sizes

    def thousands(self, dataset: str, clip: str) -> float:
        """Thousands of frames at the data set's rate, as if of 31 joints."""
        return self._frames(dataset, original(clip)) / 1e3 * self._joints(dataset) / MEASURED_JOINTS

    def weights(self, configuration: str) -> float:
        """Numbers that are trained, by the columns of the configuration's rows."""
        chosen, layout = self.project.catalogue.configuration(configuration), self.layout(configuration)
        return model(chosen.network.kind).parameters(chosen.network, layout.x_size, layout.y_size)

    def layout(self, configuration: str) -> RowLayout:
        """The columns of a configuration's rows."""
        chosen = self.project.catalogue.configuration(configuration)
        skeleton = self.project.catalogue.skeleton(self.project.catalogue.dataset(chosen.dataset).skeleton)
        of_rows = self.project.datasets.options(chosen.dataset, "database", "window", "step")
        told = tuple((name, len(channel(name).columns(skeleton))) for name in chosen.channels)
        return RowLayout(joints=len(skeleton.joints), channels=told, **of_rows)

    @functools.cache  # noqa: B019 - one for as long as the process lives
    def all_thousands(self, dataset: str) -> float:
        """Thousands of frames of all clips, mirrors included."""
        once = sum(self.thousands(dataset, clip) for clip in self.project.clips.of(dataset))
        return once * (1 + self.project.catalogue.dataset(dataset).mirror)

    @functools.cache  # noqa: B019
    def _joints(self, dataset: str) -> int:
        return len(self.project.catalogue.skeleton(self.project.catalogue.dataset(dataset).skeleton).joints)

    @functools.cache  # noqa: B019
    def _frames(self, dataset: str, clip: str) -> float:
        if self.project.catalogue.dataset(dataset).synthetic is not None:
            return self.project.datasets.frames(dataset, clip)
        seconds = bvh_seconds(Path(self.project.clips.source(dataset, clip)))
        rate = self.project.datasets.options(dataset, "motion")["fps"]
        return ASSUMED_FRAMES if seconds is None else seconds * rate


def bvh_seconds(path: Path) -> float | None:
    """Length of a BVH file in seconds, by its frame time and the length of its first row, or None.

    The count in the header is not believed: it may promise what the file does not hold.
    """
    try:
        size = os.path.getsize(path)
        with open(path, "rb") as file:
            start = file.read(HEADER_BYTES)
    except OSError:
        return None
    begins = re.search(rb"Frame Time:[ \t]*([0-9.eE+-]+)\s*\n([^\n]+\n)", start)
    try:
        seconds = min(float(begins[1]), 1.0) if begins else 0.0
    except ValueError:
        return None
    return seconds * (size - begins.start(2)) / len(begins[2]) if begins and seconds > 0 else None


def _megabytes(measured: float, attempt: int) -> int:
    return math.ceil((ENGINE_MB + PYTHON_MB + MEMORY_MARGIN * measured) * attempt)


def _minutes(seconds: float, attempt: int, least: int) -> int:
    return min(max(least, math.ceil(TIME_MARGIN * seconds / 60)) * attempt, WEEK_MINUTES)
