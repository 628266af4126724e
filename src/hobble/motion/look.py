"""Summarises a folder of clips before training: one line for each clip, and notes on all of them.

The cadence is how often the ankles pass each other in a minute. For steps of a given length, it is nearly the
same for all people. So if the cadence of a clip is impossible, the frame rate in its file may be wrong. A
warning then names a frame rate that would make the cadence usual.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.clip_files import find_clips, require_single_file, unused_file_notes
from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.motion.check_retarget import most_different
from hobble.motion.duplicates import ClipDigest, clip_digest, duplicate_pairs
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.rig import leg_length
from hobble.motion.tempo import times_too_fast

SLOWEST, FASTEST = 40.0, 260.0  # range of the cadences of people who walk or run, steps a minute
RATES = (24, 25, 30, 60, 120, 240)  # usual frame rates of files
# A clip gets a warning if its accelerations show that it plays MOST_OFF times too fast or too slow. If its
# cadence is impossible, too, AGREES times is enough. Of 163 clips of CMU, the data sets `styles` and
# `patients`, Ferre et al. and the release of Holden et al. (2017), 6 clips get a warning at their true rates,
# 87 % of the clips at twice the rate, 88 % at half, and all at a quarter.
MOST_OFF, AGREES = 1.34, 1.3
# If a clip plays at less than this share of its true speed, noise hides its accelerations. Then its cadence
# shows the likely frame rate.
HIDDEN = 0.41
STILL = 3.0  # cm a second: if the hips are slower, the figure may be standing
STANDING = 0.5  # seconds: a figure that rests for a shorter time does not count as standing
# Leg lengths. A step is counted if one ankle moves from half of this behind the other to half of this ahead.
LEAST_STEP = 0.25
MANY = 5  # a warning that at least this many clips get is printed once for all of them
# In what way two clips are duplicates (as `duplicate_pairs` says it) -> what to do. To hold a clip out is to
# keep it from training, for tests.
ADVICE = {"mirrors of each other": "hold both out or neither"}
USUAL_ADVICE = "one of them is enough"


@dataclass(frozen=True)
class ClipSummary:
    """The summary of one clip.

    refused: why the clip cannot be used; empty if it can. rig: name of the rig in the clip's report. fps:
    frame rate of the file. hip_height: median height of the hips, cm. speed: mean speed of the hips over the
    ground, cm a second. steps: how often the ankles pass each other. cadence: steps a minute. standing:
    seconds in which the figure stands. largest_difference: the joint or limb that differs most from the file
    after retargeting, and by how many degrees; None if the clip was not retargeted. digest: the data for
    finding duplicates; None if the clip was not read.
    """

    name: str
    refused: str = ""
    rig: str = ""
    fps: float = 0.0
    seconds: float = 0.0
    hip_height: float = 0.0
    speed: float = 0.0
    steps: int = 0
    cadence: float = 0.0
    standing: float = 0.0
    largest_difference: tuple[str, float] | None = None
    warnings: tuple[str, ...] = ()
    digest: ClipDigest | None = field(default=None, repr=False)


@dataclass(frozen=True)
class FolderSummary:
    """The summaries of a folder's clips, and notes (sentences) that concern several of them."""

    clips: tuple[ClipSummary, ...]
    notes: tuple[str, ...]


def summarise_clips(
    folder: Path, skeleton: Path, skeleton_folder: Path, options: ClipMotion | None = None
) -> FolderSummary:
    """Summarise each BVH file of a folder. Raises InputError if there is none.

    folder: the folder, or one BVH file. skeleton: file of the skeleton to which the clips are retargeted.
    skeleton_folder: the folder of the skeleton files. options: how the files are read (the section `motion`
    of a data set).
    """
    files = (
        [folder]
        if folder.is_file()
        else [require_single_file(n, f) for n, f in sorted(find_clips(folder).items())]
    )
    if not files:
        raise InputError(folder, "no .bvh files here")
    clips = tuple(
        _summary_of_file(file, skeleton, skeleton_folder, options or ClipMotion()) for file in files
    )
    unused = () if folder.is_file() else tuple(unused_file_notes(folder, [file.stem for file in files]))
    short, common = shared_warnings(clips)
    return FolderSummary(tuple(short), (*common, *duplicate_notes(clips), *standing_notes(clips), *unused))


