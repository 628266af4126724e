"""The parts of pipeline.json. The report and the comparison read this file."""

from __future__ import annotations

from typing import TypedDict

from hobble.database.sizes import Sizes


class JobTotal(TypedDict):
    """Some jobs together.

    seconds, cpu_seconds: sums over the jobs. longest: seconds of the longest job. max_rss_mb: most memory of
    a job, MB; None if not measured.
    """

    jobs: int
    seconds: float
    longest: float
    cpu_seconds: float
    max_rss_mb: float | None


class RuleTotal(JobTotal):
    """All jobs of a rule."""

    rule: str


class StageTotal(JobTotal):
    """All jobs of a stage, and the files that it wrote."""

    stage: str
    files: int
    bytes: int
    rules: list[RuleTotal]


class Machine(TypedDict):
    """The machine that wrote the file."""

    system: str
    processor: str
    cores: int | None
    memory_gb: float | None


class Pipeline(TypedDict):
    """pipeline.json. missing: files that do not exist. database: None if there is none."""

    configuration: str
    stages: list[StageTotal]
    total_seconds: float
    total_bytes: int
    database: Sizes | None
    missing: list[str]
    machine: Machine
    versions: dict[str, str]
