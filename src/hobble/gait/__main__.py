"""The command that recognises a limp and measures its effects.

python -m hobble.gait CLIP.bvh --healthy HEALTHY.bvh
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError, InputError
from hobble.gait.cycles import measure_clip
from hobble.gait.profile import EFFECTS, GAITS, NO_CYCLE, RIGHT, SOURCE, effects_of_people, healthy_profile
from hobble.gait.recognise import WalkComparison, compare_clip, shares_of_answers
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import load_skeleton

SKELETONS = "config/skeletons"  # folder of the skeleton files
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
    add = parser.add_argument
    add("clips", nargs="+", metavar="CLIP.bvh", help="clips of walks to recognise and measure")
    add(
        "--healthy",
        nargs="+",
        default=[],
        metavar="CLIP.bvh",
        help="clips of healthy walks of the same person",
    )
    add(
        "--side",
        choices=("right", "left"),
        help="the hurt side; default: the side that is recognised, else right",
    )
    add(
        "--window",
        type=float,
        default=4.0,
        help="length of a window in seconds. The whole clip is recognised, and also each window on its own",
    )
    add("--skeletons", default=SKELETONS, help="folder of the skeleton files")
    options = parser.parse_args(arguments)
    if not 1.0 <= options.window <= 3600.0:
        parser.error(f"--window: {options.window:g} is not a number of seconds from 1 to 3600")
    try:
        healthy = healthy_profile([_read_walk(path, options.skeletons) for path in options.healthy])
        for path in options.clips:
            compared = compare_clip(_read_walk(path, options.skeletons), healthy, options.window)
            print(describe(Path(path).stem, compared, options.side))
        if not options.healthy:
            print(NO_HEALTHY)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def read_clip(path: str | Path, skeletons: str | Path = SKELETONS) -> Clip:
    """Read a BVH file and resample it to 60 Hz. The clip keeps its own rig and bone lengths.

    skeletons: folder of the skeleton files, which name the joints of known rigs. On other rigs the parts of
    the body are found. Raises InputError for a file that cannot be read, and if the parts cannot be found.
    """
    options = ClipMotion()
    # `load_source` uses the target only to recognise the rig and its joints.
    target = load_skeleton(Path(skeletons) / "holden31.yaml")
    return resample(load_source(read_bvh(path), target, skeletons, options).clip, options.fps)


def _read_walk(path: str, skeletons: str) -> Clip:
    """A clip with at least one gait cycle. Raises InputError if there is none."""
    clip = read_clip(path, skeletons)
    if not len(measure_clip(clip)):
        raise InputError(path, NO_CYCLE, fix="Choose a clip with at least three steps straight ahead.")
    return clip


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """What both recognisers say of a clip, and the effects of its limp next to those of limps of people.

    name: the name of the clip. side: the side that counts as hurt; None for the recognised side, or
    the right one if no side is recognised.
    """
    answer, grade = compared.answer, compared.grade
    side = side or answer.side or grade.side or RIGHT
    likely = ", ".join(f"{gait} {answer.probabilities[gait]:.2f}" for gait in GAITS)
    people = effects_of_people()
    lines = [
        f"{name}: {answer.label} {answer.side or ''} ({compared.cycles} cycles)",
        f"  probabilities: {likely}",
        f"  share of the {len(compared.window_answers)} windows with each answer: "
        f"{_in_words(shares_of_answers(compared.window_answers))}",
        f"  graded recogniser, also for mild limps: {grade.label} {grade.side or ''}, "
        f"strength {grade.strength:.2f} (mean of people with this limp: 1), "
        f"{grade.distance:.1f} standard deviations from the likeliest known walk",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}",
        "  share of the windows with each answer of the graded recogniser: "
        f"{_in_words(shares_of_answers(compared.window_grades))}",
        f"  effects if the {side} side is hurt. "
        f"The last columns show limps of people: mean ± standard deviation ({SOURCE})",
        " " * 60 + "".join(f"{gait[:13]:>15}" for gait in people),
    ]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*of_people[key]) for of_people in people.values())
        lines.append(f"  {key:14}{compared.effects[side][key]:8.2f}  {text[:36]:36}{columns}")
    return "\n".join(lines)


def _in_words(shares: Mapping[str, float]) -> str:
    """shares: an answer, such as "antalgic right" -> share of the windows with this answer."""
    said = ", ".join(f"{name} {share:.2f}" for name, share in shares.items())
    return said or "none, because no window has enough cycles"


if __name__ == "__main__":
    sys.exit(main())
