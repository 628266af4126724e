"""Summarises the clips of a folder before training, as a table, as a page, and as a picture of one clip."""

import html
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.clip_files import clips_in, unused_file_notes
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import atomic_path
from hobble.core.messages import group_messages, in_words
from hobble.core.quat import Array
from hobble.core.skeleton import path_between
from hobble.motion import ClipMotion
from hobble.motion.axes import UP
from hobble.motion.duplicates import ClipDigest, clip_digest, duplicate_pairs
from hobble.motion.edit import resample
from hobble.motion.make import fit_skeleton, load_source, make_clip
from hobble.motion.other_formats import MOTION_SUFFIXES, read_motion
from hobble.motion.physics import standing_seconds, step_count
from hobble.motion.retarget import ANGLES, BONES, compare_motions, most_different
from hobble.motion.root import facing_directions
from hobble.motion.skeleton_file import load_skeleton

# The table: one line for each clip, and notes on all of them.

# What to do with duplicates that do not have all in common. To hold a clip out is to keep it from training,
# for tests.
ADVICE, USUAL_ADVICE = "hold both out or neither", "one of them is enough"


@dataclass(frozen=True)
class ClipSummary:
    """The summary of one clip.

    refused: why the clip cannot be used; empty if it can. rig: name of the rig in the clip's report. fps:
    frame rate of the file. hip_height: median height of the hips, cm. speed: mean speed of the hips over the
    ground, cm a second. cadence: steps a minute. standing: seconds in which the figure stands.
    largest_difference: the joint or limb that differs most from the file after retargeting, and by how many
    degrees; None if the clip was not retargeted. digest: the data for finding duplicates; None if the clip
    was not read.
    """

    name: str
    refused: str = ""
    rig: str = ""
    fps: float = 0.0
    seconds: float = 0.0
    hip_height: float = 0.0
    speed: float = 0.0
    cadence: float = 0.0
    standing: float = 0.0
    largest_difference: tuple[str, float] | None = None
    warnings: tuple[str, ...] = ()
    digest: ClipDigest | None = field(default=None, repr=False)


def summarise_clips(
    folder: Path,
    skeleton: Path,
    skeleton_folder: Path,
    options: ClipMotion | None = None,
    progress: Callable[[Iterable[Path]], Iterable[Path]] = iter,
) -> tuple[list[ClipSummary], list[str]]:
    """Summaries of the BVH files of a folder, and notes on several of them. Raises InputError without a file.

    folder: the folder, or one BVH file. skeleton: file of the skeleton to which the clips are retargeted.
    skeleton_folder: the folder of the skeleton files. options: how the files are read (the section `motion`
    of a data set). progress: shows how far the work has come, while it hands on the files.
    """
    clips, files, options = [], list(clips_in(folder, MOTION_SUFFIXES).values()), options or ClipMotion()
    for file in progress(files):
        try:
            made = make_clip(file, skeleton, skeleton_folder, file.stem, skeleton.stem, options)
            clips.append(summary_of_clip(*made))
        except HobbleError as error:
            # In the table, the message follows the clip's name.
            refused = str(error).split("\n")[0].removeprefix(str(file)).lstrip(":, ")
            clips.append(ClipSummary(file.stem, refused=refused))
    unused = [] if folder.is_file() else unused_file_notes(folder, [file.stem for file in files])
    return clips, [*duplicate_notes(clips), *standing_notes(clips), *unused]


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
        warnings=(*report.get("unsure", ()), *report["repairs"]),
    )


def summary_of_clip(clip: Clip, report: Mapping[str, Any]) -> ClipSummary:
    """The whole summary of a clip. report: its report (`motion/<clip>.json`)."""
    hips = clip.positions[:, clip.skeleton.role("hips")]
    moves = np.linalg.norm(np.diff(hips[:, [0, 2]], axis=0), axis=-1)
    seconds = len(clip) / clip.fps
    return replace(
        summary_of_report(report),
        name=clip.name,
        seconds=seconds,
        hip_height=float(np.median(hips[:, 1])),
        speed=float(moves.sum()) / seconds,
        cadence=60.0 * step_count(clip) / seconds,
        standing=standing_seconds(moves * clip.fps, clip.fps),
        digest=clip_digest(clip, report["sha256"]),
    )


def duplicate_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """A sentence for each pair of duplicate clips: which clips they are, and what to do."""
    pairs = duplicate_pairs([clip.digest for clip in clips if clip.digest is not None])
    whole = ("the same file", "the same motion")
    return [f"{a} and {b} are {what}: {USUAL_ADVICE if what in whole else ADVICE}." for a, b, what in pairs]


