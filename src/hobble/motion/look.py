"""Summarises a folder of clips before training: one line for each clip, and notes on all of them.

The cadence is how often the ankles pass each other in a minute. The speed is that of the hips. For steps of a
given length, the cadence is nearly the same for all people. If a clip contradicts this, a warning names
a frame rate that would explain it.
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
from hobble.core.clip_files import find_clips, only_file, unused_file_notes
from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.motion.check_retarget import worst
from hobble.motion.duplicates import ClipDigest, digest, same_pairs
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.rig import leg_length
from hobble.motion.tempo import times_too_fast

SLOWEST, FASTEST = 40.0, 260.0  # steps a minute of people who walk or run
RATES = (24, 25, 30, 60, 120, 240)  # usual frame rates of files
# A clip gets a warning if its accelerations show that it plays MOST_OFF times too fast or too slow. If its
# cadence is odd, too, AGREES times is enough. Of 163 clips of CMU, the data sets `styles` and `patients`,
# Ferre et al. and the release of Holden et al. (2017), 6 get a warning at their true rates, 87 % at twice the
# rate, 88 % at half, and all at a quarter. HIDDEN: in a clip that plays at less than this share of its true
# speed, noise hides the accelerations.
MOST_OFF, AGREES, HIDDEN = 1.34, 1.3, 0.41
STILL = 3.0  # cm a second; slower hips count as standing
STANDING = 0.5  # seconds; a shorter rest does not count as standing
# Leg lengths: a step counts if one ankle passes the other, from half of this behind it to half of this ahead.
LEAST_STEP = 0.25
MANY = 5  # a warning that at least this many clips get is printed once for all of them
# What `same_pairs` says of two duplicates -> advice. For all others, the advice is that one is enough.
ADVICE = {"mirrors of each other": "hold both out or neither"}


@dataclass(frozen=True)
class ClipSummary:
    """The summary of one clip.

    refused: why it cannot be used; empty if it can. rig: its name in the clip's report. fps: of the file.
    hips: median height of the hips, cm. speed: of the hips, cm a second. steps: how often the ankles pass
    each other. cadence: steps a minute. stands: seconds in which the figure stands. off: the joint or limb
    that differs most from the file after retargeting, and by how many degrees; None if the clip was not
    retargeted. digest: for finding duplicates.
    """

    name: str
    refused: str = ""
    rig: str = ""
    fps: float = 0.0
    seconds: float = 0.0
    hips: float = 0.0
    speed: float = 0.0
    steps: int = 0
    cadence: float = 0.0
    stands: float = 0.0
    off: tuple[str, float] | None = None
    warnings: tuple[str, ...] = ()
    digest: ClipDigest | None = field(default=None, repr=False)


@dataclass(frozen=True)
class FolderSummary:
    """The clips of a folder, and notes on what they have in common or lack."""

    clips: tuple[ClipSummary, ...]
    notes: tuple[str, ...]


def look(folder: Path, skeleton: Path, maps: Path, options: ClipMotion | None = None) -> FolderSummary:
    """Summarise each clip of a folder, or one file. Raises InputError if the folder has no clips.

    skeleton: file of the target skeleton. maps: the folder of the skeleton files. options: how the files are
    read, as in a data set.
    """
    files = [folder] if folder.is_file() else [only_file(n, f) for n, f in sorted(find_clips(folder).items())]
    if not files:
        raise InputError(folder, "no .bvh files here")
    clips = tuple(_summary_of_file(file, skeleton, maps, options or ClipMotion()) for file in files)
    orphans = () if folder.is_file() else tuple(unused_file_notes(folder, [file.stem for file in files]))
    short, common = shared_warnings(clips)
    return FolderSummary(tuple(short), (*common, *same_notes(clips), *standing_notes(clips), *orphans))


def shared_warnings(clips: Sequence[ClipSummary]) -> tuple[list[ClipSummary], list[str]]:
    """The clips without the warnings that at least MANY of them share, and these warnings as notes."""
    count = Counter(warning for clip in clips for warning in clip.warnings if warning.endswith("."))
    common = {warning: times for warning, times in count.items() if times >= MANY}
    short = [replace(clip, warnings=tuple(w for w in clip.warnings if w not in common)) for clip in clips]
    return short, [f"{times} of {len(clips)} clips: {warning}" for warning, times in common.items()]


def _summary_of_file(file: Path, skeleton: Path, maps: Path, options: ClipMotion) -> ClipSummary:
    try:
        clip, report = make_clip(file, skeleton, maps, file.stem, skeleton.stem, options)
    except HobbleError as error:
        return ClipSummary(file.stem, refused=_without_path(str(error).split("\n")[0], file))
    return summary_of_clip(clip, report)


def _without_path(message: str, file: Path) -> str:
    """A message about a file, without the path: in the table, the message follows the clip's name."""
    return message.removeprefix(str(file)).lstrip(":, ")


def summary_of_report(report: Mapping[str, Any]) -> ClipSummary:
    """The summary as far as the clip's report (`motion/<clip>.json`) tells it. The clip is not read."""
    return ClipSummary(
        report["clip"],
        rig=report["rig"],
        fps=report["source_fps"],
        seconds=report["seconds"],
        off=worst(report["retarget"]) if report.get("retarget") else None,
        warnings=(*report.get("unsure", []), *_first(report)),
    )


