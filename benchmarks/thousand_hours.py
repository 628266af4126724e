"""Estimate jobs, bytes and hours of each stage for more motion, from the rates of one or two finished runs.

    benchmarks/thousand_hours.py [FOLDER] [--configuration holden] [--against NAME] [--hours 1000]
        [--clips 2500] [--nodes 80] [--training-nodes 1] [--batch 0] [--passes 0] [--processor]

FOLDER is the folder in which Snakemake ran. From one run, seconds and bytes of jobs over clips are scaled
with the amount of motion that the configuration uses; all else is unchanged. --against: a run with less
motion. It prints the growth of each stage from one to the other, as ratios. Then a rule's seconds are a fixed
part and a part that grows with the motion, from both runs.

--processor: take the processor seconds of a run that shared its machine with other work.

Mirrored clips count as motion: with them, the hours double. Under `synthetic` the bytes are those of the BVH
files, which are the user's own. --training-nodes: machines that train together; each step also takes a ring
all-reduce of the gradient over 10 Gb/s. --batch and --passes: samples of a step and passes, if they differ
from the run's. Measurements of clips read at most `evaluation.sample_frames`.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from hobble.measures.measure import SampleOptions, all_measures
from hobble.workflow.datasets import batch_count
from hobble.workflow.project import BATCH_RULES

ROOT = Path(__file__).resolve().parents[1]
OF_BATCHES = {"synthetic_clips"} | {rule for rules in BATCH_RULES.values() for rule in rules}
# Rules whose work grows with the motion, as far as one run can tell.
GROWING = {*OF_BATCHES, "database_shard", "database_merge", "training", "recognition"}
SAMPLED = {one.name for one in all_measures() if "sample_frames" in one.options.model_fields}
FPS = 60
LINK, DELAY = 1.25e9, 30e-6  # bytes and seconds of a message between machines
THREADS = 2  # of the training
CONSTANT_BYTES = {"training", "runtime", "evaluation"}


class Run:
    """A finished run of a configuration. motion: seconds of motion in its database.

    key: what counts as time, "seconds" on the clock or "cpu_seconds".
    """

    def __init__(self, folder: Path, name: str, key: str) -> None:
        self.key = key
        self.home = folder / "results" / name
        self.resolved = yaml.safe_load((self.home / "configuration.yaml").read_text())
        pipeline = json.loads((self.home / "pipeline.json").read_text())
        self.stages = {stage["stage"]: stage for stage in pipeline["stages"]}
        dataset = folder / "results/datasets" / self.resolved["dataset"]["name"]
        channels = "+".join(self.resolved["configuration"]["channels"]) or "plain"
        manifest = json.loads((dataset / "database" / channels / "manifest.json").read_text())
        reports = [dataset / "motion" / f"{clip['clip']}.json" for clip in manifest["clips"]]
        self.motion = sum(json.loads(report.read_text())["seconds"] for report in reports)

    def read(self, rule: str) -> float:
        """Seconds of motion that the jobs of a rule read."""
        sample = self.resolved["configuration"]["evaluation"]["sample_frames"] / FPS
        return min(self.motion, sample) if rule in SAMPLED else self.motion

    def seconds(self, stage: str) -> dict[str, float]:
        """Rule -> seconds of all its jobs."""
        return {rule["rule"]: rule[self.key] for rule in self.stages[stage]["rules"]}


@dataclass(frozen=True)
class Rate:
    """Seconds of a rule: a fixed part, and one for each second of motion."""

    fixed: float
    each: float

    @classmethod
    def of(cls, rule: str, stage: str, run: Run, less: Run | None) -> Rate:
        """From a run, and from one with less motion if there is one."""
        seconds = run.seconds(stage)[rule]
        if less is None or rule not in less.seconds(stage) or run.read(rule) == less.read(rule):
            grows = rule in GROWING | SAMPLED
            return cls(0.0, seconds / run.read(rule)) if grows else cls(seconds, 0.0)
        before = less.seconds(stage)[rule]
        each = max(0.0, (seconds - before) / (run.read(rule) - less.read(rule)))
        return cls(max(0.0, seconds - each * run.read(rule)), each)

    def hours(self, motion: float) -> float:
        """Hours for so many seconds of motion."""
        return (self.fixed + self.each * motion) / 3600


@dataclass(frozen=True)
class Plan:
    """motion: seconds in all. clips, nodes: their numbers. training: hours on the clock.

    share: the passes of the training, divided by those of the run.
    """

    motion: float
    clips: int
    nodes: int
    training: float
    share: float

    def line(self, stage: str, run: Run, less: Run | None) -> dict[str, float]:
        """One line of the table: jobs, hours of processors, hours on the clock, longest job, bytes.

        The jobs of a rule go side by side over the nodes, two on each, and the rules one after another.
        """
        line = {"jobs": 0.0, "work": 0.0, "clock": 0.0, "longest": 0.0, "bytes": run.stages[stage]["bytes"]}
        for rule in run.seconds(stage):
            jobs = batch_count(self.clips) if rule in OF_BATCHES else 1
            most = SampleOptions().sample_frames / FPS if rule in SAMPLED else self.motion
            hours = Rate.of(rule, stage, run, less).hours(min(most, self.motion))
            hours *= self.share if rule == "training" else 1.0
            one = self.training if rule == "training" else hours / jobs
            line["jobs"] += jobs
            line["work"] += hours
            line["clock"] += one * math.ceil(jobs / (2 * self.nodes))
            line["longest"] = max(line["longest"], one)
        if stage not in CONSTANT_BYTES:
            line["bytes"] *= self.motion / run.motion
        return line


def pass_share(run: Run, options: argparse.Namespace) -> float:
    """The passes asked for, divided by those of the run."""
    passes: float = run.resolved["configuration"]["training"]["passes"]
    return options.passes / passes if options.passes else 1.0


def training_hours(run: Run, less: Run | None, options: argparse.Namespace) -> float:
    """Hours of training on the clock, with nodes as fast as the run's machine."""
    recipe = run.resolved["configuration"]["training"]
    motion = 3600 * options.hours
    history = (run.home / "network/history.csv").read_text()
    samples = int(history.splitlines()[-1].split(",")[2]) * motion / run.motion
    share = pass_share(run, options)
    nodes, steps = options.training_nodes, samples * share / (options.batch or recipe["batch"])
    with np.load(run.home / "network/checkpoint.npz") as checkpoint:
        sent = 4 * checkpoint["weights"].size
    ring = 2 * (nodes - 1) * (sent / nodes / LINK + DELAY)
    alone = Rate.of("training", "training", run, less).hours(motion) * share
    alone /= THREADS if run.key == "cpu_seconds" else 1
    return alone / nodes + steps * ring / 3600


