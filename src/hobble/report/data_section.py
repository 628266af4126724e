"""Charts and tables for the section on the data: gaits, speeds, retargeting, files, repairs and labels."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from hobble.channels.shown import shown_names
from hobble.motion.check_retarget import MOST_DIFFERENCE, most_different
from hobble.report.charts import Chart, Trace, axis
from hobble.report.formats import format_bytes
from hobble.report.gather import ReportMaterial
from hobble.report.tables import Column, Table
from hobble.rows.layout import GAITS

MOST_BARS = 200  # the chart of retargeted clips has at most this many bars
MOST_REMARKS = 500  # the table of repairs, doubts and warnings has at most this many rows
MOST_NAMED = 30  # if the chart of retargeted clips has more bars than this, none has a name under it
SPLIT_NAMES = {"train": "training", "held_out": "held out"}


def gait_chart(material: ReportMaterial) -> Chart | None:
    """Seconds of each gait, in training clips and held-out clips; None without labels."""
    traces: list[Trace] = []
    for split, colour in (("train", "@muted"), ("held_out", "@accent")):
        totals = dict.fromkeys(GAITS, 0.0)
        for report in material.labels:
            if material.split_of(report["clip"]) == split:
                for gait, seconds in (report.get("seconds") or {}).items():
                    totals[gait] = totals.get(gait, 0.0) + seconds
        if any(totals.values()):
            traces.append(
                {
                    "type": "bar",
                    "name": SPLIT_NAMES[split],
                    "x": list(totals),
                    "y": list(totals.values()),
                    "marker": {"color": colour},
                    "hovertemplate": "%{x}: %{y:.1f} s<extra></extra>",
                }
            )
    if not traces:
        return None
    caption = (
        "Seconds of each gait, including mirrored clips. The network learns little of a gait with a low bar."
    )
    layout = {"barmode": "stack", "xaxis": {"type": "category"}, "yaxis": axis("seconds", rangemode="tozero")}
    return Chart("gaits", "Seconds of each gait", caption, traces, layout, 300)


def speed_chart(material: ReportMaterial) -> Chart | None:
    """Seconds at each speed over the ground, from the speed curves of the label reports; None without any."""
    edges = np.arange(0, 6.01, 0.2)
    traces: list[Trace] = []
    for split, colour in (("train", "@muted"), ("held_out", "@accent")):
        seconds = np.zeros(len(edges) - 1)
        for report in material.labels:
            curves = report.get("curves") or {}
            speed = [v for v in curves.get("speed") or () if v is not None]
            if speed and material.split_of(report["clip"]) == split:
                counts, _ = np.histogram(np.clip(speed, 0, edges[-1] - 1e-6), edges)
                # A curve may have fewer points than frames. Each stands for an equal part of the clip.
                seconds += counts / len(speed) * curves["seconds"][-1]
        if seconds.any():
            traces.append(
                {
                    "type": "bar",
                    "name": SPLIT_NAMES[split],
                    "x": np.round((edges[:-1] + edges[1:]) / 2, 2).tolist(),
                    "y": np.round(seconds, 3).tolist(),
                    "marker": {"color": colour},
                    "hovertemplate": "%{x:.1f} m/s: %{y:.1f} s<extra></extra>",
                }
            )
    if not traces:
        return None
    highest_speed = max(x for t in traces for x, y in zip(t["x"], t["y"], strict=True) if y)
    layout = {
        "barmode": "stack",
        "bargap": 0.08,
        "xaxis": axis("m/s", range=[0, highest_speed + 0.3]),
        "yaxis": axis("seconds", rangemode="tozero"),
    }
    caption = "Seconds at each speed. Where there is little or no data, the network has to interpolate."
    return Chart("speeds", "Speed over the ground", caption, traces, layout, 300)


def retarget_chart(material: ReportMaterial) -> Chart | None:
    """A bar for each retargeted clip; None if no clip was retargeted.

    Each bar stands for the joint or limb that differs most from the clip's file. Its height is that
    difference in degrees.
    A mirrored clip has no bar if the clip that it mirrors is in the data set.
    """
    names = {report["clip"] for report in material.motion}
    bars = []
    for report in material.motion:
        clip, differences = report["clip"], report.get("retarget")
        if differences and not (clip.endswith("_mirror") and clip.removesuffix("_mirror") in names):
            bars.append((*most_different(differences), clip))
    if not bars:
        return None
    bars.sort(key=lambda bar: -bar[1])  # a bar is (joint or limb, degrees, clip)
    total, bars = len(bars), bars[:MOST_BARS]
    trace: Trace = {
        "type": "bar",
        "x": [clip for _, _, clip in bars],
        "y": [degrees for _, degrees, _ in bars],
        "text": [joint for joint, _, _ in bars],
        "textposition": "none",
        "marker": {"color": "@muted"},
        "hovertemplate": "%{x}: %{text} differs by %{y:.1f} degrees<extra></extra>",
    }
    layout = {
        "showlegend": False,
        "xaxis": {"type": "category", "showticklabels": len(bars) <= MOST_NAMED},
        "yaxis": axis("difference, degrees", rangemode="tozero"),
    }
    caption = (
        "These clips were retargeted to the skeleton of the data set. In each clip, one joint or limb "
        "differs most from the file. The bar shows by how many degrees, on average over the clip. Clips with "
        f"more than {MOST_DIFFERENCE:.0f} degrees are refused."
    )
    if total > len(bars):
        caption += f" The chart shows the {len(bars)} of {total:,} clips that differ most."
    return Chart(
        "retarget", "Difference between retargeted clips and their files", caption, [trace], layout, 220
    )


def clip_table(material: ReportMaterial, clips: frozenset[str]) -> Table:
    """A row for each of `clips`: split, file, length, labels and checksum."""
    labels = {report["clip"]: report for report in material.labels}
    columns = [
        Column("clip"),
        Column("split", lambda value: SPLIT_NAMES.get(value, value)),
        Column("file"),
        Column.count("frames"),
        Column.number("source fps", 4),
        Column.number("seconds", 4),
        Column.count("cycles"),
        Column("labels from"),
        Column("size", lambda v: format_bytes(float(v)), "n"),
        Column("SHA-256", lambda v: str(v)[:12], "hash"),
    ]
    rows = []
    for report in material.motion:
        if report["clip"] not in clips:
            continue
        label = labels.get(report["clip"], {})
        rows.append(
            [
                report["clip"],
                material.split_of(report["clip"]),
                report.get("source"),
                report.get("frames"),
                report.get("source_fps"),
                report.get("seconds"),
                label.get("cycles"),
                label.get("phase_source"),
                report.get("bytes"),
                report.get("sha256"),
            ]
        )
    total = len(material.motion)
    which = (
        f"All {total} clips"
        if len(rows) == total
        else f"{len(rows)} of {total:,} clips (more would make the page slow)"
    )
    return Table(f"{material.name}-clips", columns, rows, f"{which}, with checksums")


def remarks_table(material: ReportMaterial) -> Table | None:
    """A row for each repair, doubt and warning; None without any.

    If there are more than MOST_REMARKS, there is a row for each kind of message instead, with the number of
    its clips and an example. Messages of one kind differ only in numbers.
    """
    rows = []
    for stage, reports, key in (
        ("motion", material.motion, "repairs"),
        ("motion", material.motion, "unsure"),
        ("labels", material.labels, "warnings"),
        (None, material.channels, "warnings"),
    ):
        for report in reports:
            rows += [
                [report["clip"], stage or report["channel"], sentence] for sentence in report.get(key) or ()
            ]
    if not rows:
        return None
    columns = [Column("clip"), Column("stage"), Column("message", kind="long")]
    title = f"{len(rows):,} messages on repairs, doubts and warnings"
    if len(rows) <= MOST_REMARKS:
        return Table(f"{material.name}-remarks", columns, rows, title)
    columns = [Column.count("clips"), Column("stage"), Column("example"), Column("message", kind="long")]
    return Table(f"{material.name}-remarks", columns, _by_kind(rows), f"{title}, by kind")


def _by_kind(rows: list[list[str]]) -> list[list[Any]]:
    """A row for each kind of message, most frequent first. Messages of one kind differ only in numbers.

    rows: (clip, stage, message). A row of the result has the number of clips, the stage, the first clip, and
    the message of the first clip.
    """
    kinds: dict[tuple[str, str], list[list[str]]] = {}
    for row in rows:
        kinds.setdefault((row[1], re.sub(r"[0-9][0-9.,:/-]*", "0", row[2])), []).append(row)
    frequent = sorted(kinds.values(), key=len, reverse=True)[:MOST_REMARKS]
    return [[len({row[0] for row in kind}), kind[0][1], kind[0][0], kind[0][2]] for kind in frequent]


def clip_strips(material: ReportMaterial, clips: frozenset[str]) -> list[dict[str, Any]]:
    """Data for the strips. A strip is a chart of one clip over time: label curves and channel values.

    clips: names of the clips to show. Clips without label curves are left out, and mirrored clips if the clip
    that they mirror is in the data set. A strip has the keys that `make_label_picture` of
    `hobble.labels.label_picture` returns, and

    - `clip`: its name. `length`: seconds
    - `channels`: a dict for each column with a value above 0. Its keys are `name`; `spans`, the stretches
      above 0 as [start in seconds, end in seconds, largest value]; `highest`, the largest value that the
      channel allows, such as 10. Spans are read from `spells` of the column's entry in the channel report.
      Without `spells` there is one span, the whole clip
    """
    # Clip -> column -> (its entry in the channel report, largest value that the channel allows). An entry's
    # own `highest` is the largest value of the column in this clip.
    channels_of: dict[str, dict[str, Any]] = {}
    for report in material.channels:
        channel_highest = report.get("highest", 10.0)
        values = {column: (entry, channel_highest) for column, entry in report["values"].items()}
        channels_of.setdefault(report["clip"], {}).update(values)
    shown_name = shown_names(material.network["skeleton"])
    lengths = {report["clip"]: report.get("seconds") for report in material.motion}
    labelled = {report["clip"] for report in material.labels}
    out = []
    for report in material.labels:
        curves, clip = report.get("curves"), report["clip"]
        mirrored = clip.endswith("_mirror") and clip.removesuffix("_mirror") in labelled
        if clip not in clips or mirrored or not curves or not curves.get("seconds"):
            continue
        length = lengths.get(clip) or curves["seconds"][-1]
        channel_values = [
            {
                "name": shown_name(column),
                "spans": entry.get("spells") or [[0, length, entry["highest"]]],
                "highest": channel_highest,
            }
            for column, (entry, channel_highest) in channels_of.get(clip, {}).items()
        ]
        out.append({**curves, "clip": clip, "length": length, "channels": channel_values})
    return out
