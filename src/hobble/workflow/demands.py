"""Computes the memory and time that jobs request from a cluster, and how long trainings take.

Memory and time grow with the length of the clips and the number of joints. Requests are made before any job
has run, so the lengths are estimated from the configuration and the sizes of the user's files. The rates were
measured on clips of 10,000 and 40,000 frames with 31 joints. `benchmarks/demands.py` compares the requests
with what a finished run used.
"""

import functools
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from hobble.channels import channel
from hobble.core.clip_files import original
from hobble.labels.local_phase import PARTS
from hobble.measures.measure import Cost, measure_named
from hobble.models.blend import BlendedOptions
from hobble.rows.layout import RowLayout
from hobble.training import Machines, Recipe
from hobble.workflow.datasets import NamedDataset, plain
from hobble.workflow.project import NamedConfiguration, Project

# Memory of Snakemake itself, which runs twice in a cluster job (for SLURM's step and for the script), and of
# Python with numpy, scipy and the package; of PyTorch.
ENGINE_MB, PYTHON_MB, PYTORCH_MB = 400, 400, 500
MEMORY_MARGIN = 1.5  # requested memory / measured memory
TIME_MARGIN = 10  # requested time / measured time, for an old and busy machine
MEASURED_JOINTS = 31  # joints of the skeleton with which the rates were measured
CLIP_SECONDS = 0.1  # seconds for each clip, in addition to the seconds for its frames
ASSUMED_FRAMES = 20_000  # frames of a clip whose length is unknown, such as one that is not downloaded yet
VISITS_PER_PASS = 10  # how often a pass of training uses a frame: once on each of the grounds fitted under it
HEADER_BYTES = 1 << 20  # the motion of a BVH file begins within this many bytes
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


def job_request(
    stage: str, dataset: NamedDataset, clips: Iterable[str] | None = None, attempt: int = 1
) -> Request:
    """The request of a job that holds one clip at a time.

    stage: a key of RATES. clips: None for all. attempt: see `request`.
    """
    rate = RATES[stage]
    sizes = [thousands_of_frames(dataset, clip) for clip in clips or dataset.entries]
    mirrored = 1 + (stage in WITH_MIRRORS and dataset.settings.mirror)
    times = len(dataset.channels) if stage == "channels" else mirrored
    kept = KEPT_MB * times * sum(sizes) if stage in KEEPING else 0.0
    seconds = times * rate.seconds_per_1000_frames * sum(sizes) + CLIP_SECONDS * len(sizes)
    encodes = stage == "database" and dataset.settings.database.local_phases == "autoencoder"
    megabytes = rate.mb_per_1000_frames * max(sizes) + kept + PYTORCH_MB * encodes
    return request(megabytes, seconds, attempt, rate.least_minutes)


def measure_request(configuration: NamedConfiguration, name: str, attempt: int = 1) -> Request:
    """The request of the measurement `name`."""
    cost, dataset = measure_named(name).cost, configuration.dataset
    longest = max(thousands_of_frames(dataset, clip) for clip in dataset.entries)
    megabytes = cost.memory_mb + cost.mb_per_1000_frames * longest
    seconds = cost.seconds_per_1000_frames * all_thousands_of_frames(dataset)
    return request(megabytes, seconds, attempt, cost.least_minutes)


def training_request(configuration: NamedConfiguration, attempt: int = 1) -> Request:
    """The request of a training, on each of its machines.

    Each process holds PyTorch, its part of the database, the weights and the optimiser's state
    (32 bytes for each parameter). A network that is built from the rows and not trained, such as motion
    matching, also has up to three copies of all rows, with 4 bytes for each number. A training that is killed
    continues from its last checkpoint.
    """
    options, machines = configuration.settings.training, machines_of(configuration)
    needed = PYTORCH_MB + options.memory_mb + 32e-6 * parameter_count(configuration)
    if configuration.is_built:
        layout = layout_of(configuration)
        needed += 12e-3 * (layout.x_size + layout.y_size) * all_thousands_of_frames(configuration.dataset)
    seconds = expected_seconds(configuration, options) / machines.count
    return request(machines.processes_per_node * needed, seconds, attempt, 60)


def machines_of(configuration: NamedConfiguration) -> Machines:
    """The machines on which a configuration trains; one process if its network is built, not trained."""
    return Machines() if configuration.is_built else configuration.settings.training


def training_threads(configuration: NamedConfiguration) -> int:
    """Threads of a training job: one for each process, at least 2.

    With GPUs there are 2 threads. SLURM counts threads per GPU, so there each GPU gets 2.
    """
    return max(2, machines_of(configuration).processes)


def gpus(configuration: NamedConfiguration) -> int:
    """GPUs that a training requests: the option `gpus`, or 1 for `device: cuda`.

    0 if several machines request GPUs, because `gres` then requests them. With `device: auto`, a training
    may use a GPU, but it does not request one.
    """
    machines = machines_of(configuration)
    if machines.gpus:
        return machines.gpus if machines.nodes == 1 else 0
    return int(configuration.settings.training.device == "cuda")


def gres(configuration: NamedConfiguration) -> str:
    """SLURM's option `gres`, such as "gpu:8", for the GPUs of each of several machines; else ""."""
    machines = machines_of(configuration)
    return f"gpu:{machines.gpus}" if machines.gpus and machines.nodes > 1 else ""


