"""Estimate jobs, bytes and hours of each stage for more motion, from the rates of a finished run.

    benchmarks/thousand_hours.py [FOLDER] [--configuration holden] [--hours 1000] [--clips 2500] [--nodes 79]
        [--parts 1] [--training-nodes 1] [--batch 0] [--passes 0]

FOLDER is the folder in which Snakemake ran. Seconds and bytes of jobs over clips are scaled with the amount
of motion that the configuration uses; all else is unchanged. Each batch pays for the start of its jobs, so
longer clips take fewer hours than estimated. Mirrored clips count as motion: with them, the hours double.
Under `synthetic` the bytes are those of the BVH files, which are the user's own.

--parts: jobs that merge the database at the same time (`database.parts`). --training-nodes: machines that
train together; each step then also takes a ring all-reduce of the gradient at 10 Gb/s. --batch, --passes:
samples of a step and passes, if they differ from the run. Accuracy and roll-outs measure at most
`evaluation.sample_frames`.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.measures.sampling import Sampling
from hobble.workflow.batches import batch_count
from hobble.workflow.costs import BATCH_RULES

ROOT = Path(__file__).resolve().parents[1]
# Rules with one job whose work grows with the motion. The work of other single jobs stays the same.
GROWING = {"database_merge", "training", "recognition", "report"}
SAMPLED = {"accuracy", "rollouts"}  # whose work grows up to so many frames
FPS = 60
LINK, DELAY = 1.25e9, 30e-6  # bytes and seconds of a message between machines
CONSTANT_BYTES = {"training", "runtime", "evaluation"}


def motion_seconds(folder: Path, configuration: str) -> float:
    """Seconds of motion of the configuration's data set that were made."""
    resolved = yaml.safe_load((folder / f"results/{configuration}/configuration.yaml").read_text())
    reports = (folder / "results/datasets" / resolved["dataset"]["name"] / "motion").glob("*.json")
    accuracy = json.loads((folder / f"results/{configuration}/evaluation/accuracy.json").read_text())
    used = {clip["clip"] for clip in accuracy["clips"]}
    return sum(json.loads(p.read_text())["seconds"] for p in reports if p.stem in used)


@dataclass(frozen=True)
class Plan:
    """factor: how much more motion than in the run. clips, nodes, parts: as requested. sampled: how much more
    motion is measured. training: hours on the clock."""

    factor: float
    clips: int
    nodes: int
    parts: int
    sampled: float
    training: float

    def growth(self, rule: str, per_clip: set[str]) -> float:
        """How much more work a rule has."""
        if rule in SAMPLED:
            return self.sampled
        return self.factor if rule in per_clip or rule in GROWING else 1.0


def scaled(stage: dict[str, Any], plan: Plan) -> dict[str, float]:
    """One line of the table: jobs, hours of processors, hours on the clock, longest job, bytes.

    The batches of a stage run at the same time on the nodes; its other jobs run one after another.
    """
    per_clip = {rule for rules in BATCH_RULES.values() for rule in rules}
    batches = batch_count(plan.clips)
    line = {"jobs": 0, "work": 0.0, "clock": 0.0, "longest": 0.0, "bytes": stage["bytes"]}
    for rule in stage["rules"]:
        name = rule["rule"]
        hours = rule["seconds"] / 3600 * plan.growth(name, per_clip)
        line["work"] += hours
        if name in per_clip:
            line["jobs"] += batches
            line["clock"] += hours / min(2 * plan.nodes, batches)
            line["longest"] = max(line["longest"], hours / batches)
            continue
        # A merge in parts is two jobs for each part, one after the other, and one that joins them.
        jobs = 2 * plan.parts + 1 if name == "database_merge" and plan.parts > 1 else 1
        alone = plan.training if name == "training" else hours / plan.parts if jobs > 1 else hours
        line["jobs"] += jobs
        line["clock"] += alone * (math.ceil(plan.parts / plan.nodes) if jobs > 1 else 1)
        line["longest"] = max(line["longest"], alone)
    if stage["stage"] not in CONSTANT_BYTES:
        line["bytes"] *= plan.factor
    return line


def training_hours(
    folder: Path, stages: list[dict[str, Any]], factor: float, asked: argparse.Namespace
) -> float:
    """Hours on the clock with this many nodes, each as fast as the machine of the run."""
    resolved = yaml.safe_load((folder / f"results/{asked.configuration}/configuration.yaml").read_text())
    recipe = resolved["configuration"]["training"]
    history = folder / f"results/{asked.configuration}/network/history.csv"
    samples = int(history.read_text().splitlines()[-1].split(",")[2]) * factor
    rules = [rule for stage in stages for rule in stage["rules"] if rule["rule"] == "training"]
    seconds = sum(rule["seconds"] for rule in rules) * factor
    share = asked.passes / recipe["passes"] if asked.passes else 1.0
    nodes, steps = asked.training_nodes, samples * share / (asked.batch or recipe["batch"])
    with np.load(folder / f"results/{asked.configuration}/network/checkpoint.npz") as checkpoint:
        sent = 4 * checkpoint["weights"].size
    ring = 2 * (nodes - 1) * (sent / nodes / LINK + DELAY)
    return (seconds * share / nodes + steps * ring) / 3600


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", default=".", type=Path)
    parser.add_argument("--configuration", default="holden")
    parser.add_argument("--hours", type=float, default=1000.0, help="of motion")
    parser.add_argument("--clips", type=int, default=2500)
    parser.add_argument("--nodes", type=int, default=79, help="that run two jobs at once each")
    parser.add_argument("--parts", type=int, default=1, help="jobs that merge the database side by side")
    parser.add_argument("--training-nodes", type=int, default=1)
    parser.add_argument("--batch", type=int, default=0, help="samples of a step; 0: that of the run")
    parser.add_argument("--passes", type=int, default=0, help="0: those of the run")
    options = parser.parse_args()
    pipeline = json.loads((options.folder / f"results/{options.configuration}/pipeline.json").read_text())
    seconds = motion_seconds(options.folder, options.configuration)
    factor = options.hours * 3600 / seconds
    print(f"from {seconds:.0f} s of motion of `{options.configuration}` to {options.hours:g} hours\n")
    print("| stage | jobs | hours of work | on the clock | longest job | GB |")
    print("|---|---|---|---|---|---|")
    total = {"jobs": 0.0, "work": 0.0, "clock": 0.0, "longest": 0.0, "bytes": 0.0}
    sampled = min(factor, max(1.0, Sampling().sample_frames / (FPS * seconds)))
    hours = training_hours(options.folder, pipeline["stages"], factor, options)
    plan = Plan(factor, options.clips, options.nodes, options.parts, sampled, hours)
    for stage in pipeline["stages"]:
        line = scaled(stage, plan)
        longest = max(total["longest"], line["longest"])
        total = {key: total[key] + line[key] for key in total} | {"longest": longest}
        show(stage["stage"], line)
    show("all", total)
    print(f"\n{options.clips} clips in {batch_count(options.clips)} batches")


def show(name: str, line: dict[str, float]) -> None:
    """Print one line of the table."""
    hours = " | ".join(f"{line[key]:,.1f}" for key in ("work", "clock", "longest"))
    print(f"| {name} | {line['jobs']:.0f} | {hours} | {line['bytes'] / 1e9:,.1f} |")


if __name__ == "__main__":
    main()
