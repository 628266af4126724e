"""The subcommand `hobble gait`: recognises a limp and measures its effects."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hobble.cli.command import (
    JSON,
    add_motion_options,
    arg,
    command,
    motion_options,
    print_result,
    progress,
)
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError, InputError
from hobble.gait.cycles import measure_clip
from hobble.gait.profile import EFFECTS, NO_CYCLE, RIGHT, SOURCE, effects_of_people, healthy_profile
from hobble.gait.recognise import Answer, WalkComparison, compare_clip, shares_of_answers
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import find_skeleton, load_skeleton, skeleton_folder

NO_HEALTHY = (
    "No healthy walk was given, so the clips were compared with the mean of ten healthy people. "
    "An unusual build can then look like a limp. Name healthy walks of the same person after --healthy."
)


HEALTHY = "clips of healthy walks of the same person"
SIDE = "the hurt side; default: the side that is recognised, else right"
WINDOW = "length of a window in seconds. The whole clip is recognised, and also each window on its own"


@command(
    "limps",
    arg("clips", nargs="+", type=Path, metavar="CLIP.bvh", help="clips of walks to recognise and measure"),
    arg("--healthy", nargs="+", type=Path, default=[], metavar="CLIP.bvh", help=HEALTHY),
    arg("--side", choices=("right", "left"), help=SIDE),
    arg("--window", type=float, default=4.0, help=WINDOW),
    arg("--skeletons", type=Path, help="folder of the skeleton files (default config/skeletons)"),
    JSON,
    add_motion_options,
)
def gait(options: argparse.Namespace) -> int:
    """Recognise the limp of a walk, and measure how it differs from a healthy walk.

    hobble gait CLIP.bvh ... --healthy HEALTHY.bvh ...
    """
    if not 1.0 <= options.window <= 3600.0:
        raise HobbleError(f"--window: {options.window:g} is not a number of seconds from 1 to 3600")
    settings, folder = motion_options(options), options.skeletons or skeleton_folder()
    healthy = healthy_profile([_read_walk(path, folder, settings) for path in options.healthy])
    compared = {
        path: compare_clip(_read_walk(path, folder, settings), healthy, options.window)
        for path in progress(options.clips)
    }
    texts = [describe(path.stem, each, options.side) for path, each in compared.items()]
    data = [{"clip": path.stem, **as_data(each)} for path, each in compared.items()]
    print_result(options, data, "\n".join([*texts, *([] if options.healthy else [NO_HEALTHY])]))
    return 0


def read_clip(
    path: str | Path, skeletons: str | Path | None = None, options: ClipMotion | None = None
) -> Clip:
    """Read a BVH file and resample it to 60 Hz. The clip keeps its own rig and bone lengths.

    skeletons: folder of the skeleton files, which name the joints of known rigs. On other rigs the parts of
    the body are found. Raises InputError for a file that cannot be read, and if the parts cannot be found.
    """
    options = options or ClipMotion()
    # `load_source` uses the target only to recognise the rig and its joints.
    target = load_skeleton(find_skeleton("holden31"))
    return resample(
        load_source(read_bvh(path), target, skeletons or skeleton_folder(), options).clip, options.fps
    )


def _read_walk(path: Path, skeletons: Path, options: ClipMotion) -> Clip:
    """A clip with at least one gait cycle. Raises InputError if there is none."""
    clip = read_clip(path, skeletons, options)
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
        "effects": {
            side: {key: float(value) for key, value in values.items()}
            for side, values in compared.effects.items()
        },
    }


def describe(name: str, compared: WalkComparison, side: str | None = None) -> str:
    """What both recognisers say of a clip, the stronger one first, and the effects of its limp.

    name: the name of the clip. side: the side that counts as hurt; None for the recognised side, or
    the right one if no side is recognised.
    """
    answer, grade = compared.answer, compared.grade
    side = side or grade.side or answer.side or RIGHT
    people = effects_of_people()
    lines = [
        f"{name}: {grade.name} ({compared.cycles} cycles), strength {grade.strength:.2f} (mean of people "
        f"with this limp: 1), {grade.distance:.1f} standard deviations from the likeliest known walk",
        f"  what may hurt: {', '.join(grade.parts) or 'nothing'}",
        f"  probabilities: {_listed(grade.probabilities)}",
        f"  share of the {len(compared.window_grades)} windows with each answer: "
        f"{_in_words(shares_of_answers(compared.window_grades))}",
        "  a simpler recogniser, blind to mild limps: "
        f"{answer.name}; {_listed(answer.probabilities)}; windows: "
        f"{_in_words(shares_of_answers(compared.window_answers))}",
        f"  effects if the {side} side is hurt. "
        f"The other columns show limps of people: mean ± standard deviation ({SOURCE})",
        " " * 24 + "".join(f"{gait[:13]:>15}" for gait in people),
    ]
    for key, text in EFFECTS.items():
        columns = "".join("{:9.2f} ±{:4.2f}".format(*of_people[key]) for of_people in people.values())
        lines.append(f"  {key:14}{compared.effects[side][key]:8.2f}{columns}  {text}")
    return "\n".join(lines)


def _listed(probabilities: Mapping[str, float]) -> str:
    """The answers with a probability that is not 0 in two digits, the likeliest first."""
    likely = sorted(probabilities.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {value:.2f}" for name, value in likely if value >= 0.005)


def _in_words(shares: Mapping[str, float]) -> str:
    """shares: an answer, such as "antalgic right" -> share of the windows with this answer."""
    said = ", ".join(f"{name} {share:.2f}" for name, share in shares.items())
    return said or "none, because no window has enough cycles"
