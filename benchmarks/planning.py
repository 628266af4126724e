"""Snakemake's planning for many clips: processor seconds and rule jobs of a dry run.

Run `python benchmarks/planning.py --clips 2500 --mirror`. It makes a data set of small BVH files beside a
temporary copy of the rules and plans `results/many/report.html`, from nothing.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from hobble.core.processors import processor_name

ROOT = Path(__file__).resolve().parents[1]
FRAMES = 5


def rules_copy(folder: Path) -> Path:
    """A copy of the rules and configurations, with the package linked."""
    checkout = folder / "checkout"
    checkout.mkdir()
    shutil.copy2(ROOT / "Snakefile", checkout)
    for part in ("config", "profiles", "workflow"):
        shutil.copytree(ROOT / part, checkout / part)
    (checkout / "src").symlink_to(ROOT / "src")
    return checkout


def write_clips(folder: Path, count: int) -> None:
    """Write this many different BVH files with the joints of the skeleton holden31."""
    folder.mkdir()
    joints = yaml.safe_load((ROOT / "config/skeletons/holden31.yaml").read_text())["joints"]
    head = "HIERARCHY\n" + "".join(
        f"{'JOINT' if n else 'ROOT'} {name}\n{{\n" for n, name in enumerate(joints)
    )
    rows = np.random.default_rng(0).integers(0, 100, (count, 3 + 3 * len(joints)))
    for number in range(count):
        row = " ".join(map(str, rows[number])) + "\n"
        motion = f"MOTION\nFrames: {FRAMES}\nFrame Time: 0.0166667\n{row * FRAMES}"
        (folder / f"clip-{number:05}.bvh").write_text(head + motion)


def plan(checkout: Path, target: str, *options: str) -> tuple[float, float, str]:
    """Wall and processor seconds of a call of snakemake, and its output."""
    command = [sys.executable, "-m", "snakemake", *options, target, "--config", f"mocap={checkout.parent}"]
    path = os.pathsep.join([str(ROOT / "src"), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        command, cwd=checkout, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True
    )
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, used, done.stdout + done.stderr


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--clips", type=int, default=2500)
    parser.add_argument("--mirror", action="store_true")
    parser.add_argument("--hurt", action="store_true", help="with a hurt version of each clip")
    options = parser.parse_args()
    print(processor_name())
    with tempfile.TemporaryDirectory() as scratch:
        checkout = rules_copy(Path(scratch))
        write_clips(Path(scratch, "many"), options.clips)
        text = f"skeleton: holden31\nfolder: many\nmirror: {str(options.mirror).lower()}\n"
        text += "held_out: [clip-00000]\n" + "hurt: {}\n" * options.hurt
        (checkout / "config/datasets/many.yaml").write_text(text)
        (checkout / "config/many.yaml").write_text("extends: holden\ndataset: many\nchannels: [injury]\n")
        wall, used, said = plan(checkout, "results/many/report.html", "-n")
        jobs = next(line.split()[1] for line in said.splitlines() if line.startswith("total"))
    print(f"{options.clips} clips{', mirrored' * options.mirror}: {jobs} rule jobs")
    print(f"processor time {used:6.1f} s, wall {wall:6.1f} s, machine's load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
