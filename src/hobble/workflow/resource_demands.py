"""Computes the memory and time that jobs request from a cluster.

Memory and time grow with the length of the clips and the number of joints. Requests are made before any job
has run, so the lengths are estimated from the configuration and the sizes of the user's files. The rates (MB
or seconds for a thousand frames) were measured on clips of 10,000 and 40,000 frames with 31 joints.
`benchmarks/demands.py` compares the requests with the logs of a finished run.
"""

from __future__ import annotations

import functools
import math
import os
import re
from pathlib import Path

from hobble.channels import channel
from hobble.measures.measure import measure_named
from hobble.models import model_of_kind
from hobble.models.model import TrainedModel
from hobble.rows.layout import RowLayout
from hobble.training.options import Machines
from hobble.workflow.clip_batches import ClipBatch
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
# A shard is a part of a database that one job makes. It has one row for each frame of some of the clips.
SHARD_MB = 10  # MB that this job needs for each thousand frames of the longest clip
ROW_BYTES = 24  # bytes that this job needs for each row of the shard, for its position in the shuffled order
EXCERPT_THOUSANDS = 2.0  # thousands of frames that a measurement reads at once if it reads only a sample
WEEK_MINUTES = 7 * 24 * 60  # a job requests at most this time


class Demands:
    """Computes what a project's jobs request.

    Arguments of the methods: dataset, configuration: names. batch: the clips that one job processes.
    attempt: 1 for a job's first try, 2 for the second, ... The requests grow with it, so that a job that was
    killed for lack of memory or time gets more. least: the least number of minutes that a job requests.
    """

    def __init__(self, project: Project) -> None:
        self.project = project

    def batch_memory(self, batch: ClipBatch, rate: float, attempt: int = 1) -> int:
        """MB for a batch's job. rate: MB for a thousand frames of its longest clip, with 31 joints."""
        return _megabytes(rate * max(self._thousands_of_frames(batch)), attempt)

    def batch_minutes(self, batch: ClipBatch, rate: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a batch's job that takes `rate` seconds for a thousand frames with 31 joints."""
        seconds = sum(rate * thousands + CLIP_SECONDS for thousands in self._thousands_of_frames(batch))
        return _minutes(seconds, attempt, least)

    def memory_of_longest(self, dataset: str, rate: float, row_bytes: float = 0.0, attempt: int = 1) -> int:
        """MB for a job that reads one clip after another.

        rate: MB for a thousand frames of the longest clip. row_bytes: bytes that the job keeps of each frame
        of all clips.
        """
        longest = max(self.thousands_of_frames(dataset, clip) for clip in self.project.clips.entries(dataset))
        return _megabytes(rate * longest + row_bytes * self.all_thousands_of_frames(dataset) / 1e3, attempt)

    def shard_memory(self, dataset: str, attempt: int = 1) -> int:
        """MB for a job that makes a shard. It holds one clip at a time, and a few numbers for each row."""
        longest = max(self.thousands_of_frames(dataset, clip) for clip in self.project.clips.entries(dataset))
        return _megabytes(SHARD_MB * longest + ROW_BYTES * self._shard_thousands(dataset) / 1e3, attempt)

    def shard_minutes(self, dataset: str, rate: float, attempt: int = 1) -> int:
        """Minutes for a job that takes `rate` seconds for a thousand frames of a shard."""
        return _minutes(rate * self._shard_thousands(dataset), attempt, least=5)

    def _shard_thousands(self, dataset: str) -> float:
        """Thousands of frames of the largest shard. It may have twice as many as the average shard."""
        shards = self.project.datasets.shards(dataset)
        return self.all_thousands_of_frames(dataset) * min(1.0, 2 / shards if shards > 1 else 1.0)

    def minutes_of_all(self, dataset: str, rate: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a job that takes `rate` seconds for a thousand frames of all clips and mirrors."""
        return _minutes(rate * self.all_thousands_of_frames(dataset), attempt, least)

    def measure_memory(self, configuration: str, name: str, attempt: int = 1) -> int:
        """MB for the job of the measurement `name`."""
        cost = measure_named(name).cost
        if self._measured_share(configuration, name) < 1:
            return _megabytes(cost.memory_mb + cost.mb_per_1000_frames * EXCERPT_THOUSANDS, attempt)
        fixed = math.ceil(MEMORY_MARGIN * cost.memory_mb * attempt)
        return fixed + self.evaluation_memory(configuration, cost.mb_per_1000_frames, attempt)

    def measure_minutes(self, configuration: str, name: str, attempt: int = 1) -> int:
        """Minutes for the job of the measurement `name`."""
        cost = measure_named(name).cost
        rate = cost.seconds_per_1000_frames * self._measured_share(configuration, name)
        return self.evaluation_minutes(configuration, rate, attempt, cost.least_minutes)

    def _measured_share(self, configuration: str, name: str) -> float:
        """The share of a data set's frames that the measurement `name` reads; below 1 for a sample."""
        if "sample_frames" not in measure_named(name).options.model_fields:
            return 1.0
        section = self.project.configurations.section(configuration, "evaluation", "sample_frames")
        dataset = self.project.configurations.dataset(configuration)
        # `all_thousands_of_frames` is scaled with the number of joints; this factor undoes it.
        frames = 1e3 * self.all_thousands_of_frames(dataset) * MEASURED_JOINTS / self._joints(dataset)
        return min(1.0, section["sample_frames"] / max(frames, 1.0))

    def evaluation_memory(self, configuration: str, rate: float, attempt: int = 1) -> int:
        """MB for a job that reads one clip after another of the data set that the configuration uses.

        rate: MB for a thousand frames of the longest clip.
        """
        return self.memory_of_longest(self.project.configurations.dataset(configuration), rate, 0.0, attempt)

    def evaluation_minutes(self, configuration: str, rate: float, attempt: int = 1, least: int = 1) -> int:
        """Minutes for a job that takes `rate` seconds for a thousand frames of the configuration's data."""
        dataset = self.project.configurations.dataset(configuration)
        return self.minutes_of_all(dataset, rate, attempt, least)

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
        dataset = self.project.configurations.dataset(configuration)
        frames = 1e3 * self.all_thousands_of_frames(dataset) * MEASURED_JOINTS / self._joints(dataset)
        samples = frames * VISITS_PER_PASS * training["passes"]
        seconds = samples * self.parameter_count(configuration) / 4 / 6.4e9
        return _minutes(seconds / self.machines(configuration).count, attempt, least=60)

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

    def _thousands_of_frames(self, batch: ClipBatch) -> list[float]:
        """What `thousands_of_frames` returns, for each clip of a batch."""
        return [self.thousands_of_frames(batch.dataset, clip) for clip in batch.clips]

    def parameter_count(self, configuration: str) -> float:
        """Number of trained parameters of a configuration's network; 0 if it is not trained."""
        chosen, layout = self.project.catalogue.configuration(configuration), self.layout(configuration)
        kind = model_of_kind(chosen.network.kind)
        return (
            kind.parameter_count(chosen.network, layout.x_size, layout.y_size)
            if isinstance(kind, TrainedModel)
            else 0
        )

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
