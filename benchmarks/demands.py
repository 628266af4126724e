"""What each rule asks of a cluster, beside what its jobs took in a finished run; status 1 where that is more.

    benchmarks/demands.py [FOLDER] [TARGET ...] [-- what else snakemake was given, as --config mocap=...]

FOLDER is that in which Snakemake ran. Of each rule, for the job that came closest to what it asked for: the
memory it took, with that of Snakemake beside it, and its seconds. Both shares have to be below 1.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from hobble.workflow.asked import Job, measured, planned
from hobble.workflow.demands import ENGINE_MB

ROOT = Path(__file__).resolve().parents[1]


def plan(folder: Path, targets: list[str], more: list[str]) -> str:
    """What Snakemake would do to make everything again."""
    command = [sys.executable, "-m", "snakemake", "-s", str(ROOT / "Snakefile"), "-d", str(folder)]
    command += ["-np", "-F", *more, "--", *targets]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return done.stdout + done.stderr


def table(jobs: list[Job]) -> str:
    """A line for each rule."""
    by_rule = defaultdict(list)
    for job in jobs:
        by_rule[job.rule].append(job)
    lines = ["rule                jobs  took MB   asks  share   took s    asks  share"]
    for rule, those in by_rule.items():
        m, t = max(those, key=lambda job: job.memory), max(those, key=lambda job: job.time)
        lines.append(
            f"{rule:18}{len(those):6}{(m.took_mb or 0) + ENGINE_MB:9.0f}{m.asked_mb:7}{m.memory:7.2f}"
            f"{t.took_s or 0:9.1f}{t.asked_s:8}{t.time:7.2f}"
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
    jobs = list(measured(planned(plan(options.folder, options.targets, more)), options.folder))
    if not any(job.took_mb for job in jobs):
        sys.exit(f"{options.folder}: no run whose logs say what its jobs took")
    print(table(jobs))
    short = [job for job in jobs if max(job.memory, job.time) >= 1]
    for job in short:
        print(f"asks too little: {job.log}: {job.memory:.2f} of its memory, {job.time:.2f} of its time")
    sys.exit(bool(short))


if __name__ == "__main__":
    main()
