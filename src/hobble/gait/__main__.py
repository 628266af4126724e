"""Recognises a limp and measures its effects: python -m hobble.gait CLIP.bvh --healthy CLIP.bvh."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from hobble.core.errors import HobbleError, InputError
from hobble.gait.comparison import WalkComparison, compare, healthy_profile, measure_clip
from hobble.gait.effect_sizes import EFFECTS, effects_of_people
from hobble.gait.people import GAITS, SOURCE, people
from hobble.gait.profile import NO_CYCLE, Profile
from hobble.gait.read_clip import SKELETONS, read_clip
from hobble.gait.recogniser import RIGHT

NO_HEALTHY = "No healthy walk was given. Compared with the mean of people, a person's build counts, too."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hobble.gait",
        description="Recognises the limp of a walk and measures how it differs from a healthy walk.",
    )
    parser.add_argument("clips", nargs="+", metavar="CLIP.bvh", help="walks to measure")
    parser.add_argument(
        "--healthy", nargs="+", default=[], metavar="CLIP.bvh", help="healthy walks of the same person"
    )
    parser.add_argument("--side", choices=("right", "left"), help="the hurt side; by default as recognised")
    parser.add_argument("--window", type=_seconds, default=4.0, help="length of a window, seconds")
    parser.add_argument("--skeletons", default=SKELETONS, help="folder of the skeleton files")
    options = parser.parse_args(arguments)
    try:
        healthy = _healthy(options.healthy, options.skeletons)
        for path in options.clips:
            print(describe(Path(path).stem, _compared(path, options, healthy), options.side))
        if not options.healthy:
            print(NO_HEALTHY)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _seconds(text: str) -> float:
    """A window's length from the command line, 1 to 3600 seconds."""
    seconds = float(text)
    if not 1.0 <= seconds <= 3600.0:
        raise ValueError
    return seconds


def _healthy(paths: Sequence[str], skeletons: str) -> Profile:
    clips = [read_clip(path, skeletons) for path in paths]
    for path, clip in zip(paths, clips, strict=True):
        if not len(measure_clip(clip)):
            raise InputError(
                path, NO_CYCLE, fix="Name a clip that walks straight ahead for three steps or more."
            )
    return healthy_profile(clips)


def _compared(path: str, options: argparse.Namespace, healthy: Profile) -> WalkComparison:
    clip = read_clip(path, options.skeletons)
    if not len(measure_clip(clip)):
        raise InputError(path, NO_CYCLE)
    return compare(clip, healthy, options.window)


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """The recognisers' answers as text, and the effects next to those of people."""
    answer, grade = compared.answer, compared.grade
    side = side or answer.side or grade.side or RIGHT
    likely = ", ".join(f"{gait} {answer.probabilities[gait]:.2f}" for gait in GAITS)
    lines = [
        f"{name}: {answer.label} {answer.side or ''} ({len(compared.walk)} cycles)",
        f"  probabilities: {likely}",
        f"  windows: {len(compared.windows)}, called {_listed(compared.named())}",
        f"  mild limps too: {grade.label} {grade.side or ''}, {grade.strength:.2f} of what people showed, "
        f"{grade.distance:.1f} standard deviations from it",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}; "
        f"windows called {_listed(compared.graded())}",
        f"  effects, hurt side {side}, beside people ({SOURCE}; mean, spread over people)",
    ]
    return "\n".join([*lines, *_effects(compared.effects[side])])


def _effects(sizes: Mapping[str, float]) -> list[str]:
    known = effects_of_people(people())
    lines = [" " * 60 + "".join(f"{gait[:13]:>15}" for gait in known)]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*known[gait][key]) for gait in known)
        lines.append(f"  {key:14}{sizes[key]:8.2f}  {text[:36]:36}{columns}")
    return lines


def _listed(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.2f}" for name, share in shares.items()) or "nothing: too few cycles"


if __name__ == "__main__":
    sys.exit(main())