def summary_of_clip(clip: Clip, report: Mapping[str, Any]) -> ClipSummary:
    """The summary of a clip. report: its `motion/<clip>.json`."""
    hips = clip.positions[:, clip.skeleton.role("hips")]
    path = np.linalg.norm(np.diff(hips[:, [0, 2]], axis=0), axis=-1)
    seconds = len(clip) / clip.fps
    steps = step_count(clip)
    speed, cadence = float(path.sum() / seconds), 60.0 * steps / seconds
    stands = stand_seconds(path * clip.fps, clip.fps)
    moving = max(seconds - stands, 1e-9)
    summary = summary_of_report(report)
    return replace(
        summary,
        name=clip.name,
        seconds=seconds,
        hips=float(np.median(hips[:, 1])),
        speed=speed,
        steps=steps,
        cadence=cadence,
        stands=stands,
        warnings=(*rate_warnings(steps, moving, float(path.sum()), clip, report), *summary.warnings),
        digest=digest(clip, report["sha256"]),
    )


def _first(report: Mapping[str, Any]) -> list[str]:
    """The beginning of the first repair and the number of others, as a short warning."""
    if not (repairs := report["repairs"]):
        return []
    more = f" and {len(repairs) - 1} more" if len(repairs) > 1 else ""
    return [f"repaired: {re.split('[;.,] ', repairs[0])[0].rstrip('.')}{more}"]


def step_count(clip: Clip) -> int:
    """How often the ankles pass each other in the facing direction, if they are far enough apart before and
    after."""
    p, role = clip.positions, clip.skeleton.role
    left = p[:, role("left_hip")] - p[:, role("right_hip")]
    ahead = np.cross(left, [0.0, 1.0, 0.0])
    ahead /= np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-9)
    apart = np.sum((p[:, role("left_heel")] - p[:, role("right_heel")]) * ahead, axis=-1)
    far = 0.5 * LEAST_STEP * leg_length(clip.skeleton)
    sides = np.sign(apart[np.abs(apart) > far])
    return int(np.count_nonzero(sides[1:] != sides[:-1]))


def stand_seconds(speed: Array, fps: float) -> float:
    """Seconds in which the hips hardly move for some time. speed: (F-1,) cm a second."""
    still = np.concatenate([[False], speed < STILL, [False]])
    edges = np.flatnonzero(still[1:] != still[:-1])
    runs = [b - a for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return float(sum(run for run in runs if run >= STANDING * fps) / fps)


def rate_warnings(steps: int, moving: float, way: float, clip: Clip, report: Mapping[str, Any]) -> list[str]:
    """A sentence if no person has this cadence or these accelerations, with a frame rate that would explain
    them; else no sentence.

    moving: seconds in which the figure moves. way: length of its path, cm.
    """
    if steps < 2:
        return []
    cadence = 60.0 * steps / moving
    step_length = way / steps
    leg = leg_length(clip.skeleton)
    # Cadence grows with step length (Grieve and Gear 1966). With steps of .8 leg lengths it is 110 a minute.
    usual = 110.0 * np.clip(step_length / (0.8 * leg), 0.5, 2.2) ** 0.6
    fps, found = report["source_fps"], times_too_fast(clip, steps, report["scale"])
    odd = not (SLOWEST <= cadence <= FASTEST and 0.45 < cadence / usual < 2.2)
    likely = found.likely if found and found.likely > HIDDEN else float(cadence / usual)
    rate = _usual_rate(fps / likely, fps)
    if odd and (found is None or (found.least > AGREES if cadence > usual else found.least < 1 / AGREES)):
        return [
            f"{cadence:.0f} steps a minute of {step_length:.0f} cm are impossible; at {rate} fps they "
            f"would be {cadence * rate / fps:.0f} (source_fps: {rate})"
        ]
    if found is None or 1 / MOST_OFF < found.least < MOST_OFF:
        return []
    strong = f"{likely**2:.{1 if likely > 1 else 2}f}"
    return [
        f"The body accelerates {strong} times as strongly as people do in steps of {step_length:.0f} cm; at "
        f"{rate} fps it would fit (source_fps: {rate})"
    ]


def _usual_rate(ideal: float, fps: float) -> int:
    """The usual frame rate nearest to `ideal`, except the file's own, `fps`."""
    return min((rate for rate in RATES if rate != fps), key=lambda rate: abs(np.log(rate / ideal)))


def same_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """Sentences on duplicates."""
    pairs = same_pairs([clip.digest for clip in clips if clip.digest is not None])
    return [f"{a} and {b} are {what}: {ADVICE.get(what, 'one of them is enough')}." for a, b, what in pairs]


def standing_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """A sentence if nobody stands in any clip, with the consequence."""
    if not clips or any(clip.stands > 0 or clip.refused for clip in clips):
        return []
    return [
        "Nobody stands in these clips, so the character will not learn to stand, to start or to stop. "
        "Add a clip in which somebody stands, starts and stops."
    ]


def table(folder: FolderSummary) -> str:
    """The folder as text: a line for each clip, then the notes."""
    wide = max(4, *(len(clip.name) for clip in folder.clips))
    names = f"{'rig':10} {'fps':>5} {'s':>6} {'hips':>5} {'cm/s':>5} {'steps':>5} {'/min':>4} {'stands':>6}"
    head = f"{'clip':{wide}} {names}  furthest off"
    lines = [head]
    for clip in folder.clips:
        if clip.refused:
            lines.append(f"{clip.name:{wide}} REFUSED {clip.refused}")
            continue
        off = f"{clip.off[0]} {clip.off[1]:.0f} deg" if clip.off else "as it is"
        remarks = "; ".join([off, *clip.warnings])
        lines.append(
            f"{clip.name:{wide}} {clip.rig:10.10} {clip.fps:5.4g} {clip.seconds:6.1f} {clip.hips:5.0f} "
            f"{clip.speed:5.0f} {clip.steps:5d} {clip.cadence:4.0f} {clip.stands:6.1f}  {remarks}"
        )
    return "\n".join([*lines, *folder.notes])
