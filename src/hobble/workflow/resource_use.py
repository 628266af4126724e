"""Compares the memory and time that rules request with what their jobs used.

The requests are read from the text that a dry run prints. What the jobs used is read from the logs and the
benchmark files of a finished run.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hobble.report.provenance import read_benchmark
from hobble.workflow.clip_batches import family_of
from hobble.workflow.resource_demands import ENGINE_MB

# A job in the text of a dry run: the line with its rule, then indented lines `key: value`.
JOB_BLOCK = re.compile(r"^ *(?:local)?rule ([^\n]+):\n((?: +\w+: .*\n)+)", re.M)
MEMORY_LINE = re.compile(r"took (\d+) MB of memory at most")  # at the end of a job's log


@dataclass(frozen=True)
class JobResources:
    """What one job requests and, if it has run, what it used.

    rule: the rule's name without data set and batch number. log: path of the job's log, relative to the
    folder of the run. requested_mb, used_mb: memory in MB; the used memory does not include that of Snakemake
    itself. requested_s, used_s: time in seconds. used_mb or used_s is None if the run has no record of it.
    """

    rule: str
    log: str
    requested_mb: int
    requested_s: int
    used_mb: float | None = None
    used_s: float | None = None

    @property
    def memory_share(self) -> float:
        """Used memory, including that of Snakemake itself, divided by the requested memory."""
        return ((self.used_mb or 0) + ENGINE_MB) / self.requested_mb

    @property
    def time_share(self) -> float:
        """Used time divided by the requested time."""
        return (self.used_s or 0) / self.requested_s


def planned_jobs(plan: str) -> Iterator[JobResources]:
    """The jobs in the text of a dry run, with their requests.

    plan: this text. Raises KeyError for a job that requests no memory or no time.
    """
    for rule, block in JOB_BLOCK.findall(plan):
        values = dict(line.strip().split(": ", 1) for line in block.splitlines())
        requests = dict(part.split("=", 1) for part in values["resources"].split(", "))
        yield JobResources(
            family_of(rule), values["log"], int(requests["mem_mb"]), 60 * int(requests["runtime"])
        )


def with_measured_use(jobs: Iterator[JobResources], run: Path) -> Iterator[JobResources]:
    """The same jobs, with what they used. Jobs that have no log, because they did not run, are left out.

    run: the folder in which Snakemake ran.
    """
    for job in jobs:
        log = run / job.log
        benchmark = run / job.log.replace("/logs/", "/benchmarks/", 1).removesuffix(".log")
        if log.is_file():
            peaks = MEMORY_LINE.findall(log.read_text(encoding="utf-8", errors="replace"))
            rows = read_benchmark(f"{benchmark}.tsv") if Path(f"{benchmark}.tsv").is_file() else []
            memory = float(peaks[-1]) if peaks else None
            yield JobResources(
                job.rule, job.log, job.requested_mb, job.requested_s, memory, rows[-1]["s"] if rows else None
            )
