"""Compare the memory and time that each rule requests with what its jobs used in a finished run.

    benchmarks/demands.py [FOLDER] [TARGET ...] [-- other arguments of the run, such as --config mocap=...]

FOLDER is the folder in which Snakemake ran. For each rule the table shows the job that came closest to its
request: its memory (with Snakemake's own) and its seconds. Exits with status 1 if a job used more than it
requested.
"""

import argparse
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hobble.report.provenance import read_benchmark
from hobble.workflow.demands import ENGINE_MB

ROOT = Path(__file__).resolve().parents[1]
# A job in the text of a dry run: the line with its rule, then indented lines `key: value`.
JOB_BLOCK = re.compile(r"^ *(?:local)?rule ([^\n]+):\n((?: +\w+: .*\n)+)", re.M)


@dataclass(frozen=True)
class JobResources:
    """What one job requests and, if it has run, what it used.

    log: path of the job's log, relative to the
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
        yield JobResources(rule, values["log"], int(requests["mem_mb"]), 60 * int(requests["runtime"]))


def with_measured_use(jobs: Iterator[JobResources], run: Path) -> Iterator[JobResources]:
    """The same jobs, with what they used. Jobs without a benchmark are left out.

    run: the folder in which Snakemake ran.
    """
    for job in jobs:
        benchmark = run / job.log.replace("/logs/", "/benchmarks/", 1).replace(".log", ".tsv")
        if benchmark.is_file():
            used = read_benchmark(benchmark).iloc[-1].dropna()
            yield JobResources(
                job.rule, job.log, job.requested_mb, job.requested_s, used.get("max_rss"), used["s"]
            )


def plan(folder: Path, targets: list[str], more: list[str]) -> str:
    """The text of a dry run that makes everything again."""
    command = [sys.executable, "-m", "snakemake", "-s", str(ROOT / "Snakefile"), "-d", str(folder)]
    command += ["-np", "-F", *more, "--", *targets]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return done.stdout + done.stderr


def table(jobs: list[JobResources]) -> str:
    """A line for each rule."""
    by_rule = defaultdict(list)
    for job in jobs:
        by_rule[job.rule].append(job)
    lines = ["rule                jobs  used MB   asks  share   used s    asks  share"]
    for rule, those in by_rule.items():
        m, t = max(those, key=lambda job: job.memory_share), max(those, key=lambda job: job.time_share)
        used_mb = (m.used_mb or 0) + ENGINE_MB
        lines.append(
            f"{rule:18}{len(those):6}{used_mb:9.0f}{m.requested_mb:7}{m.memory_share:7.2f}"
            f"{t.used_s or 0:9.1f}{t.requested_s:8}{t.time_share:7.2f}"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", default=".", type=Path)
    parser.add_argument("targets", nargs="*", default=["results/holden/report.html"])
    own, more = sys.argv[1:], []
    if "--" in own:
        own, more = own[: own.index("--")], own[own.index("--") + 1 :]
    options = parser.parse_args(own)
    jobs = list(with_measured_use(planned_jobs(plan(options.folder, options.targets, more)), options.folder))
    if not any(job.used_mb for job in jobs):
        sys.exit(f"{options.folder}: no run whose benchmarks say what its jobs took")
    print(table(jobs))
    short = [job for job in jobs if max(job.memory_share, job.time_share) >= 1]
    for job in short:
        memory, time = job.memory_share, job.time_share
        print(f"requests too little: {job.log}: used {memory:.2f} of its memory, {time:.2f} of its time")
    sys.exit(bool(short))


if __name__ == "__main__":
    main()
