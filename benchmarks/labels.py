"""Speed of labelling: frames a second, compared with real time, and the share of each part.

    python benchmarks/labels.py [FOLDER_OF_MOTION_NPZ]

Without a folder, one synthetic minute of a limping walk is labelled.
"""

import argparse
import tempfile
import time
from pathlib import Path

import yaml

from hobble.core.clip import Clip, load_clip
from hobble.core.processors import processor_name
from hobble.labels import LabelOptions
from hobble.labels.footfall import find_landings, find_stance_contacts, find_still_joints, find_swings
from hobble.labels.gait import automatic_gait
from hobble.labels.label import label_clip
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.synthetic.generate_clip import Synthetic, write_clip

ROOT = Path(__file__).resolve().parents[1]


def synthetic_minute() -> Clip:
    skeleton = ROOT / "config/skeletons/holden31.yaml"
    data = {"name": "holden31", **yaml.safe_load(skeleton.read_text())}
    with tempfile.TemporaryDirectory() as name:
        bvh, *others = (Path(name, f) for f in ("c.bvh", "c_footsteps.txt", "c_gait.txt", "c_injuries.txt"))
        keys = dict(zip(("footsteps", "gait", "status"), others, strict=True))
        options = Synthetic()
        write_clip("c", data, 3600, None, "RightUpLeg-RightLeg", options, bvh=bvh, **keys)
        options = ClipMotion()
        return make_clip(bvh, skeleton, skeleton.parent, clip="c", skeleton_name="holden31", options=options)[
            0
        ]


def best_of(count: int, work) -> float:
    times = []
    for _ in range(count):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder", nargs="?", type=Path, help="motion clips: results/datasets/<dataset>/motion"
    )
    folder = parser.parse_args().folder
    print(processor_name())
    clips = [load_clip(p) for p in sorted(folder.glob("*.npz"))] if folder else [synthetic_minute()]
    frames = sum(map(len, clips))
    kinematics = best_of(1, lambda: [clip.positions for clip in clips])
    parts = {
        "world positions, once": kinematics,
        "contacts": best_of(3, lambda: [find_still_joints(c) for c in clips]),
        "swings and landings": best_of(3, lambda: [find_landings(find_swings(c), len(c)) for c in clips]),
        "gait": best_of(3, lambda: [automatic_gait(c, find_stance_contacts(c), None) for c in clips]),
    }
    motion = {"source_frames": 0, "source_fps": 60.0}
    whole = best_of(3, lambda: [label_clip(c, [], motion, None, "flat", LabelOptions()) for c in clips])
    total = kinematics + whole
    print(f"{len(clips)} clips, {frames} frames: {frames / total:,.0f} frames/s")
    print(f"{frames / 60 / total:,.0f} times as fast as the motion itself")
    for name, seconds in parts.items():
        print(f"{seconds / total:6.1%} {name}")


if __name__ == "__main__":
    main()