def standing_notes(clips: Sequence[ClipSummary]) -> list[str]:
    """A sentence that nobody stands in any of the clips, and what follows from it.

    The list is empty if somebody stands, or if a clip was refused and might show it.
    """
    if not clips or any(clip.standing > 0 or clip.refused for clip in clips):
        return []
    return ["Nobody stands in these clips, so the character will not learn to stand, start or stop."]


def format_table(clips: Sequence[ClipSummary], notes: Sequence[str]) -> str:
    """What `summarise_clips` returns as text: a line for each clip, their warnings by kind, the notes."""
    width = max(4, *(len(clip.name) for clip in clips))
    columns = f"{'rig':10} {'fps':>5} {'s':>6} {'hips':>5} {'cm/s':>5} {'/min':>4} {'stands':>6}"
    lines = [f"{'clip':{width}} {columns}  largest difference"]
    for clip in clips:
        if clip.refused:
            lines.append(f"{clip.name:{width}} REFUSED {clip.refused}")
            continue
        difference = "not retargeted"
        if clip.largest_difference:
            difference = f"{clip.largest_difference[0]} {clip.largest_difference[1]:.0f} deg"
        lines.append(
            f"{clip.name:{width}} {clip.rig:10.10} {clip.fps:5.4g} {clip.seconds:6.1f} "
            f"{clip.hip_height:5.0f} {clip.speed:5.0f} {clip.cadence:4.0f} {clip.standing:6.1f}  {difference}"
        )
    warnings = group_messages((clip.name, "", warning) for clip in clips for warning in clip.warnings)
    return "\n".join([*lines, *map(in_words, warnings), *notes])


# The page about a data set before training: a line for each clip, with a small walking figure. If there are
# very many clips, only some of them are read. The lines of the others show what their reports and labels say.

FRAMES, SECONDS = 40, 4.0  # the small figure shows up to 40 frames from the middle 4 seconds of its clip
MOST_READ = 600  # clips; as many make a page of 10 MB in half a minute
MOST_NOTES = 40  # at most this many notes above the table are shown, such as notes on duplicates
LABELS = ("cycles", "seconds", "warnings")  # keys of `labels/<clip>.json` that the page shows
SAMPLED = "To keep this page small, only {} clips were read and compared, those with warnings first."
GOLDEN = 0.6180339887498949  # golden ratio - 1; its multiples, modulo 1, are spread evenly over 0..1
# The columns of texts, then those of numbers.
COLUMNS = (
    *("clip", "", "rig", "gait, s", "largest difference"),
    *("fps", "s", "hips, cm", "steps/min", "cycles", "foot down"),
)
STYLE = """body{font:14px/1.4 system-ui,sans-serif;margin:1.5em;color:#222;background:#fff}
table{border-collapse:collapse}th,td{padding:2px 9px;text-align:left;border-bottom:1px solid #e3e3e3}
th{position:sticky;top:0;background:#fff}td.n{text-align:right;font-variant-numeric:tabular-nums}
.bar{display:inline-block;width:75px;height:9px;background:#eee;margin-right:6px}
.bar i{display:block;height:100%;background:#4a7ab5}small,.note{color:#a04000}canvas{display:block}"""
# One timer draws all figures that can be seen. D: the results of `make_figure`, C: the canvases. Users who
# asked their system for less motion see only the first frame.
SCRIPT = """const D=JSON.parse(document.getElementById('d').textContent);
const C=[...document.querySelectorAll('canvas')];
const calm=matchMedia('(prefers-reduced-motion: reduce)').matches;
function draw(t){C.forEach((c,i)=>{const r=c.getBoundingClientRect();if(r.bottom<0||r.top>innerHeight)return;
const d=D[i],p=d.p[calm?0:Math.floor(t*d.f/1000)%d.p.length],g=c.getContext('2d');
g.clearRect(0,0,80,80);g.strokeStyle='#ccc';g.beginPath();g.moveTo(0,76);g.lineTo(80,76);g.stroke();
g.lineWidth=1.5;d.b.forEach(([a,b,s])=>{g.strokeStyle=['#444','#c0392b','#2471a3'][s];g.beginPath();
g.moveTo(p[2*a],p[2*a+1]);g.lineTo(p[2*b],p[2*b+1]);g.stroke()})});if(!calm)requestAnimationFrame(draw)}
if(calm)addEventListener('scroll',()=>draw(0));requestAnimationFrame(draw);"""


