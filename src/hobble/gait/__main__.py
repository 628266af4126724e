"""The command that recognises a limp and measures its effects.

python -m hobble.gait CLIP.bvh --healthy HEALTHY.bvh
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from hobble.core.errors import HobbleError, InputError
from hobble.gait.comparison import WalkComparison, compare_clip, healthy_profile, measure_clip
from hobble.gait.effect_sizes import EFFECTS, effects_of_people
from hobble.gait.people import GAITS, SOURCE, read_people
from hobble.gait.profile import NO_CYCLE, Profile
from hobble.gait.read_clip import SKELETONS, read_clip
from hobble.gait.recogniser import RIGHT

FIX_NO_CYCLE = "Choose a clip with at least three steps straight ahead."
NO_HEALTHY = (
    "No healthy walk was given, so the clips were compared with the mean of ten healthy people. "
    "An unusual build can then look like a limp. Name healthy walks of the same person after --healthy."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns the exit status: 0, or 1 after an error."""
    parser = argparse.ArgumentParser(
        prog="python -m hobble.gait",
        description="Recognises the limp of a walk and measures how it differs from a healthy walk.",
    )
    parser.add_argument(
        "clips", nargs="+", metavar="CLIP.bvh", help="clips of walks to recognise and measure"
    )
    parser.add_argument(
        "--healthy",
        nargs="+",
        default=[],
        metavar="CLIP.bvh",
        help="clips of healthy walks of the same person",
    )
    parser.add_argument(
        "--side",
        choices=("right", "left"),
        help="the hurt side; default: the side that is recognised, else right",
    )
    parser.add_argument(
        "--window",
        type=_seconds,
        default=4.0,
        help="length of a window in seconds. The whole clip is recognised, and also each window on its own",
    )
    parser.add_argument("--skeletons", default=SKELETONS, help="folder of the skeleton files")
    options = parser.parse_args(arguments)
    try:
        healthy = _healthy_profile(options.healthy, options.skeletons)
        for path in options.clips:
            print(describe(Path(path).stem, _compare_clip(path, options, healthy), options.side))
        if not options.healthy:
            print(NO_HEALTHY)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _seconds(text: str) -> float:
    """The value of --window as a number of seconds from 1 to 3600."""
    with contextlib.suppress(ValueError):
        if 1.0 <= float(text) <= 3600.0:
            return float(text)
    raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 1 to 3600")


def _healthy_profile(paths: Sequence[str], skeletons: str) -> Profile:
    """The profile of the healthy clips, or of healthy people if there are no clips."""
    clips = [read_clip(path, skeletons) for path in paths]
    for path, clip in zip(paths, clips, strict=True):
        if not len(measure_clip(clip)):
            raise InputError(path, NO_CYCLE, fix=FIX_NO_CYCLE)
    return healthy_profile(clips)


def _compare_clip(path: str, options: argparse.Namespace, healthy: Profile) -> WalkComparison:
    """Compare a clip with the profile of a healthy walk."""
    clip = read_clip(path, options.skeletons)
    if not len(measure_clip(clip)):
        raise InputError(path, NO_CYCLE, fix=FIX_NO_CYCLE)
    return compare_clip(clip, healthy, options.window)


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """What both recognisers say of a clip, and the effects of its limp next to those of limps of people.

    name: the name of the clip. side: the side that counts as hurt; None for the recognised side, or
    the right one if no side is recognised.
    """
    answer, grade = compared.answer, compared.grade
    side = side or answer.side or grade.side or RIGHT
    likely = ", ".join(f"{gait} {answer.probabilities[gait]:.2f}" for gait in GAITS)
    lines = [
        f"{name}: {answer.label} {answer.side or ''} ({len(compared.walk)} cycles)",
        f"  probabilities: {likely}",
        f"  share of the {len(compared.window_answers)} windows with each answer: "
        f"{_list_shares(compared.answer_shares())}",
        f"  graded recogniser, also for mild limps: {grade.label} {grade.side or ''}, "
        f"strength {grade.strength:.2f} (mean of people with this limp: 1), "
        f"{grade.distance:.1f} standard deviations from the likeliest known walk",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}",
        "  share of the windows with each answer of the graded recogniser: "
        f"{_list_shares(compared.grade_shares())}",
        f"  effects if the {side} side is hurt. "
        f"The last columns show limps of people: mean ± standard deviation ({SOURCE})",
    ]
    return "\n".join([*lines, *_effect_lines(compared.effects[side])])


def _effect_lines(sizes: Mapping[str, float]) -> list[str]:
    """A table with a line for each effect. sizes: name of EFFECTS -> size of the effect in the clip."""
    of_people = effects_of_people(read_people())
    lines = [" " * 60 + "".join(f"{gait[:13]:>15}" for gait in of_people)]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*of_people[gait][key]) for gait in of_people)
        lines.append(f"  {key:14}{sizes[key]:8.2f}  {text[:36]:36}{columns}")
    return lines


def _list_shares(shares: Mapping[str, float]) -> str:
    """shares: an answer, such as "antalgic right" -> share of the windows with this answer."""
    return (
        ", ".join(f"{name} {share:.2f}" for name, share in shares.items())
        or "none, because no window has enough cycles"
    )


if __name__ == "__main__":
    sys.exit(main())
