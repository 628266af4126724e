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
from dataclasses import dataclass
from pathlib import Path

from hobble.channels import channel
from hobble.measures.measure import measure_named
from hobble.models.model import TrainedOptions
from hobble.rows.layout import RowLayout
from hobble.training.options import Machines
from hobble.workflow.batches import ClipBatch
from hobble.workflow.clips import original
from hobble.workflow.project import Project

# Memory of Snakemake itself. It runs twice in a cluster job: for SLURM's step and for the script.
ENGINE_MB = 400
PYTHON_MB = 400  # memory of Python with numpy, scipy and the package
MEMORY_MARGIN = 1.5  # requested memory / measured memory
TIME_MARGIN = 10  # requested time / measured time, for an old and busy machine
MEASURED_JOINTS = 31  # joints of the skeleton with which the rates were measured
CLIP_SECONDS = 0.1  # seconds for each clip, in addition to the seconds for its frames
ASSUMED_FRAMES = 20_000  # frames of a clip whose length is unknown, such as one that is not downloaded yet
VISITS_PER_PASS = 10  # how often a pass of training uses a frame: once on each of the grounds fitted under it
HEADER_BYTES = 1 << 20  # the motion of a BVH file begins within this many bytes
EXCERPT_THOUSANDS = 2.0  # thousands of frames that a measurement reads at once if it reads only a sample
WEEK_MINUTES = 7 * 24 * 60  # a job requests at most this time


@dataclass(frozen=True)
class Rate:
    """What a job needs. mb: for a thousand frames of its longest clip. seconds: for a thousand frames of all.

    mirrors: whether mirrors take as long as their clips. row_bytes: bytes for each frame of all clips. least:
    the least number of minutes.
    """

    mb: float
    seconds: float
    mirrors: bool = False
    row_bytes: float = 0.0
    least: int = 1


RATES = {
    "synthetic": Rate(13, 0.2),
    "motion": Rate(13, 0.3),
    "labels": Rate(5, 0.25),
    "channels": Rate(4, 0.2),  # for each channel
    "hurt": Rate(20, 0.7),
    "terrain": Rate(15, 0.3, mirrors=True, least=3),
    "database": Rate(22, 0.15, mirrors=True),
    "merge": Rate(10, 0.1, row_bytes=24, least=5),
    "look": Rate(10, 0.1, row_bytes=24, least=5),
    "report": Rate(12, 0.1, least=10),
}