def make_figure(clip: Clip) -> dict[str, Any]:
    """A figure that moves as in the clip but stays in place, seen from its side, to be drawn in the browser.

    Returns three values under short keys, to keep the page small. p: for each frame, x and y of every joint
    in pixels of a picture of 80 x 80. b: bones as (joint, joint, side), where side is 0 for the middle, 1 for
    left and 2 for right. f: frames a second.
    """
    shown = min(len(clip), round(SECONDS * clip.fps))
    first = (len(clip) - shown) // 2
    frames = np.linspace(first, first + shown - 1, min(FRAMES, shown)).round().astype(int)
    p = clip.positions[frames]
    ahead = facing_directions(clip.skeleton, p, 0.0)
    # How far each joint is ahead of the hips, cm.
    along = np.sum((p - p[:, :1]) * ahead[:, None], axis=-1)
    height = max(float(np.percentile(p[..., 1].max(axis=1), 90)), 1.0)
    # The hips are in the middle, the floor is at pixel 76, and the figure is 68 pixels tall.
    pixels = np.stack([40 + 68 * along / height, 76 - 68 * p[..., 1] / height], axis=-1)
    names = [name.lower() for name in clip.skeleton.joints]
    sides = [1 if "left" in name else 2 if "right" in name else 0 for name in names]
    bones = [(parent, j, sides[j]) for j, parent in enumerate(clip.skeleton.parents) if parent >= 0]
    flat = np.clip(pixels, 0, 80).round(1).reshape(len(frames), -1)
    return {"p": flat.tolist(), "b": bones, "f": round(len(frames) * clip.fps / shown, 2)}


def look_page(
    name: str,
    reports: Sequence[Mapping[str, Any]],
    labels: Sequence[Mapping[str, Any]],
    read: Callable[[int], tuple[Clip, Array]],
) -> str:
    """The HTML text of the page about the data set `name`. The page needs no other files.

    reports: for each clip, the content of `motion/<clip>.json`. labels: for each clip, the values of LABELS
    in `labels/<clip>.json`. read: index of a clip -> the clip and its contacts (F, 4). It is called only for
    the clips of `choose_clips`, one after another.
    """
    summaries = [summary_of_report(report) for report in reports]
    warned = (summary.warnings or of["warnings"] for summary, of in zip(summaries, labels, strict=True))
    chosen = choose_clips([bool(warnings) for warnings in warned])
    figures, foot_down = [], {}
    for n in chosen:
        clip, contacts = read(n)
        summaries[n] = summary_of_clip(clip, reports[n])
        figures.append(make_figure(clip))
        foot_down[n] = float((np.asarray(contacts) > 0.5).any(axis=1).mean())
    # Only if all clips were read is it certain that nobody stands in them.
    notes = standing_notes(summaries) if len(chosen) == len(summaries) else [SAMPLED.format(len(chosen))]
    notes += duplicate_notes(summaries)
    if (more := len(notes) - MOST_NOTES) > 0:
        notes[MOST_NOTES:] = [f"And {more} more notes, most of them on duplicates."]
    rows = (_row(summary, labels[n], foot_down.get(n)) for n, summary in enumerate(summaries))
    seconds, title = sum(summary.seconds for summary in summaries), html.escape(name)
    data = json.dumps(figures, separators=(",", ":"))
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"<h1>{title}</h1><p>{len(summaries)} clips, {seconds:.0f} s. Left is red, right is blue.</p>"
        + "".join(f'<p class="note">{html.escape(note)}</p>' for note in notes)
        + f"<table><thead><tr>{''.join(f'<th>{column}</th>' for column in COLUMNS)}</tr></thead>"
        + f"<tbody>{''.join(rows)}</tbody></table>"
        + f'<script type="application/json" id="d">{data}</script><script>{SCRIPT}</script></html>\n'
    )


def choose_clips(warned: Sequence[bool]) -> list[int]:
    """Indices of the clips that are read for the page, in order: all of them, or MOST_READ.

    warned: for each clip, whether it has a warning. These are taken first. The others are spread evenly over
    the data set, since wherever a list in the order of `n * GOLDEN % 1` is cut off, its numbers are.
    """
    return sorted(sorted(range(len(warned)), key=lambda n: (not warned[n], n * GOLDEN % 1))[:MOST_READ])


