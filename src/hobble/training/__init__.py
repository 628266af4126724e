"""The stage `training` of the workflow: trains a network on a database and writes its weights.

Importing this package sets two environment variables that libraries of PyTorch and numba read when they are
loaded. Values that are already set are kept.
"""

from __future__ import annotations

import math
import os
from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Positive, PositiveFloat, Section, Share

# Let waiting threads sleep soon. On a busy machine, spinning threads take the cores from the threads that
# they wait for. Samples a second at batch 32 on two cores, first alone on the machine, then beside six other
# processes: with OpenMP's default of 300,000 spins 13,000, then 600; without spinning 9,000, then 4,000; with
# 1,000 spins 12,500, then 4,200.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")
# Makes the matrix products of cuBLAS deterministic.
os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")


class Recipe(Section):
    """How a network is trained. A pass visits every (frame, terrain fit) pair once.

    Each pass is cut into `sections` sections. The order of the pairs is random, so even a few sections are
    a random sample of the data.
    """

    passes: Annotated[float, Field(gt=0, le=1_000_000)] = Field(
        20.0, description="passes over the data; with a fraction, the last one ends early"
    )
    sections: Positive = 10
    batch: Positive = Field(32, description="samples of a step, over all processes")
    learning_rate: PositiveFloat = 1e-4
    schedule: Literal["constant", "cosine"] = Field(
        "constant", description="course of the learning rate; cosine falls to 0 at the end of the last pass"
    )
    warm_up: Annotated[float, Field(ge=0)] = Field(
        0.0, description="passes during which the rate rises from 0"
    )
    beta1: Share = 0.9
    beta2: Share = 0.999
    dropout: Share = Field(0.3, description="share of units dropped before each layer, the input included")
    l1: Annotated[float, Field(ge=0)] = Field(
        0.01, description="factor of the mean absolute weights in the loss"
    )
    rollout: Positive = Field(
        1, description="frames for which input poses get the errors of earlier predictions; 1: none"
    )
    other_poses: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="share of the samples whose input pose is moved towards or away from that of a clip with "
        "other channel values",
    )
    version_poses: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="share of the samples of hurt versions whose input pose is moved towards or away from "
        "that of the healthy clip; a twentieth of this share of healthy samples moves towards a hurt version",
    )
    other_paces: Annotated[float, Field(ge=1, le=2)] = Field(
        1.0,
        description="samples are played slower or faster, at most by this factor, and their paths are "
        "smoothed; 1: neither",
    )
    keep_channels: bool = Field(False, description="dropout never drops the inputs of channels")
    symmetric: bool = Field(
        False, description="mirrored inputs give mirrored outputs; for data sets with `mirror: true`"
    )
    phase_weight: PositiveFloat = Field(
        1.0, description="factor of the error in the change of phase, before errors are squared"
    )
    scales: dict[str, PositiveFloat] = Field(
        {},
        description="for each channel, a number by which its inputs are divided in training and at run time, "
        "so that it counts less",
    )
    keep: Literal["last", "best"] = Field(
        "last",
        description="weights to write: those at the end, as in Holden et al. (2017), or those with the "
        "lowest held-out error after a section",
    )
    seed: int = 1
    memory_mb: Positive = Field(512, description="memory for the rows of the database, for each process")
    continues: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")] | None = Field(
        None, description="configuration from whose last checkpoint the training starts"
    )
    device: Literal["auto", "cpu", "cuda"] = "auto"
    precision: Literal["auto", "float32", "tf32", "bfloat16"] = Field(
        "auto",
        description="precision of the factors in matrix products; auto: bfloat16 for batches of 256 or more "
        "if it is fast on this machine, else tf32 on CUDA and float32 on a CPU",
    )
    stretches: Positive | None = Field(
        None,
        description="number of parts that a section is cut into; each batch takes samples from every part; "
        "default: the number of processes, so that each process reads its own part",
    )

    @model_validator(mode="after")
    def _check_recipe(self) -> Recipe:
        if self.continues and self.schedule != "constant":
            raise ValueError(
                "`continues` needs `schedule: constant`: other schedules end at a learning rate of 0"
            )
        if not math.isclose(self.passes * self.sections, self.all_sections, rel_tol=1e-9):
            raise ValueError(
                f"`passes` ({self.passes:g}) times `sections` ({self.sections}) must be a whole number: "
                "training can end only after a whole section"
            )
        return self

    def learning_rate_share(self, passes: float) -> float:
        """The factor by which `learning_rate` is multiplied after `passes` passes over the data.

        passes: may be a fraction. During the first `warm_up` passes the factor rises linearly from 0. If the
        schedule is `constant`, it then stays at 1. If the schedule is `cosine`, it is also multiplied by half
        a cosine wave, which falls from 1 at the start to 0 at the end of the last pass (Loshchilov and Hutter
        2017, without restarts).

        >>> recipe = Recipe(schedule="cosine", warm_up=0.5, passes=8)
        >>> [round(recipe.learning_rate_share(passes), 3) for passes in (0, 0.25, 2, 4, 8)]
        [0.0, 0.499, 0.854, 0.5, 0.0]
        """
        rise = min(1.0, passes / self.warm_up) if self.warm_up else 1.0
        if self.schedule == "constant":
            return rise
        return rise * (1 + math.cos(math.pi * min(1.0, passes / self.passes))) / 2

    @property
    def all_sections(self) -> int:
        """Number of sections of all passes, at least one."""
        return max(1, round(self.passes * self.sections))


class Machines(Section):
    """Where the training runs: on `nodes` machines, each with one process per GPU or `processes` on the CPU.

    This is not part of the recipe: a training can resume from its checkpoint with other values.
    """

    nodes: Annotated[int, Field(gt=0, le=10_000)] = 1
    gpus: Annotated[int, Field(ge=0, le=1_000)] = Field(
        0, description="GPUs of each node, one process for each; 0: train with `processes` on the CPU"
    )
    processes: Annotated[int, Field(gt=0, le=1_000)] = Field(
        1, description="processes on each node if `gpus` is 0"
    )

    @property
    def processes_per_node(self) -> int:
        """Number of processes on each node."""
        return self.gpus or self.processes

    @property
    def count(self) -> int:
        """Number of processes on all nodes together."""
        return self.nodes * self.processes_per_node


class Training(Machines, Recipe):
    """All keys of the section `training`. The defaults are those of Holden et al. (2017), on one machine."""

    @model_validator(mode="after")
    def _check_processes(self) -> Training:
        if self.gpus and (self.processes > 1 or self.device == "cpu"):
            raise ValueError("`gpus` has one process for each GPU. Set no `processes`, and no `device: cpu`")
        stretches = self.stretches or self.count
        if stretches % self.count:
            raise ValueError(
                f"`stretches` ({stretches}) must be a multiple of the {self.count} processes: each process "
                "reads whole stretches"
            )
        if stretches > self.batch:
            raise ValueError(
                f"`batch` ({self.batch}) must have at least one sample for each of {stretches} processes or "
                "stretches"
            )
        return self