def show_growth(run: Run, less: Run) -> None:
    """Print seconds, memory and bytes of each stage of both runs, and their ratios."""
    times, hours = run.motion / less.motion, run.motion / 3600
    print(f"{hours:.1f} hours of motion, {times:.2f} times as much as in the other run\n")
    print("| stage | s | s | ratio | peak MB of a job | peak MB | ratio | GB | GB | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, stage in run.stages.items():
        cells = []
        for key, unit, form in ((run.key, 1, ",.0f"), ("max_rss_mb", 1, ",.0f"), ("bytes", 1e9, ",.2f")):
            before, now = (one[key] / unit for one in (less.stages[name], stage))
            cells += [f"{before:{form}}", f"{now:{form}}", f"{now / before:.2f}" if before else ""]
        print(f"| {name} | {' | '.join(cells)} |")
    print()


def arguments() -> argparse.Namespace:
    """The arguments of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", default=".", type=Path)
    parser.add_argument("--configuration", default="holden")
    parser.add_argument("--against", help="configuration of a run with less motion")
    parser.add_argument("--hours", type=float, default=1000.0, help="of motion")
    parser.add_argument("--clips", type=int, default=2500)
    parser.add_argument("--nodes", type=int, default=80, help="that run two jobs at once each")
    parser.add_argument("--training-nodes", type=int, default=1)
    parser.add_argument("--batch", type=int, default=0, help="samples of a step; 0: that of the run")
    parser.add_argument("--processor", action="store_true", help="count processor seconds, not the clock's")
    parser.add_argument("--passes", type=float, default=0.0, help="0: those of the run")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    key = "cpu_seconds" if options.processor else "seconds"
    run = Run(options.folder, options.configuration, key)
    less = Run(options.folder, options.against, key) if options.against else None
    if less is not None:
        if less.motion >= run.motion:
            raise SystemExit("--against needs a run with less motion")
        show_growth(run, less)
    print(f"from {run.motion:.0f} s of motion of `{options.configuration}` to {options.hours:g} hours\n")
    print("| stage | jobs | hours of work | on the clock | longest job | GB |")
    print("|---|---|---|---|---|---|")
    training = training_hours(run, less, options)
    share = pass_share(run, options)
    plan = Plan(3600 * options.hours, options.clips, options.nodes, training, share)
    lines = {stage: plan.line(stage, run, less) for stage in run.stages}
    for stage, line in lines.items():
        show(stage, line)
    total = {key: sum(line[key] for line in lines.values()) for key in next(iter(lines.values()))}
    show("all", {**total, "longest": max(line["longest"] for line in lines.values())})
    print(f"\n{options.clips} clips in {batch_count(options.clips)} batches")


def show(name: str, line: dict[str, float]) -> None:
    """Print one line of the table."""
    hours = " | ".join(f"{line[key]:,.1f}" for key in ("work", "clock", "longest"))
    print(f"| {name} | {line['jobs']:.0f} | {hours} | {line['bytes'] / 1e9:,.1f} |")


if __name__ == "__main__":
    main()
