"""Speed of the synthetic walker: seconds a clip, and the share of writing BVH text.

Run `python benchmarks/synthetic.py`.
"""

import tempfile
import time
from pathlib import Path

import yaml

from hobble.core.bvh import write_bvh
from hobble.core.processors import processor_name
from hobble.core.skeleton import Skeleton
from hobble.synthetic.generate_clip import generate_walk

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    print(processor_name())
    data = yaml.safe_load((ROOT / "config/skeletons/holden31.yaml").read_text())
    skeleton = Skeleton.from_dict({"name": "holden31", **data})
    frames = 1000
    print(f"{'recipe':15s} {'walk s':>7s} {'write s':>8s} {'x real time':>12s}")
    for recipe in ("walk-straight", "jog", "steps"):
        start = time.perf_counter()
        walk = generate_walk("benchmark", skeleton, frames, recipe, 120, 1)
        walked = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            write_bvh(Path(folder) / "benchmark.bvh", walk.clip)
        written = time.perf_counter()
        ratio = frames / 60 / (written - start)
        print(f"{recipe:15s} {walked - start:7.2f} {written - walked:8.2f} {ratio:12.0f}")


if __name__ == "__main__":
    main()
