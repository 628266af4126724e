"""Reading BVH and making clips: MB a second, compared with plain Python on the same file in the same run.

Run `python benchmarks/motion.py` for a file made here, `python benchmarks/motion.py FOLDER` for every BVH
file in a folder of yours, `python benchmarks/motion.py --megabytes 100` for a large one.
"""

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.processors import processor_name
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import load_skeleton

SKELETONS = Path(__file__).resolve().parents[1] / "config/skeletons"


def seconds(work: Callable[[], object]) -> float:
    """The better of two runs, processor time."""
    best = np.inf
    for _ in range(2):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def made(folder: Path, megabytes: float) -> Path:
    """A BVH file of about this many megabytes, of a figure that sways."""
    skeleton = load_skeleton(SKELETONS / "holden31.yaml").skeleton
    frames = 1000
    sway = 0.2 * np.sin(np.linspace(0, 30, frames)[:, None] + np.arange(31))
    rotations = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), sway)
    clip = Clip("sway", skeleton, 120.0, rotations, np.tile([0.0, 93.0, 0.0], (frames, 1)))
    path = folder / "sway.bvh"
    write_bvh(path, clip)
    head, _, rows = path.read_text().partition(f"Frames: {frames}\n")
    time_line, _, rows = rows.partition("\n")
    times = max(1, round(megabytes * 1e6 / len(rows)))
    path.write_text(f"{head}Frames: {frames * times}\n{time_line}\n" + rows * times)
    return path


def plain(path: Path) -> np.ndarray:
    """Read the file with a few lines of plain Python."""
    rows = path.read_text().split("Frame Time:")[1].splitlines()[1:]
    return np.array([[float(x) for x in row.split()] for row in rows])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--megabytes", type=float, default=4.0)
    arguments = parser.parse_args()
    print(processor_name())
    options = ClipMotion()
    with tempfile.TemporaryDirectory() as temporary:
        files = sorted(arguments.folder.rglob("*.bvh")) if arguments.folder else []
        files = files or [made(Path(temporary), arguments.megabytes)]
        size = sum(path.stat().st_size for path in files) / 1e6
        reading = seconds(lambda: [read_bvh(path) for path in files])
        print(f"{len(files)} files, {size:.1f} MB")
        print(f"read                  {size / reading:8.0f} MB/s")
        print(f"plain Python          {size / seconds(lambda: [plain(path) for path in files]):8.0f} MB/s")
        for name in ("holden31", "ava191"):
            target = SKELETONS / f"{name}.yaml"
            making = seconds(
                lambda target=target, name=name: [
                    make_clip(path, target, SKELETONS, path.stem, name, options) for path in files
                ]
            )
            rate = size / making
            print(f"make clips, {name:9s} {rate:8.0f} MB/s, {making / reading:.1f} times the reading")
    print(f"peak memory           {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:8.0f} MB")


if __name__ == "__main__":
    main()
