"""Computes the memory and time that jobs request from a cluster.

Memory and time grow with the length of the clips and the number of joints. Requests are made before any job
has run, so the lengths are estimated from the configuration and the sizes of the user's files. The rates were
measured on clips of 10,000 and 40,000 frames with 31 joints. `benchmarks/demands.py` compares the requests
with what a finished run used.
"""

from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from hobble.channels import channel
from hobble.measures.measure import Cost, measure_named
from hobble.models.model import TrainedOptions
from hobble.rows.layout import RowLayout
from hobble.training.options import Machines
from hobble.workflow.clips import original
from hobble.workflow.project import Project

# Memory of Snakemake itself, which runs twice in a cluster job (for SLURM's step and for the script), and of
# Python with numpy, scipy and the package.
ENGINE_MB, PYTHON_MB = 400, 400
MEMORY_MARGIN = 1.5  # requested memory / measured memory
TIME_MARGIN = 10  # requested time / measured time, for an old and busy machine
MEASURED_JOINTS = 31  # joints of the skeleton with which the rates were measured
CLIP_SECONDS = 0.1  # seconds for each clip, in addition to the seconds for its frames
ASSUMED_FRAMES = 20_000  # frames of a clip whose length is unknown, such as one that is not downloaded yet
VISITS_PER_PASS = 10  # how often a pass of training uses a frame: once on each of the grounds fitted under it
HEADER_BYTES = 1 << 20  # the motion of a BVH file begins within this many bytes
EXCERPT_THOUSANDS = 2.0  # thousands of frames that a measurement reads at once if it reads only a sample
WEEK_MINUTES = 7 * 24 * 60  # a job requests at most this time

# What the jobs of a stage need: MB and seconds for each thousand frames, and the least number of minutes.
RATES = {
    "synthetic": Cost(0, 13, 0.2, 1),
    "motion": Cost(0, 13, 0.3, 1),
    "labels": Cost(0, 5, 0.25, 1),
    "channels": Cost(0, 4, 0.2, 1),  # for each channel
    "hurt": Cost(0, 20, 0.7, 1),
    "terrain": Cost(0, 15, 0.3, 3),
    "database": Cost(0, 22, 0.15, 1),
    "merge": Cost(0, 10, 0.1, 5),
    "look": Cost(0, 10, 0.1, 5),
    "report": Cost(0, 12, 0.1, 10),
}
# Stages in which mirrors take as long as their clips, and those that keep 24 bytes of each frame in memory.
WITH_MIRRORS = ("terrain", "database", "merge", "look", "report")
KEPT_MB, KEEPING = 0.024, ("merge", "look")  # MB of a thousand frames


class Request(NamedTuple):
    """What a job requests: MB of memory and minutes."""

    mem_mb: int
    runtime: int


def request(megabytes: float, seconds: float, attempt: int, least: int) -> Request:
    """The request of a job that is estimated to need `megabytes` besides Snakemake and Python, and `seconds`.

    attempt: 1 for a job's first try, 2 for the second, ... A job that was killed for lack of memory or time
    gets more. least: the least number of minutes.
    """
    minutes = max(least, math.ceil(TIME_MARGIN * seconds / 60)) * attempt
    return Request(
        math.ceil((ENGINE_MB + PYTHON_MB + MEMORY_MARGIN * megabytes) * attempt),
        min(math.ceil(minutes), WEEK_MINUTES),
    )


