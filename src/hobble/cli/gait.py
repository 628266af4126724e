"""The subcommand `hobble gait`: recognises a limp and measures its effects."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hobble.cli.command import JSON, add_motion_options, arg, command, motion_options, print_result, progress
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError, InputError
from hobble.gait.cycles import measure_clip
from hobble.gait.profile import EFFECTS, NO_CYCLE, RIGHT, SOURCE, effects_of_people, healthy_profile
from hobble.gait.recognise import Answer, WalkComparison, compare_clip, shares_of_answers
from hobble.motion import ClipMotion
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import find_skeleton, load_skeleton, skeleton_folder

NO_HEALTHY = "Compared with the mean of ten healthy people; --healthy names walks of the same person instead."
HEALTHY = "clips of healthy walks of the same person"


@command(
    "what hurts",
    arg("clips", nargs="+", type=Path, metavar="CLIP.bvh", help="clips of walks to recognise and measure"),
    arg("--healthy", nargs="+", type=Path, default=[], metavar="CLIP.bvh", help=HEALTHY),
    arg("--side", choices=("right", "left"), help="the hurt side (default: as recognised)"),
    arg("--window", type=float, default=4.0, help="seconds of the windows that are also recognised"),
    JSON,
    add_motion_options,
)
def gait(options: argparse.Namespace) -> int:
    """Recognise the limp of a walk, and measure how it differs from a healthy walk.

    hobble gait CLIP.bvh ... --healthy HEALTHY.bvh ...
    """
    if not 1.0 <= options.window <= 3600.0:
        raise HobbleError(f"--window: {options.window:g} is not a number of seconds from 1 to 3600")
    settings = motion_options(options)
    healthy = healthy_profile([_read_walk(path, settings) for path in options.healthy])
    compared = {
        path: compare_clip(_read_walk(path, settings), healthy, options.window)
        for path in progress(options.clips)
    }
    texts = [describe(path.stem, each, options.side) for path, each in compared.items()]
    data = [{"clip": path.stem, **as_data(each)} for path, each in compared.items()]
    print_result(options, data, "\n".join([*texts, *([] if options.healthy else [NO_HEALTHY])]))
    return 0


def read_clip(path: str | Path, options: ClipMotion | None = None) -> Clip:
    """Read a BVH file and resample it to 60 Hz. The clip keeps its own rig and bone lengths.

    Raises InputError for a file that cannot be read, and if the parts of its body cannot be found.
    """
    # `load_source` uses the target only to recognise the rig and its joints.
    target = load_skeleton(find_skeleton("holden31"))
    source = load_source(read_bvh(path), target, skeleton_folder(), options or ClipMotion())
    return resample(source.clip, ClipMotion.fps)


def _read_walk(path: Path, options: ClipMotion) -> Clip:
    """A clip with at least one gait cycle. Raises InputError if there is none."""
    clip = read_clip(path, options)
    if not len(measure_clip(clip)):
        raise InputError(path, NO_CYCLE, fix="Choose a clip with at least three steps straight ahead.")
    return clip


def as_data(compared: WalkComparison) -> dict[str, Any]:
    """What both recognisers say of a clip, and the effects of its limp, as plain data."""

    def answer(given: Answer, windows: list[Answer]) -> dict[str, Any]:
        return {
            "label": given.label,
            "side": given.side,
            "probabilities": {name: float(value) for name, value in given.probabilities.items()},
            "windows": shares_of_answers(windows),
        }

    grade = compared.grade
    graded = {"strength": float(grade.strength), "distance": float(grade.distance), "parts": grade.parts}
    return {
        "cycles": compared.cycles,
        "graded": {**answer(grade, list(compared.window_grades)), **graded},
        "linear": answer(compared.answer, list(compared.window_answers)),
        "effects": compared.effects,
    }


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """What the stronger recogniser says of a clip, and the effects of its limp.

    name: the name of the clip. side: the side that counts as hurt; None for the recognised side, or
    the right one if no side is recognised.
    """
    grade, people = compared.grade, effects_of_people()
    side = side or grade.side or RIGHT
    lines = [
        f"{name}: {grade.name} ({compared.cycles} cycles), strength {grade.strength:.2f} (mean of people "
        f"with this limp: 1), {grade.distance:.1f} standard deviations from the likeliest known walk",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}",
        f"  probabilities: {_listed(grade.probabilities)}",
        f"  share of the {len(compared.window_grades)} windows with each answer: "
        f"{_listed(shares_of_answers(compared.window_grades)) or 'none has enough cycles'}",
        f"  effects if the {side} side is hurt. "
        f"The other columns show limps of people: mean ± standard deviation ({SOURCE})",
        " " * 24 + "".join(f"{gait[:13]:>15}" for gait in people),
    ]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*of_people[key]) for of_people in people.values())
        lines.append(f"  {key:14}{compared.effects[side][key]:8.2f}{columns}  {text}")
    return "\n".join(lines)


def _listed(shares: Mapping[str, float]) -> str:
    """The answers with a share or a probability that is not 0 in two digits, the likeliest first."""
    likely = sorted(shares.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {value:.2f}" for name, value in likely if value >= 0.005)