def shared_warnings(clips: Sequence[ClipSummary]) -> tuple[list[ClipSummary], list[str]]:
    """Take warnings that at least MANY clips share out of their summaries.

    Returns the summaries without these warnings, and a note for each of the warnings. Only a warning that
    ends with a full stop can be shared. The others are about one clip.
    """
    count = Counter(warning for clip in clips for warning in clip.warnings if warning.endswith("."))
    common = {warning: times for warning, times in count.items() if times >= MANY}
    short = [replace(clip, warnings=tuple(w for w in clip.warnings if w not in common)) for clip in clips]
    return short, [f"{times} of {len(clips)} clips: {warning}" for warning, times in common.items()]


def _summary_of_file(file: Path, skeleton: Path, skeleton_folder: Path, options: ClipMotion) -> ClipSummary:
    try:
        clip, report = make_clip(file, skeleton, skeleton_folder, file.stem, skeleton.stem, options)
    except HobbleError as error:
        return ClipSummary(file.stem, refused=_without_path(str(error).split("\n")[0], file))
    return summary_of_clip(clip, report)


def _without_path(message: str, file: Path) -> str:
    """A message without the path of its file, because in the table it follows the clip's name."""
    return message.removeprefix(str(file)).lstrip(":, ")


def summary_of_report(report: Mapping[str, Any]) -> ClipSummary:
    """Those parts of a summary that the clip's report (`motion/<clip>.json`) tells.

    The fields that would need the clip itself keep their defaults.
    """
    return ClipSummary(
        report["clip"],
        rig=report["rig"],
        fps=report["source_fps"],
        seconds=report["seconds"],
        largest_difference=most_different(report["retarget"]) if report.get("retarget") else None,
        warnings=(*report.get("unsure", []), *_repair_warning(report)),
    )


def summary_of_clip(clip: Clip, report: Mapping[str, Any]) -> ClipSummary:
    """The whole summary of a clip. report: its report (`motion/<clip>.json`)."""
    hips = clip.positions[:, clip.skeleton.role("hips")]
    moves = np.linalg.norm(np.diff(hips[:, [0, 2]], axis=0), axis=-1)
    distance = float(moves.sum())
    seconds = len(clip) / clip.fps
    steps = step_count(clip)
    standing = standing_seconds(moves * clip.fps, clip.fps)
    moving = max(seconds - standing, 1e-9)
    summary = summary_of_report(report)
    return replace(
        summary,
        name=clip.name,
        seconds=seconds,
        hip_height=float(np.median(hips[:, 1])),
        speed=distance / seconds,
        steps=steps,
        cadence=60.0 * steps / seconds,
        standing=standing,
        warnings=(*rate_warnings(steps, moving, distance, clip, report), *summary.warnings),
        digest=clip_digest(clip, report["sha256"]),
    )


def _repair_warning(report: Mapping[str, Any]) -> list[str]:
    """A short warning that the clip was repaired: the start of the first repair and the number of the others.

    The list is empty if nothing was repaired.
    """
    if not (repairs := report["repairs"]):
        return []
    more = f" and {len(repairs) - 1} more" if len(repairs) > 1 else ""
    return [f"repaired: {re.split('[;.,] ', repairs[0])[0].rstrip('.')}{more}"]


def step_count(clip: Clip) -> int:
    """How often one ankle passes the other, seen along the facing direction.

    Before and after, the ankles must be apart by half of LEAST_STEP.
    """
    p, role = clip.positions, clip.skeleton.role
    left = p[:, role("left_hip")] - p[:, role("right_hip")]
    ahead = np.cross(left, [0.0, 1.0, 0.0])
    ahead /= np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-9)
    # By how many cm the left ankle is ahead of the right one.
    left_ahead = np.sum((p[:, role("left_heel")] - p[:, role("right_heel")]) * ahead, axis=-1)
    far = 0.5 * LEAST_STEP * leg_length(clip.skeleton)
    foremost = np.sign(left_ahead[np.abs(left_ahead) > far])
    return int(np.count_nonzero(foremost[1:] != foremost[:-1]))