def _row(summary: ClipSummary, labels: Mapping[str, Any], foot_down: float | None) -> str:
    """A row of the table, with a cell for each column.

    foot_down: share of frames in which a heel or toe is on the ground; None if the clip was not read.
    """
    gaits = ", ".join(f"{gait} {s:.1f}" for gait, s in labels["seconds"].items() if s >= 0.05)
    difference = "not retargeted"
    if summary.largest_difference:
        joint, degrees = summary.largest_difference
        # The bar is full at 15 degrees, the mean difference above which a clip is refused.
        bar = f'<span class="bar"><i style="width:{min(100.0, degrees / 15 * 100):.0f}%"></i></span>'
        difference = f"{bar}{html.escape(joint)} {degrees:.0f}&deg;"
    remarks = html.escape("; ".join([*summary.warnings, *labels["warnings"]]))
    name = html.escape(summary.name) + (f"<br><small>{remarks}</small>" if remarks else "")
    picture, height, cadence, down = ("",) * 4
    if foot_down is not None:
        picture, down = '<canvas width="80" height="80"></canvas>', f"{100 * foot_down:.0f} %"
        height, cadence = f"{summary.hip_height:.0f}", f"{summary.cadence:.0f}"
    numbers = [f"{summary.fps:.4g}", f"{summary.seconds:.1f}", height, cadence, str(labels["cycles"]), down]
    texts = [name, picture, html.escape(summary.rig), gaits, difference]
    cells = [f"<td>{text}</td>" for text in texts] + [f'<td class="n">{number}</td>' for number in numbers]
    return f"<tr>{''.join(cells)}</tr>"


# Draws a clip beside the retargeted motion, as stick figures from the side and from the front.

PICTURES = 6  # poses of the clip in each row of the picture
COLOUR, WRONG = "#2b6cb0", "#d62828"  # of a bone, and of the bones that differ most


def draw_retargeting(
    picture: Path, bvh: Path, skeleton: Path, skeleton_folder: Path, options: ClipMotion
) -> None:
    """Draw a BVH file's motion and the result of retargeting into an SVG file.

    It is drawn even if the workflow refuses the result because it differs too much from the source. The joint
    or limb that differs most is red.

    skeleton: the file of the skeleton that gets the motion. skeleton_folder: the folder with all skeleton
    files, with which the rig of the BVH file is recognised. Raises InputError for a BVH file that cannot be
    read or that has this skeleton's bones already.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure  # here, because the import takes half a second

    target = load_skeleton(skeleton, skeleton.stem)
    source = load_source(read_motion(bvh, options.animation), target, skeleton_folder, options)
    result, scale, _, _ = fit_skeleton(source, target.skeleton, options)
    if scale is None:
        problem = f"already has the bones of {target.skeleton.name}, so there is no retargeting to draw"
        raise InputError(bvh, problem)
    before = resample(source.clip, options.fps)
    part, degrees = most_different(compare_motions(before, result))
    frames = np.linspace(0, min(len(before), len(result)) - 1, PICTURES).round().astype(int)
    figure = Figure(figsize=(1.6 * PICTURES, 12), layout="constrained")
    figure.suptitle(f"{before.name}: the {part} is {degrees:.0f} degrees off its source on average (red)")
    grid = figure.subplots(4, PICTURES, sharex=True, sharey=True)
    rows = [(view, name) for view in ("side", "front") for name in ("source", "result")]
    for (view, name), places in zip(rows, grid, strict=True):
        for place, frame in zip(places, frames, strict=True):
            _draw_figure(place, before if name == "source" else result, frame, view, part)
            place.set_title(f"{name}, from the {view}, {frame / result.fps:.1f} s", fontsize=7)
    with rc_context({"svg.fonttype": "none"}), atomic_path(picture) as temporary:
        figure.savefig(temporary, format="svg")


def _draw_figure(place: Any, clip: Clip, frame: int, view: str, part: str) -> None:
    """Draw a pose into axes of matplotlib. view: "side" or "front". part: the joint or limb in red."""
    skeleton, p = clip.skeleton, clip.positions[frame]
    ahead = facing_directions(skeleton, p[None], 0.0)[0]
    x = (p - p[skeleton.role("hips")]) @ (ahead if view == "side" else np.cross(UP, ahead))
    y = p[:, 1] - p[:, 1].min()
    side, _, name = part.partition(" ")
    ends = [role if role == "head" else f"{side}_{role}" for role in {**ANGLES, **BONES}[name]]
    red = path_between(skeleton.parents, skeleton.role(ends[0]), skeleton.role(ends[-1]))
    for j, parent in enumerate(skeleton.parents):
        if parent >= 0:
            colour, width = (WRONG, 3.5) if j in red and parent in red else (COLOUR, 1.8)
            place.plot(x[[parent, j]], y[[parent, j]], color=colour, linewidth=width)
    place.set_aspect("equal")
    place.set_axis_off()
