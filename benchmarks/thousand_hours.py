"""What more motion would cost: jobs, bytes and hours for each stage, from the rates of a finished run.

    benchmarks/thousand_hours.py [FOLDER] [--configuration holden] [--hours 1000] [--clips 2500] [--nodes 79]

FOLDER is that in which Snakemake ran. Seconds and bytes of what goes over the clips grow with the motion that
the configuration uses, all else is taken as it was. Clips of a few seconds pay for the start of a job each:
longer ones take rather fewer hours. Mirrored clips are motion too: with them, twice the hours. Under
`synthetic` the bytes are those of the BVH files, which are the user's own.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[1]
# Rules of one job each whose work grows with the motion; the others of one job do always the same.
GROWING = {"database_merge", "training", "accuracy", "rollouts", "recognition", "report"}
CONSTANT_BYTES = {"training", "runtime", "evaluation"}


def groups() -> tuple[set[str], int]:
    """The rules that make one job of many clips, and of how many, as the SLURM profile says."""
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.v9+.yaml").read_text())
    size = int(profile["group-components"][0].split("=")[1])
    return {group.split("=")[0] for group in profile["groups"]}, size


def motion_seconds(folder: Path, configuration: str) -> float:
    """Seconds of motion of the configuration's data set that were made."""
    resolved = yaml.safe_load((folder / f"results/{configuration}/configuration.yaml").read_text())
    reports = (folder / "results/datasets" / resolved["dataset"]["name"] / "motion").glob("*.json")
    accuracy = json.loads((folder / f"results/{configuration}/evaluation/accuracy.json").read_text())
    used = {clip["clip"] for clip in accuracy["clips"]}
    return sum(json.loads(p.read_text())["seconds"] for p in reports if p.stem in used)


def scaled(stage: dict[str, Any], factor: float, clips: int, nodes: int) -> dict[str, float]:
    """One line of the table: jobs, hours of processors, hours on the clock with so many nodes, bytes.

    The clips of a stage go side by side over the nodes; the jobs of all its other rules go one after another.
    """
    per_clip, size = groups()
    line = {"jobs": 0, "work": 0.0, "clock": 0.0, "bytes": stage["bytes"]}
    for rule in stage["rules"]:
        grows = rule["rule"] in per_clip or rule["rule"] in GROWING
        hours = rule["seconds"] / 3600 * (factor if grows else 1)
        line["work"] += hours
        if rule["rule"] in per_clip:
            line["clock"] += hours / min(nodes, math.ceil(clips / size)) / 2
        else:
            line["jobs"] += 1
            line["clock"] += hours
    if stage["stage"] not in CONSTANT_BYTES:
        line["bytes"] *= factor
    return line


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", default=".", type=Path)
    parser.add_argument("--configuration", default="holden")
    parser.add_argument("--hours", type=float, default=1000.0, help="of motion")
    parser.add_argument("--clips", type=int, default=2500)
    parser.add_argument("--nodes", type=int, default=79, help="that take two jobs of a clip at once each")
    options = parser.parse_args()
    pipeline = json.loads((options.folder / f"results/{options.configuration}/pipeline.json").read_text())
    seconds = motion_seconds(options.folder, options.configuration)
    factor = options.hours * 3600 / seconds
    print(f"from {seconds:.0f} s of motion of `{options.configuration}` to {options.hours:g} hours\n")
    print(
        "| stage | jobs beside the batches | hours of work | hours on the clock | GB |\n|---|---|---|---|---|"
    )
    total = {"jobs": 0.0, "work": 0.0, "clock": 0.0, "bytes": 0.0}
    for stage in pipeline["stages"]:
        line = scaled(stage, factor, options.clips, options.nodes)
        total = {key: total[key] + line[key] for key in total}
        show(stage["stage"], line)
    show("all", total)
    batches = math.ceil(options.clips / groups()[1])
    print(f"\n{options.clips} clips: {batches} batches, {batches + total['jobs']:.0f} jobs with all others")


def show(name: str, line: dict[str, float]) -> None:
    """Print one line of the table."""
    numbers = f"{line['jobs']:.0f} | {line['work']:,.1f} | {line['clock']:,.1f} | {line['bytes'] / 1e9:,.1f}"
    print(f"| {name} | {numbers} |")


if __name__ == "__main__":
    main()
