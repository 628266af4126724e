"""What a walk is called, and how it differs: python -m hobble.gait CLIP.bvh --healthy CLIP.bvh."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hobble.config.sections import Motion
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError, InputError
from hobble.gait.compare import Comparison, compare, healthy_profile
from hobble.gait.effects import EFFECTS, effects_of_people
from hobble.gait.people import GAITS, NORMAL, SOURCE, people
from hobble.gait.recogniser import impaired_share
from hobble.motion.make import load_source, resample
from hobble.motion.read import read_bvh
from hobble.motion.rig import load_skeleton

SKELETONS = "config/skeletons"
NO_HEALTHY = "No healthy walk was given: beside the mean of people, a figure's own build and manner count as differences."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hobble.gait",
        description="What a walk is called, and how it differs from a healthy one.",
    )
    parser.add_argument("clips", nargs="+", metavar="CLIP.bvh", help="walks to measure")
    parser.add_argument(
        "--healthy", nargs="+", default=[], metavar="CLIP.bvh", help="healthy walks of the figure"
    )
    parser.add_argument("--side", choices=("right", "left"), help="the hurt side; by default as recognised")
    parser.add_argument("--window", type=float, default=4.0, help="seconds that are judged at once")
    parser.add_argument("--skeletons", default=SKELETONS, help="folder of the known rigs")
    options = parser.parse_args(arguments)
    try:
        healthy = healthy_profile([read_clip(path, options.skeletons) for path in options.healthy])
        for path in options.clips:
            print(describe(Path(path).stem, _compared(path, options, healthy), options.side))
        if not options.healthy:
            print(NO_HEALTHY)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _compared(path: str, options: argparse.Namespace, healthy: dict[str, float]) -> Comparison:
    clip = read_clip(path, options.skeletons)
    try:
        return compare(clip, healthy, options.window)
    except InputError:
        raise
    except HobbleError as error:
        raise InputError(path, str(error)) from None


def read_clip(path: str | Path, skeletons: str | Path = SKELETONS) -> Clip:
    """A BVH file on its own rig, which must be one of the known ones, at 60 Hz; raises InputError."""
    options = Motion().model_dump()
    target = load_skeleton(Path(skeletons) / "holden31.yaml")
    return resample(load_source(read_bvh(path), target, skeletons, options).clip, options["fps"])


def describe(name: str, seen: Comparison, side: str | None = None) -> str:
    """The answer, the effects beside those of people, as text."""
    answer = seen.answer
    side = side or seen.side
    called = f"{answer.label}, {answer.side}" if answer.side else answer.label
    likely = ", ".join(f"{gait} {answer.probabilities[gait]:.2f}" for gait in GAITS)
    named = ", ".join(f"{key} {share:.2f}" for key, share in seen.named().items()) or "none with two cycles"
    known = {gait: sizes for gait, sizes in effects_of_people(people()).items()}
    lines = [
        f"{name}: {called} ({len(seen.walk)} cycles)",
        f"  probabilities: {likely}",
        f"  windows: {len(seen.windows)}, impaired {impaired_share(seen.windows):.2f}: {named}",
        f"  effects, hurt side {side}, beside people ({SOURCE}; mean, spread over people)",
        " " * 60 + "".join(f"{gait[:13]:>15}" for gait in GAITS if gait != NORMAL),
    ]
    for key, text in EFFECTS.items():
        people_ = "".join(f"{known[gait][key][0]:9.2f} ±{known[gait][key][1]:4.2f}" for gait in known)
        lines.append(f"  {key:14}{seen.effects[side][key]:8.2f}  {text[:36]:36}{people_}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