def parameter_count(configuration: NamedConfiguration) -> float:
    """Number of trained parameters of a configuration's network; 0 if it is not trained."""
    network, layout = configuration.settings.network, layout_of(configuration)
    if isinstance(network, BlendedOptions):
        return network.parameter_count(layout.x_size, layout.y_size)
    return 0


def layout_of(configuration: NamedConfiguration) -> RowLayout:
    """The columns of a configuration's rows."""
    dataset = configuration.dataset
    skeleton = dataset.catalogue.skeleton(dataset.settings.skeleton)
    channels = tuple((name, len(channel(name).columns(skeleton))) for name in configuration.channels)
    row_options = plain(dataset.settings, "database", ("window", "step"))
    local_phases = len(PARTS) if configuration.settings.network.uses_local_phases else 0
    return RowLayout(len(skeleton.joints), channels=channels, local_phases=local_phases, **row_options)


def thousands_of_frames(dataset: NamedDataset, clip: str) -> float:
    """Thousands of frames of a clip, multiplied by (its number of joints / MEASURED_JOINTS)."""
    return _frames(dataset, original(clip)) / 1e3 * _joints(dataset) / MEASURED_JOINTS


@functools.cache
def all_thousands_of_frames(dataset: NamedDataset) -> float:
    """Thousands of frames of all clips and mirrors, scaled like `thousands_of_frames`."""
    frames = sum(thousands_of_frames(dataset, clip) for clip in dataset.entries)
    return frames * (1 + dataset.settings.mirror)


@functools.cache
def _joints(dataset: NamedDataset) -> int:
    """Number of joints of the data set's skeleton."""
    return len(dataset.catalogue.skeleton(dataset.settings.skeleton).joints)


@functools.cache
def _frames(dataset: NamedDataset, clip: str) -> float:
    """Estimated number of frames of a clip, after it is resampled to the data set's frame rate."""
    if dataset.is_generated(clip):
        return dataset.frames(clip)
    seconds = bvh_seconds(Path(dataset.source(clip)))
    return ASSUMED_FRAMES if seconds is None else seconds * dataset.settings.motion.fps


def bvh_seconds(path: Path) -> float | None:
    """Estimated length of a BVH file in seconds: its frame time times its estimated number of frames.

    This number is the bytes of all frames divided by the bytes of the first frame. The number in the header
    is not used, because it may be wrong. None if the length cannot be estimated.
    """
    try:
        with open(path, "rb") as file:
            start = file.read(HEADER_BYTES)
        found = re.search(rb"Frame Time:[ \t]*([0-9.eE+-]+)\s*\n([^\n]+\n)", start)
        if found is None:
            return None
        frame_time = min(float(found[1]), 1.0)  # a larger one must be a mistake
        return frame_time * (os.path.getsize(path) - found.start(2)) / len(found[2]) or None
    except (OSError, ValueError):
        return None


# How long trainings take, for the plan that a user sees before the first job.

# Seconds of a step of training for each parameter of a network, and for each sample and parameter, on two
# quiet cores of an AMD EPYC 9005: 10,200 samples a second at a batch of 32, 35,600 at 256, 2.4 million
# parameters (docs/training.md).
STEP_SECONDS, SAMPLE_SECONDS = 1.07e-9, 7.6e-12
# Two quiet cores of a Zen 4 machine took 2.7 times as long, and two cores of a Zen 3 machine, which lacks
# AVX-512, 11 times as long at a batch of 256 beside some tests.
SLOWEST = 11.0
FAST = "fast"  # the configuration with the recipe that is named if it is much faster
LONG_SECONDS = 300.0  # for a training that takes longer than this


def sentences_about_plan(project: Project, jobs: Sequence[tuple[str, Mapping[str, str]]]) -> list[str]:
    """How long the trainings of a plan take, a sentence each, with a faster recipe for a long one.

    jobs: rule and wildcards of each job.
    """
    names = [wildcards["configuration"] for rule, wildcards in jobs if rule == "training"]
    if not names:
        return []
    sentences = []
    fast = FAST in project.catalogue.names() and project.catalogue.configuration(FAST).training
    for configuration in map(project.configuration, names):
        training = configuration.settings.training
        if gpus(configuration) or not parameter_count(configuration):
            continue
        seconds = expected_seconds(configuration, training) / training.count
        faster = expected_seconds(configuration, fast) / training.count if fast else seconds
        hint = f"; with --config training={FAST} {_range(faster)} (docs/training.md)"
        is_slow = seconds * SLOWEST > LONG_SECONDS and faster < seconds / 2
        sentences.append(f"training {configuration.name}: {_range(seconds)}{hint if is_slow else ''}.")
    return sentences


def expected_seconds(configuration: NamedConfiguration, training: Recipe) -> float:
    """Seconds of a training with this recipe on the machine of STEP_SECONDS."""
    dataset = configuration.dataset
    frames = sum(
        _frames(dataset, original(clip)) / dataset.row_step(clip)
        for clip, split in configuration.splits.items()
        if split == "train"
    )
    steps = frames * VISITS_PER_PASS * training.passes / training.batch
    return steps * (STEP_SECONDS + SAMPLE_SECONDS * training.batch) * parameter_count(configuration)


def _range(seconds: float) -> str:
    """A time as text, from the fastest to the slowest known machine."""
    fastest, slowest = (max(1, round(each / 60)) for each in (seconds, seconds * SLOWEST))
    return f"{fastest} min" if fastest == slowest else f"{fastest} to {slowest} min on two quiet cores"
