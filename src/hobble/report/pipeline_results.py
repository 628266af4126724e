"""The types of pipeline.json: time and disk space of each stage. The report and the comparison read it."""

from __future__ import annotations

from typing import TypedDict

from hobble.database.sizes import Sizes


class JobTotal(TypedDict):
    """Totals over some jobs of the workflow.

    jobs: number of jobs. seconds, cpu_seconds: sums over the jobs. longest: seconds of the longest job.
    max_rss_mb: memory (MB) of the job that used the most memory; None if not measured.
    """

    jobs: int
    seconds: float
    longest: float
    cpu_seconds: float
    max_rss_mb: float | None


class RuleTotal(JobTotal):
    """Totals over all jobs of one Snakemake rule."""

    rule: str


class StageTotal(JobTotal):
    """Totals over all jobs of a stage (a group of rules), and number and size of the files they wrote."""

    stage: str
    files: int
    bytes: int
    rules: list[RuleTotal]


class Machine(TypedDict):
    """The machine on which pipeline.json was written. An unknown number is None."""

    system: str
    processor: str
    cores: int | None
    memory_gb: float | None


class Pipeline(TypedDict):
    """The content of pipeline.json.

    configuration: name of the configuration. total_bytes: size of all files of the stages. database: None
    without a database. missing: paths of benchmarks and of files that should exist but do not. versions: name
    of a package -> its version.
    """

    configuration: str
    stages: list[StageTotal]
    total_seconds: float
    total_bytes: int
    database: Sizes | None
    missing: list[str]
    machine: Machine
    versions: dict[str, str]
