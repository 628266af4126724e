"""Makes an HTML page about a data set before training: a line for each clip, with a small walking figure.

If there are very many clips, only some of them are read. The lines of the others show only what is in their
reports and labels.
"""

from __future__ import annotations

import html
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.look import (
    ClipSummary,
    duplicate_notes,
    shared_warnings,
    standing_notes,
    summary_of_clip,
    summary_of_report,
)
from hobble.motion.root import facing_directions

FRAMES, SECONDS = 40, 4.0  # the small figure shows up to 40 frames from the middle 4 seconds of its clip
# Limits for the clips that are read: how many, and their length in seconds. Clips at these limits make a page
# of 10 MB in half a minute.
MOST_READ, MOST_SECONDS = 600, 5 * 3600.0
MOST_NOTES = 40  # at most this many notes above the table are shown, such as notes on duplicates
LABELS = ("cycles", "seconds", "warnings")  # keys of `labels/<clip>.json` that the page shows
GOLDEN = 0.6180339887498949  # golden ratio - 1; its multiples, modulo 1, are spread evenly over 0..1
COLUMNS = (
    "clip",
    "",
    "rig",
    "fps",
    "s",
    "hips, cm",
    "steps/min",
    "cycles",
    "gait, s",
    "foot down",
    "largest difference",
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
    bones = [(parent, j, _side(clip, j)) for j, parent in enumerate(clip.skeleton.parents) if parent >= 0]
    flat = np.clip(pixels, 0, 80).round(1).reshape(len(frames), -1)
    return {"p": flat.tolist(), "b": bones, "f": round(len(frames) * clip.fps / shown, 2)}


def _side(clip: Clip, joint: int) -> int:
    """1 for a joint on the left, 2 on the right, 0 in the middle, by its name."""
    name = clip.skeleton.joints[joint].lower()
    return 1 if "left" in name else 2 if "right" in name else 0


def foot_down_share(contacts: Array) -> float:
    """The share of frames in which a heel or toe is on the ground.

    contacts: (F, 4), whether each of both heels and toes is on the ground (1 or 0).
    """
    return float((np.asarray(contacts) > 0.5).any(axis=1).mean())


@dataclass(frozen=True)
class _ClipLine:
    """What the page shows about a clip.

    labels: the values of LABELS for the clip. figure: the result of `make_figure`. foot_down: the result of
    `foot_down_share`. Both are None if the clip was not read.
    """

    summary: ClipSummary
    labels: Mapping[str, Any]
    figure: dict[str, Any] | None = None
    foot_down: float | None = None


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
    chosen = choose_clips(reports, labels)
    lines = [
        _ClipLine(summary_of_report(report), labelled)
        for report, labelled in zip(reports, labels, strict=True)
    ]
    for n in sorted(chosen):
        clip, contacts = read(n)
        summary = summary_of_clip(clip, reports[n])
        lines[n] = _ClipLine(summary, labels[n], make_figure(clip), foot_down_share(contacts))
    summaries, common = shared_warnings([line.summary for line in lines])
    lines = [replace(line, summary=summary) for line, summary in zip(lines, summaries, strict=True)]
    # Only if all clips were read is it certain that nobody stands in them.
    all_read = len(chosen) == len(lines)
    notes = standing_notes(summaries) if all_read else [_sample_note(len(chosen))]
    notes += [*common, *duplicate_notes(summaries)]
    if (more := len(notes) - MOST_NOTES) > 0:
        notes[MOST_NOTES:] = [f"And {more} more notes, most of them on duplicates."]
    return _html(name, lines, notes)


def choose_clips(reports: Sequence[Mapping[str, Any]], labels: Sequence[Mapping[str, Any]]) -> list[int]:
    """Indices of the clips that are read for the page: all of them, or some if there are very many.

    Clips with warnings are taken first, until they are half of MOST_READ. Then clips without warnings are
    taken, and last any further clips with warnings. The clips of each group are spread evenly over the data
    set. If there is any clip, at least one is taken.

    reports, labels: as for `look_page`.
    """
    warned = [
        bool(summary_of_report(report).warnings or labelled["warnings"])
        for report, labelled in zip(reports, labels, strict=True)
    ]
    # Wherever a list in this order is cut off, the numbers before the cut are spread evenly.
    spread = sorted(range(len(reports)), key=lambda n: n * GOLDEN % 1)
    with_warning, without = ([n for n in spread if warned[n] is which] for which in (True, False))
    half = MOST_READ // 2
    out: list[int] = []
    seconds = 0.0
    for n in [*with_warning[:half], *without, *with_warning[half:]][:MOST_READ]:
        seconds += reports[n]["seconds"]
        if out and seconds > MOST_SECONDS:
            break
        out.append(n)
    return out


def _sample_note(count: int) -> str:
    return (
        f"To keep this page small, only {count} clips were read, clips with warnings first. Only the clips "
        "that were read have a figure and all numbers. Duplicates were searched only among them."
    )


def _html(name: str, lines: Sequence[_ClipLine], notes: Sequence[str]) -> str:
    """The text of the page: the notes, then a table of the lines."""
    seconds = sum(line.summary.seconds for line in lines)
    figures = [line.figure for line in lines if line.figure is not None]
    data = json.dumps(figures, separators=(",", ":"))
    title = html.escape(name)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"<h1>{title}</h1><p>{len(lines)} clips, {seconds:.0f} s. Left is red, right is blue.</p>"
        + "".join(f'<p class="note">{html.escape(note)}</p>' for note in notes)
        + f"<table><thead><tr>{''.join(f'<th>{column}</th>' for column in COLUMNS)}</tr></thead>"
        + f"<tbody>{''.join(_row(line) for line in lines)}</tbody></table>"
        + f'<script type="application/json" id="d">{data}</script><script>{SCRIPT}</script></html>\n'
    )


def _row(line: _ClipLine) -> str:
    """A row of the table, with a cell for each of COLUMNS."""
    summary, labels = line.summary, line.labels
    gaits = ", ".join(f"{gait} {s:.1f}" for gait, s in labels["seconds"].items() if s >= 0.05)
    difference = "not retargeted"
    if summary.largest_difference:
        joint, degrees = summary.largest_difference
        # The bar is full at 15 degrees, the mean difference above which a clip is refused.
        bar = f'<span class="bar"><i style="width:{min(100.0, degrees / 15 * 100):.0f}%"></i></span>'
        difference = f"{bar}{html.escape(joint)} {degrees:.0f}&deg;"
    remarks = "; ".join([*summary.warnings, *labels["warnings"]])
    name = html.escape(summary.name) + (f"<br><small>{html.escape(remarks)}</small>" if remarks else "")
    # These cells stay empty if the clip was not read.
    picture, measured_cells, foot_down = "", ["", ""], ""
    if line.foot_down is not None:
        picture = '<canvas width="80" height="80"></canvas>'
        measured_cells = [f"{summary.hip_height:.0f}", f"{summary.cadence:.0f}"]
        foot_down = f"{100 * line.foot_down:.0f} %"
    numbers = [f"{summary.fps:.4g}", f"{summary.seconds:.1f}", *measured_cells, str(labels["cycles"])]
    cells = "".join(f'<td class="n">{value}</td>' for value in numbers)
    return (
        f"<tr><td>{name}</td><td>{picture}</td>"
        f"<td>{html.escape(summary.rig)}</td>{cells}<td>{html.escape(gaits)}</td>"
        f'<td class="n">{foot_down}</td><td>{difference}</td></tr>'
    )
