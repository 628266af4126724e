"""What rules ask of a cluster beside what their jobs took: from a plan, and a run's logs and benchmarks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hobble.report.pipeline import read_benchmark
from hobble.workflow.demands import ENGINE_MB

JOB = re.compile(r"^ *(?:local)?rule (\w+):\n((?: +\w+: .*\n)+)", re.M)
TOOK = re.compile(r"took (\d+) MB of memory at most")


@dataclass(frozen=True)
class Job:
    """One job: what its rule asks for and, where it has run, what it took.

    asked_mb, asked_s: memory, and time in seconds. took_mb: by its log, without Snakemake beside it; took_s:
    by its benchmark. None where the run did not say.
    """

    rule: str
    log: str
    asked_mb: int
    asked_s: int
    took_mb: float | None = None
    took_s: float | None = None

    @property
    def memory(self) -> float:
        """The share of the memory asked for that was used, Snakemake's own included."""
        return ((self.took_mb or 0) + ENGINE_MB) / self.asked_mb

    @property
    def time(self) -> float:
        """The share of the time asked for that was used."""
        return (self.took_s or 0) / self.asked_s


def planned(plan: str) -> Iterator[Job]:
    """The jobs in the text of a dry run; raises KeyError for one that does not state its memory and time."""
    for rule, block in JOB.findall(plan):
        of = dict(line.strip().split(": ", 1) for line in block.splitlines())
        asks = dict(part.split("=", 1) for part in of["resources"].split(", "))
        yield Job(rule, of["log"], int(asks["mem_mb"]), 60 * int(asks["runtime"]))


def measured(jobs: Iterator[Job], run: Path) -> Iterator[Job]:
    """The same jobs with what they took in the run of folder `run`, without those that have not run there."""
    for job in jobs:
        log = run / job.log
        benchmark = run / job.log.replace("/logs/", "/benchmarks/", 1).removesuffix(".log")
        if log.is_file():
            took = TOOK.findall(log.read_text(encoding="utf-8", errors="replace"))
            rows = read_benchmark(f"{benchmark}.tsv") if Path(f"{benchmark}.tsv").is_file() else []
            memory = float(took[-1]) if took else None
            yield Job(job.rule, job.log, job.asked_mb, job.asked_s, memory, rows[-1]["s"] if rows else None)
