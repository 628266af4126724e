"""Recognises a limp and measures its effects: python -m hobble.gait CLIP.bvh --healthy CLIP.bvh."""

from __future__ import annotations

import argparse
import contextlib
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

FIX_NO_CYCLE = "Name a clip that walks straight ahead for three steps or more."
NO_HEALTHY = (
    "No healthy walk was given, so the clips were compared with the mean of ten healthy people. "
    "A different build can then look like a limp. Name healthy walks of the same person after --healthy."
)


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
    parser.add_argument(
        "--window",
        type=_seconds,
        default=4.0,
        help="seconds; besides the whole clip, each window of this length is recognised on its own",
    )
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
    with contextlib.suppress(ValueError):
        if 1.0 <= float(text) <= 3600.0:
            return float(text)
    raise argparse.ArgumentTypeError(f"{text!r} should be a number of seconds from 1 to 3600")


def _healthy(paths: Sequence[str], skeletons: str) -> Profile:
    clips = [read_clip(path, skeletons) for path in paths]
    for path, clip in zip(paths, clips, strict=True):
        if not len(measure_clip(clip)):
            raise InputError(path, NO_CYCLE, fix=FIX_NO_CYCLE)
    return healthy_profile(clips)


def _compared(path: str, options: argparse.Namespace, healthy: Profile) -> WalkComparison:
    clip = read_clip(path, options.skeletons)
    if not len(measure_clip(clip)):
        raise InputError(path, NO_CYCLE, fix=FIX_NO_CYCLE)
    return compare(clip, healthy, options.window)


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """The recognisers' answers as text, and the effects of the limp next to the effects in people."""
    answer, grade = compared.answer, compared.grade
    side = side or answer.side or grade.side or RIGHT
    likely = ", ".join(f"{gait} {answer.probabilities[gait]:.2f}" for gait in GAITS)
    lines = [
        f"{name}: {answer.label} {answer.side or ''} ({len(compared.walk)} cycles)",
        f"  probabilities: {likely}",
        f"  share of the {len(compared.windows)} windows with each answer: "
        f"{_listed(compared.answer_shares())}",
        f"  graded recogniser, also for mild limps: {grade.label} {grade.side or ''}, "
        f"strength {grade.strength:.2f} (mean of people: 1), "
        f"{grade.distance:.1f} standard deviations from the likeliest known walk",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}",
        "  share of the windows with each answer of the graded recogniser: "
        f"{_listed(compared.grade_shares())}",
        f"  effects if the {side} side is hurt. "
        f"At the right: mean ± standard deviation over people ({SOURCE})",
    ]
    return "\n".join([*lines, *_effects(compared.effects[side])])


def _effects(sizes: Mapping[str, float]) -> list[str]:
    of_people = effects_of_people(people())
    lines = [" " * 60 + "".join(f"{gait[:13]:>15}" for gait in of_people)]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*of_people[gait][key]) for gait in of_people)
        lines.append(f"  {key:14}{sizes[key]:8.2f}  {text[:36]:36}{columns}")
    return lines


def _listed(shares: Mapping[str, float]) -> str:
    return (
        ", ".join(f"{name} {share:.2f}" for name, share in shares.items())
        or "none, because no window has enough cycles"
    )


if __name__ == "__main__":
    sys.exit(main())