class Demands:
    """Computes what a project's jobs request.

    Arguments of the methods: dataset, configuration: names. stage: a key of RATES. attempt: 1 for a job's
    first try, 2 for the second, ... The requests grow with it, so that a job that was killed for lack of
    memory or time gets more.
    """

    def __init__(self, project: Project) -> None:
        self.project = project

    def batch_memory(self, stage: str, batch: ClipBatch, attempt: int = 1) -> int:
        """MB for the job of a batch, which holds one clip at a time."""
        longest = max(self.thousands_of_frames(batch.dataset, clip) for clip in batch.clips)
        return _megabytes(RATES[stage].mb * longest, attempt)

    def batch_minutes(self, stage: str, batch: ClipBatch, attempt: int = 1) -> int:
        """Minutes for the job of a batch."""
        rate = RATES[stage]
        times = 1 + (rate.mirrors and batch.mirrored)
        if stage == "channels":
            times = len(self.project.batches.channels(batch))
        frames = sum(self.thousands_of_frames(batch.dataset, clip) for clip in batch.clips)
        return _minutes(times * rate.seconds * frames + CLIP_SECONDS * len(batch.clips), attempt, rate.least)

    def clip_memory(self, stage: str, dataset: str, clip: str, attempt: int = 1) -> int:
        """MB for a job that makes one clip."""
        return self.batch_memory(stage, ClipBatch(dataset, clip, (clip,), False), attempt)

    def clip_minutes(self, stage: str, dataset: str, clip: str, attempt: int = 1) -> int:
        """Minutes for a job that makes one clip."""
        return self.batch_minutes(stage, ClipBatch(dataset, clip, (clip,), False), attempt)

    def dataset_memory(self, stage: str, dataset: str, attempt: int = 1) -> int:
        """MB for a job that reads one clip after another of a data set."""
        rate = RATES[stage]
        kept = rate.row_bytes * self.all_thousands_of_frames(dataset) / 1e3
        return _megabytes(rate.mb * self._longest(dataset) + kept, attempt)

    def dataset_minutes(self, stage: str, dataset: str, attempt: int = 1) -> int:
        """Minutes for a job that reads all clips and mirrors of a data set."""
        rate = RATES[stage]
        return _minutes(rate.seconds * self.all_thousands_of_frames(dataset), attempt, rate.least)

    def measure_memory(self, configuration: str, name: str, attempt: int = 1) -> int:
        """MB for the job of the measurement `name`."""
        cost = measure_named(name).cost
        if self._measured_share(configuration, name) < 1:
            return _megabytes(cost.memory_mb + cost.mb_per_1000_frames * EXCERPT_THOUSANDS, attempt)
        longest = self._longest(self.project.configurations.dataset(configuration))
        return _megabytes(cost.memory_mb + cost.mb_per_1000_frames * longest, attempt)

    def measure_minutes(self, configuration: str, name: str, attempt: int = 1) -> int:
        """Minutes for the job of the measurement `name`."""
        cost = measure_named(name).cost
        rate = cost.seconds_per_1000_frames * self._measured_share(configuration, name)
        frames = self.all_thousands_of_frames(self.project.configurations.dataset(configuration))
        return _minutes(rate * frames, attempt, cost.least_minutes)

    def _measured_share(self, configuration: str, name: str) -> float:
        """The share of a data set's frames that the measurement `name` reads; below 1 for a sample."""
        if "sample_frames" not in measure_named(name).options.model_fields:
            return 1.0
        section = self.project.configurations.section(configuration, "evaluation", "sample_frames")
        dataset = self.project.configurations.dataset(configuration)
        # `all_thousands_of_frames` is scaled with the number of joints; this factor undoes it.
        frames = 1e3 * self.all_thousands_of_frames(dataset) * MEASURED_JOINTS / self._joints(dataset)
        return min(1.0, section["sample_frames"] / max(frames, 1.0))

    def training_memory(self, configuration: str, attempt: int = 1) -> int:
        """MB for a training, on each of its machines.

        Each process holds PyTorch, its part of the database, the weights and the optimiser's state. Some
        networks, such as motion matching, are built from the rows and not trained. For them, the process also
        holds up to three copies of all rows.
        """
        training = self.project.configurations.section(configuration, "training")
        # 500 MB for PyTorch, and 32 bytes for each parameter and its part of the optimiser's state.
        needed = 500 + training["memory_mb"] + 32e-6 * self.parameter_count(configuration)
        if self.project.configurations.is_built(configuration):
            layout, dataset = self.layout(configuration), self.project.configurations.dataset(configuration)
            # A number of a row has 4 bytes, so it needs 4e-3 MB for a thousand rows.
            needed += 3 * 4e-3 * (layout.x_size + layout.y_size) * self.all_thousands_of_frames(dataset)
        return _megabytes(self.machines(configuration).processes_per_node * needed, attempt)

    def training_minutes(self, configuration: str, attempt: int = 1) -> int:
        """Minutes for a training, at most a week. A killed training continues from its last checkpoint.

        The estimate assumes that a process multiplies by 6.4e9 weights per second. Two cores reach this rate:
        they train a PFNN with layers of 342, 512, 512 and 311 units on 10,700 samples per second. A PFNN has
        four parameters for each weight.
        """
        training = self.project.configurations.section(configuration, "training")
        seconds = (
            self.training_samples(configuration, training["passes"])
            * self.parameter_count(configuration)
            / 4
            / 6.4e9
        )
        return _minutes(seconds / self.machines(configuration).count, attempt, least=60)

    def training_samples(self, configuration: str, passes: float) -> float:
        """About how many samples a training sees in a number of passes."""
        dataset = self.project.configurations.dataset(configuration)
        every = self.project.datasets.hurt_row_step(dataset)  # of the rows of hurt versions
        frames = sum(
            self._frames(dataset, original(clip)) / (every if self.project.clips.is_hurt_version(clip) else 1)
            for clip, split in self.project.configurations.splits(configuration).items()
            if split == "train"
        )
        return frames * VISITS_PER_PASS * passes

    def machines(self, configuration: str) -> Machines:
        """The machines on which a configuration trains; one process if its network is built, not trained."""
        if self.project.configurations.is_built(configuration):
            return Machines()
        return self.project.catalogue.configuration(configuration).training

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
        return int(self.project.configurations.section(configuration, "training")["device"] == "cuda")

    def gres(self, configuration: str) -> str:
        """SLURM's option `gres`, such as "gpu:8", for the GPUs of each of several machines; else ""."""
        machines = self.machines(configuration)
        return f"gpu:{machines.gpus}" if machines.gpus and machines.nodes > 1 else ""

    # Sizes

    def thousands_of_frames(self, dataset: str, clip: str) -> float:
        """Thousands of frames of a clip, multiplied by (its number of joints / MEASURED_JOINTS)."""
        return self._frames(dataset, original(clip)) / 1e3 * self._joints(dataset) / MEASURED_JOINTS

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def _longest(self, dataset: str) -> float:
        """Thousands of frames of the longest clip, scaled like `thousands_of_frames`."""
        return max(
            self.thousands_of_frames(dataset, clip) for clip in self.project.clips.listed_entries(dataset)
        )

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

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def all_thousands_of_frames(self, dataset: str) -> float:
        """Thousands of frames of all clips and mirrors, scaled like `thousands_of_frames`."""
        without_mirrors = sum(
            self.thousands_of_frames(dataset, clip) for clip in self.project.clips.entries(dataset)
        )
        return without_mirrors * (1 + self.project.catalogue.dataset(dataset).mirror)

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
        rate = self.project.datasets.options(dataset, "motion")["fps"]
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


def _megabytes(megabytes: float, attempt: int) -> int:
    """The requested MB of a job that is estimated to need `megabytes` besides Snakemake and Python."""
    return math.ceil((ENGINE_MB + PYTHON_MB + MEMORY_MARGIN * megabytes) * attempt)


def _minutes(seconds: float, attempt: int, least: int) -> int:
    """The requested minutes of a job that is estimated to take `seconds`."""
    return min(max(least, math.ceil(TIME_MARGIN * seconds / 60)) * attempt, WEEK_MINUTES)
