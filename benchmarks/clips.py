"""From BVH files to labelled clips through the workflow: wall time of `motion` and `labels` of a data set.

Run `python benchmarks/clips.py MOCAP`, where MOCAP is the folder that contains the data set's folder. The
default data set is `cmu`; `--dataset` chooses another. Results go to a temporary folder. The time includes
Snakemake itself: start, planning, and one process for each of two jobs a clip. For comparison, it prints how
fast one process reads the same files.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hobble.core.processors import processor_name
from hobble.motion.read import read_bvh
from hobble.workflow.project import Project

ROOT = Path(__file__).resolve().parents[1]


def workflow_seconds(targets: list[str], mocap: Path, cores: int) -> tuple[float, float]:
    """Wall and processor seconds that the workflow takes to make `targets`, from nothing."""
    with tempfile.TemporaryDirectory() as scratch:
        command = [sys.executable, "-m", "snakemake", "-s", str(ROOT / "Snakefile"), "-d", scratch]
        command += [f"-c{cores}", *targets, "--config", f"mocap={mocap}"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        start = time.perf_counter()
        done = subprocess.run(
            command, capture_output=True, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"}
        )
        wall = time.perf_counter() - start
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mocap", type=Path)
    parser.add_argument("--dataset", default="cmu")
    parser.add_argument("--cores", type=int, default=2)
    arguments = parser.parse_args()
    print(processor_name())
    mocap = arguments.mocap.resolve()
    project = Project(ROOT, {"mocap": str(mocap)})
    clips = sorted(project.dataset(arguments.dataset).listed)
    files = [Path(project.dataset(arguments.dataset).source(clip)) for clip in clips]
    size = sum(path.stat().st_size for path in files) / 1e6
    start = time.process_time()
    frames = sum(len(read_bvh(path)) for path in files)
    reading = time.process_time() - start
    targets = project.dataset(arguments.dataset).folders(clips, "labels")
    wall, busy = workflow_seconds(targets, mocap, arguments.cores)
    print(f"{len(files)} clips, {frames} frames, {size:.1f} MB")
    print(f"read                       {size / reading:8.0f} MB/s")
    print(f"motion and labels, wall    {wall:8.1f} s on {arguments.cores} cores")
    print(f"processor time             {busy:8.1f} s, {busy / (2 * len(clips)):.2f} s a job")
    print(f"machine's load             {os.getloadavg()[0]:8.1f}")


if __name__ == "__main__":
    main()
