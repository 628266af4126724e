"""The parts of pipeline.json, which the report and the comparison read."""

from __future__ import annotations

from typing import TypedDict

from hobble.database.sizes import Sizes


class JobTotal(TypedDict):
    """Jobs together. seconds: the sum over them. longest: of one job. max_rss_mb: None if not measured."""

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
    """pipeline.json. missing: files that were not there. database: None if there is none."""

    configuration: str
    stages: list[StageTotal]
    total_seconds: float
    total_bytes: int
    database: Sizes | None
    missing: list[str]
    machine: Machine
    versions: dict[str, str]
