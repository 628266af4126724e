"""Makes an HTML page on a data set before training: a line for each clip, with a small walking figure.

If there are very many clips, only a sample of them is read. The lines of the others show only what is in
their reports.
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
    same_notes,
    shared_warnings,
    standing_notes,
    summary_of_clip,
    summary_of_report,
)
from hobble.motion.root import facing

FRAMES, SECONDS = 40, 4.0  # frames of the small figure, and their duration, from the middle of the clip
# At most this many clips are read, and at most so many seconds of clips. They make a page of 10 MB in half a
# minute.
MOST_READ, MOST_SECONDS = 600, 5 * 3600.0
MOST_NOTES = 40  # at most this many notes on several clips, such as duplicates, are shown
LABELS = ("cycles", "seconds", "warnings")  # keys of a clip's labels that the page shows
GOLDEN = 0.6180339887498949  # golden ratio - 1; its multiples, modulo 1, are spread evenly
# Headings of the columns.
HEAD = (
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
    "furthest off",
)
STYLE = """body{font:14px/1.4 system-ui,sans-serif;margin:1.5em;color:#222;background:#fff}
table{border-collapse:collapse}th,td{padding:2px 9px;text-align:left;border-bottom:1px solid #e3e3e3}
th{position:sticky;top:0;background:#fff}td.n{text-align:right;font-variant-numeric:tabular-nums}
.bar{display:inline-block;width:75px;height:9px;background:#eee;margin-right:6px}
.bar i{display:block;height:100%;background:#4a7ab5}small,.note{color:#a04000}canvas{display:block}"""
# One timer draws all figures in view.
SCRIPT = """const D=JSON.parse(document.getElementById('d').textContent);
const C=[...document.querySelectorAll('canvas')];
const calm=matchMedia('(prefers-reduced-motion: reduce)').matches;
function draw(t){C.forEach((c,i)=>{const r=c.getBoundingClientRect();if(r.bottom<0||r.top>innerHeight)return;
const d=D[i],p=d.p[calm?0:Math.floor(t*d.f/1000)%d.p.length],g=c.getContext('2d');
g.clearRect(0,0,80,80);g.strokeStyle='#ccc';g.beginPath();g.moveTo(0,76);g.lineTo(80,76);g.stroke();
g.lineWidth=1.5;d.b.forEach(([a,b,s])=>{g.strokeStyle=['#444','#c0392b','#2471a3'][s];g.beginPath();
g.moveTo(p[2*a],p[2*a+1]);g.lineTo(p[2*b],p[2*b+1]);g.stroke()})});if(!calm)requestAnimationFrame(draw)}
if(calm)addEventListener('scroll',()=>draw(0));requestAnimationFrame(draw);"""


def figure(clip: Clip) -> dict[str, Any]:
    """A clip as a walk in place, seen from the side, in pixels of a picture of 80 x 80.

    p: for each frame, x and y of every joint. b: bones as (joint, joint, side), where side is 0 in the
    middle, 1 left and 2 right. f: frames a second.
    """
    long = min(len(clip), round(SECONDS * clip.fps))
    first = (len(clip) - long) // 2
    at = np.linspace(first, first + long - 1, min(FRAMES, long)).round().astype(int)
    p = clip.positions[at]
    ahead = facing(clip.skeleton, p, 0.0)
    along = np.sum((p - p[:, :1]) * ahead[:, None], axis=-1)
    tall = max(float(np.percentile(p[..., 1].max(axis=1), 90)), 1.0)
    pixels = np.stack([40 + 68 * along / tall, 76 - 68 * p[..., 1] / tall], axis=-1)
    bones = [(parent, j, _side(clip, j)) for j, parent in enumerate(clip.skeleton.parents) if parent >= 0]
    flat = np.clip(pixels, 0, 80).round(1).reshape(len(at), -1)
    return {"p": flat.tolist(), "b": bones, "f": round(len(at) * clip.fps / long, 2)}


def _side(clip: Clip, joint: int) -> int:
    name = clip.skeleton.joints[joint].lower()
    return 1 if "left" in name else 2 if "right" in name else 0


def foot_down(contacts: Array) -> float:
    """The share of frames in which a heel or toe is down. contacts: (F, 4), of both heels and toes."""
    return float((np.asarray(contacts) > 0.5).any(axis=1).mean())


@dataclass(frozen=True)
class _ClipLine:
    """A line of the page.

    look: summary of the clip. labels: the LABELS of the clip. figure: from the function `figure`. down: from
    `foot_down`. figure, down: None if the clip was not read.
    """

    look: ClipSummary
    labels: Mapping[str, Any]
    figure: dict[str, Any] | None = None
    down: float | None = None


def look_page(
    name: str,
    reports: Sequence[Mapping[str, Any]],
    labels: Sequence[Mapping[str, Any]],
    read: Callable[[int], tuple[Clip, Array]],
) -> str:
    """The page of data set `name` as one file.

    reports: `motion/<clip>.json` of each clip. labels: the keys LABELS of `labels/<clip>.json` of each clip.
    read: index of a clip -> the clip and its contacts (F, 4). It is called for the clips of `chosen`, one
    after another.
    """
    sample = chosen(reports, labels)
    lines = [
        _ClipLine(summary_of_report(report), labelled)
        for report, labelled in zip(reports, labels, strict=True)
    ]
    for n in sorted(sample):
        clip, contacts = read(n)
        lines[n] = _ClipLine(summary_of_clip(clip, reports[n]), labels[n], figure(clip), foot_down(contacts))
    looks, common = shared_warnings([line.look for line in lines])
    lines = [replace(line, look=look) for line, look in zip(lines, looks, strict=True)]
    whole = len(sample) == len(lines)
    notes = standing_notes(looks) if whole else [_sample_note(len(sample))]
    notes += [*common, *same_notes(looks)]
    if (more := len(notes) - MOST_NOTES) > 0:
        notes[MOST_NOTES:] = [f"And {more} more notes, most of them on duplicates."]
    return _written(name, lines, notes)


def chosen(reports: Sequence[Mapping[str, Any]], labels: Sequence[Mapping[str, Any]]) -> list[int]:
    """Indices of the clips that are read for the page: all of them, or a sample if there are very many.

    Clips with warnings come first, up to half of MOST_READ. The others are spread evenly over the list. At
    least one clip is chosen, if there are any.
    """
    warned = [
        bool(summary_of_report(report).warnings or labelled["warnings"])
        for report, labelled in zip(reports, labels, strict=True)
    ]
    # In this order, the first n numbers are spread evenly for every n.
    spread = sorted(range(len(reports)), key=lambda n: n * GOLDEN % 1)
    first, rest = ([n for n in spread if warned[n] is which] for which in (True, False))
    out: list[int] = []
    seconds = 0.0
    for n in [*first[: MOST_READ // 2], *rest, *first[MOST_READ // 2 :]][:MOST_READ]:
        seconds += reports[n]["seconds"]
        if out and seconds > MOST_SECONDS:
            break
        out.append(n)
    return out


def _sample_note(count: int) -> str:
    return (
        f"To keep this page small, only {count} clips were read, those with warnings first. Only these have "
        "a figure and all numbers, and were compared with each other to find duplicates."
    )


def _written(name: str, lines: Sequence[_ClipLine], notes: Sequence[str]) -> str:
    """The page of lines and notes."""
    seconds = sum(line.look.seconds for line in lines)
    figures = [line.figure for line in lines if line.figure is not None]
    data = json.dumps(figures, separators=(",", ":"))
    title = html.escape(name)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"<h1>{title}</h1><p>{len(lines)} clips, {seconds:.0f} s. Left is red, right is blue.</p>"
        + "".join(f'<p class="note">{html.escape(note)}</p>' for note in notes)
        + f"<table><thead><tr>{''.join(f'<th>{head}</th>' for head in HEAD)}</tr></thead>"
        + f"<tbody>{''.join(_row(line) for line in lines)}</tbody></table>"
        + f'<script type="application/json" id="d">{data}</script><script>{SCRIPT}</script></html>\n'
    )


def _row(line: _ClipLine) -> str:
    look, labels = line.look, line.labels
    gaits = ", ".join(f"{gait} {s:.1f}" for gait, s in labels["seconds"].items() if s >= 0.05)
    off = "as it is"
    if look.off:
        joint, degrees = look.off
        bar = f'<span class="bar"><i style="width:{min(100.0, degrees / 15 * 100):.0f}%"></i></span>'
        off = f"{bar}{html.escape(joint)} {degrees:.0f}&deg;"
    remarks = "; ".join([*look.warnings, *labels["warnings"]])
    name = html.escape(look.name) + (f"<br><small>{html.escape(remarks)}</small>" if remarks else "")
    picture, measured, down = "", ["", ""], ""
    if line.down is not None:
        picture = '<canvas width="80" height="80"></canvas>'
        measured, down = [f"{look.hips:.0f}", f"{look.cadence:.0f}"], f"{100 * line.down:.0f} %"
    numbers = [f"{look.fps:.4g}", f"{look.seconds:.1f}", *measured, str(labels["cycles"])]
    cells = "".join(f'<td class="n">{value}</td>' for value in numbers)
    return (
        f"<tr><td>{name}</td><td>{picture}</td>"
        f"<td>{html.escape(look.rig)}</td>{cells}<td>{html.escape(gaits)}</td>"
        f'<td class="n">{down}</td><td>{off}</td></tr>'
    )