def standing_seconds(speed: Array, fps: float) -> float:
    """For how many seconds the figure stands: the hips are slower than STILL for at least STANDING.

    speed: (F-1,) speed of the hips, cm a second.
    """
    still = np.concatenate([[False], speed < STILL, [False]])
    edges = np.flatnonzero(still[1:] != still[:-1])
    runs = [b - a for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return float(sum(run for run in runs if run >= STANDING * fps) / fps)


def rate_warnings(
    steps: int, moving: float, distance: float, clip: Clip, report: Mapping[str, Any]
) -> list[str]:
    """A warning if no person has the clip's cadence or accelerations, else an empty list.

    The warning names a frame rate that would explain them. steps: the number of steps. moving: seconds in
    which the figure moves. distance: length of its path over the ground, cm.
    """
    if steps < 2:
        return []
    cadence = 60.0 * steps / moving
    step_length = distance / steps
    leg = leg_length(clip.skeleton)
    # Cadence grows with step length (Grieve and Gear 1966). With steps of .8 leg lengths it is 110 a minute.
    # The relation is not extended to steps shorter than .4 or longer than 1.76 leg lengths.
    usual = 110.0 * np.clip(step_length / (0.8 * leg), 0.5, 2.2) ** 0.6
    fps, found = report["source_fps"], times_too_fast(clip, steps, report["scale"])
    impossible = not (SLOWEST <= cadence <= FASTEST and 0.45 < cadence / usual < 2.2)
    # How many times too fast the clip probably plays.
    likely = found.likely if found and found.likely > HIDDEN else float(cadence / usual)
    rate = _usual_rate(fps / likely, fps)
    # The accelerations, if they can be measured, must confirm that the clip plays too fast or too slow.
    confirmed = found is None or (found.least > AGREES if cadence > usual else found.least < 1 / AGREES)
    if impossible and confirmed:
        return [
            f"{cadence:.0f} steps a minute of {step_length:.0f} cm are impossible; at {rate} fps there would "
            f"be {cadence * rate / fps:.0f} a minute (source_fps: {rate})"
        ]
    if found is None or 1 / MOST_OFF < found.least < MOST_OFF:
        return []
    # Accelerations grow with the square of the speed.
    strength = f"{likely**2:.{1 if likely > 1 else 2}f}"
    return [
        f"The body's accelerations are {strength} times those of people in steps of {step_length:.0f} cm; at "
        f"{rate} fps they would be usual (source_fps: {rate})"
    ]


def _usual_rate(ideal: float, fps: float) -> int:
    """The rate of RATES that is nearest to `ideal`. It is never the file's own rate `fps`."""
    return min((rate for rate in RATES if rate != fps), key=lambda rate: abs(np.log(rate / ideal)))


def duplicate_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """A sentence for each pair of duplicate clips: which clips they are, and what to do."""
    pairs = duplicate_pairs([clip.digest for clip in clips if clip.digest is not None])
    return [f"{a} and {b} are {what}: {ADVICE.get(what, USUAL_ADVICE)}." for a, b, what in pairs]


def standing_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """A sentence that nobody stands in any of the clips, and what follows from it.

    The list is empty if somebody stands, or if a clip was refused and might show it.
    """
    if not clips or any(clip.standing > 0 or clip.refused for clip in clips):
        return []
    return [
        "Nobody stands in these clips, so the character will not learn to stand, to start or to stop. "
        "Add a clip in which somebody stands, starts and stops."
    ]


def format_table(folder: FolderSummary) -> str:
    """The summary of a folder as text: a line for each clip, then the notes."""
    width = max(4, *(len(clip.name) for clip in folder.clips))
    columns = f"{'rig':10} {'fps':>5} {'s':>6} {'hips':>5} {'cm/s':>5} {'steps':>5} {'/min':>4} {'stands':>6}"
    lines = [f"{'clip':{width}} {columns}  largest difference"]
    for clip in folder.clips:
        if clip.refused:
            lines.append(f"{clip.name:{width}} REFUSED {clip.refused}")
            continue
        difference = "not retargeted"
        if clip.largest_difference:
            difference = f"{clip.largest_difference[0]} {clip.largest_difference[1]:.0f} deg"
        remarks = "; ".join([difference, *clip.warnings])
        lines.append(
            f"{clip.name:{width}} {clip.rig:10.10} {clip.fps:5.4g} {clip.seconds:6.1f} "
            f"{clip.hip_height:5.0f} {clip.speed:5.0f} {clip.steps:5d} {clip.cadence:4.0f} "
            f"{clip.standing:6.1f}  {remarks}"
        )
    return "\n".join([*lines, *folder.notes])