class Demands:
    """Computes what a project's jobs request. dataset, configuration: names. attempt: see `request`."""

    def __init__(self, project: Project) -> None:
        self.project, self.configurations = project, project.configurations

    def job(self, stage: str, dataset: str, clips: Iterable[str] | None = None, attempt: int = 1) -> Request:
        """The request of a job that holds one clip at a time. stage: a key of RATES. clips: None for all."""
        rate = RATES[stage]
        sizes = [self.thousands_of_frames(dataset, clip) for clip in clips or self.all_clips(dataset)]
        times = 1 + (stage in WITH_MIRRORS and self.project.catalogue.dataset(dataset).mirror)
        if stage == "channels":
            times = len(self.project.datasets.channel_sources.channels(dataset))
        kept = KEPT_MB * times * sum(sizes) if stage in KEEPING else 0.0
        seconds = times * rate.seconds_per_1000_frames * sum(sizes) + CLIP_SECONDS * len(sizes)
        return request(rate.mb_per_1000_frames * max(sizes) + kept, seconds, attempt, rate.least_minutes)

    def measure(self, configuration: str, name: str, attempt: int = 1) -> Request:
        """The request of the measurement `name`. Some measurements read only a sample of the frames."""
        measure, dataset = measure_named(name), self.configurations.dataset(configuration)
        frames = self.all_thousands_of_frames(dataset)
        longest = max(self.thousands_of_frames(dataset, clip) for clip in self.all_clips(dataset))
        if "sample_frames" in measure.options.model_fields:
            sample = self.configurations.section(configuration, "evaluation")["sample_frames"] / 1e3
            sample *= self._joints(dataset) / MEASURED_JOINTS
            if sample < frames:
                frames, longest = sample, EXCERPT_THOUSANDS
        cost = measure.cost
        megabytes = cost.memory_mb + cost.mb_per_1000_frames * longest
        return request(megabytes, cost.seconds_per_1000_frames * frames, attempt, cost.least_minutes)

    def training(self, configuration: str, attempt: int = 1) -> Request:
        """The request of a training, on each of its machines.

        Each process holds PyTorch (500 MB), its part of the database, the weights and the optimiser's state
        (32 bytes for each parameter). A network that is built from the rows and not trained, such as motion
        matching, also has up to three copies of all rows, with 4 bytes for each number.

        A process multiplies by 6.4e9 weights per second: two cores train a PFNN with layers of 342, 512, 512
        and 311 units on 10,700 samples per second. A PFNN has four parameters for each weight. A training
        that is killed continues from its last checkpoint.
        """
        options = self.project.catalogue.configuration(configuration).training
        parameters, machines = self.parameter_count(configuration), self.machines(configuration)
        needed = 500 + options.memory_mb + 32e-6 * parameters
        if self.configurations.is_built(configuration):
            layout, dataset = self.layout(configuration), self.configurations.dataset(configuration)
            needed += 3 * 4e-3 * (layout.x_size + layout.y_size) * self.all_thousands_of_frames(dataset)
        seconds = self.training_samples(configuration, options.passes) * parameters / 4 / 6.4e9
        return request(machines.processes_per_node * needed, seconds / machines.count, attempt, 60)

    def training_samples(self, configuration: str, passes: float) -> float:
        """About how many samples a training sees in a number of passes."""
        dataset = self.configurations.dataset(configuration)
        every = self.project.datasets.hurt_row_step(dataset)  # of the rows of hurt versions
        frames = sum(
            self._frames(dataset, original(clip)) / (every if self.project.clips.is_hurt_version(clip) else 1)
            for clip, split in self.configurations.splits(configuration).items()
            if split == "train"
        )
        return frames * VISITS_PER_PASS * passes

    def machines(self, configuration: str) -> Machines:
        """The machines on which a configuration trains; one process if its network is built, not trained."""
        built = self.configurations.is_built(configuration)
        return Machines() if built else self.project.catalogue.configuration(configuration).training

    def training_threads(self, configuration: str) -> int:
        """Threads of a training job: one for each process, at least 2.

        With GPUs there are 2 threads. SLURM counts threads per GPU, so there each GPU gets 2.
        """
        machines = self.machines(configuration)
        return 2 if machines.gpus else max(2, machines.processes)

    def gpus(self, configuration: str) -> int:
        """GPUs that a training requests: the option `gpus`, or 1 for `device: cuda`.

        0 if several machines request GPUs, because `gres` then requests them. With `device: auto`, a training
        may use a GPU, but it does not request one.
        """
        machines = self.machines(configuration)
        if machines.gpus:
            return machines.gpus if machines.nodes == 1 else 0
        return int(self.project.catalogue.configuration(configuration).training.device == "cuda")

    def gres(self, configuration: str) -> str:
        """SLURM's option `gres`, such as "gpu:8", for the GPUs of each of several machines; else ""."""
        machines = self.machines(configuration)
        return f"gpu:{machines.gpus}" if machines.gpus and machines.nodes > 1 else ""

    def parameter_count(self, configuration: str) -> float:
        """Number of trained parameters of a configuration's network; 0 if it is not trained."""
        chosen, layout = self.project.catalogue.configuration(configuration), self.layout(configuration)
        if isinstance(chosen.network, TrainedOptions):
            return chosen.network.parameter_count(layout.x_size, layout.y_size)
        return 0

    def layout(self, configuration: str) -> RowLayout:
        """The columns of a configuration's rows."""
        chosen = self.project.catalogue.configuration(configuration)
        skeleton = self.project.catalogue.skeleton(self.project.catalogue.dataset(chosen.dataset).skeleton)
        row_options = self.project.datasets.options(chosen.dataset, "database", "window", "step")
        channels = tuple((name, len(channel(name).columns(skeleton))) for name in chosen.channels)
        return RowLayout(joints=len(skeleton.joints), channels=channels, **row_options)

    def all_clips(self, dataset: str) -> list[str]:
        """All clips and hurt versions of a data set, without mirrors."""
        return list(self.project.clips.entries(dataset))

    def thousands_of_frames(self, dataset: str, clip: str) -> float:
        """Thousands of frames of a clip, multiplied by (its number of joints / MEASURED_JOINTS)."""
        return self._frames(dataset, original(clip)) / 1e3 * self._joints(dataset) / MEASURED_JOINTS

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def all_thousands_of_frames(self, dataset: str) -> float:
        """Thousands of frames of all clips and mirrors, scaled like `thousands_of_frames`."""
        frames = sum(self.thousands_of_frames(dataset, clip) for clip in self.all_clips(dataset))
        return frames * (1 + self.project.catalogue.dataset(dataset).mirror)

    @functools.cache  # noqa: B019
    def _joints(self, dataset: str) -> int:
        """Number of joints of the data set's skeleton."""
        return len(self.project.catalogue.skeleton(self.project.catalogue.dataset(dataset).skeleton).joints)

    @functools.cache  # noqa: B019
    def _frames(self, dataset: str, clip: str) -> float:
        """Estimated number of frames of a clip, after it is resampled to the data set's frame rate."""
        if self.project.catalogue.dataset(dataset).synthetic is not None:
            return self.project.datasets.frames(dataset, clip)
        seconds = bvh_seconds(Path(self.project.clips.source(dataset, clip)))
        rate = self.project.catalogue.dataset(dataset).motion.fps
        return ASSUMED_FRAMES if seconds is None else seconds * rate


def bvh_seconds(path: Path) -> float | None:
    """Estimated length of a BVH file in seconds: its frame time times its estimated number of frames.

    This number is the bytes of all frames divided by the bytes of the first frame. The number in the header
    is not used, because it may be wrong. None if the length cannot be estimated.
    """
    try:
        size = os.path.getsize(path)
        with open(path, "rb") as file:
            start = file.read(HEADER_BYTES)
    except OSError:
        return None
    found = re.search(rb"Frame Time:[ \t]*([0-9.eE+-]+)\s*\n([^\n]+\n)", start)
    try:
        frame_time = min(float(found[1]), 1.0) if found else 0.0  # a larger one must be a mistake
    except ValueError:
        return None
    return frame_time * (size - found.start(2)) / len(found[2]) if found and frame_time > 0 else None
