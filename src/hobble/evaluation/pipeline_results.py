"""The types of pipeline.json. The report and the comparison read this file."""

from __future__ import annotations

from typing import TypedDict

from hobble.database.sizes import Sizes


class JobTotal(TypedDict):
    """Totals over some jobs of the workflow.

    jobs: number of jobs. seconds, cpu_seconds: sums over the jobs. longest: seconds of the longest job.
    max_rss_mb: memory of the job that used most, MB; None if not measured.
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
    """All jobs of a stage of the workflow, and number and total size of the files that they wrote."""

    stage: str
    files: int
    bytes: int
    rules: list[RuleTotal]


class Machine(TypedDict):
    """The machine on which pipeline.json was written."""

    system: str
    processor: str
    cores: int | None
    memory_gb: float | None


class Pipeline(TypedDict):
    """The content of pipeline.json.

    database: None without a database. missing: files of the stages that do not exist. versions: of packages.
    """

    configuration: str
    stages: list[StageTotal]
    total_seconds: float
    total_bytes: int
    database: Sizes | None
    missing: list[str]
    machine: Machine
    versions: dict[str, str]
