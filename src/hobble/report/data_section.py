"""The section on the data: gaits, speeds, turns, channel values, retargeting, files, repairs and labels."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import shown_names
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.retarget import MOST_DIFFERENCE, most_different
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, Column, Table, Trace, axis, format_bytes
from hobble.rows.clip_rows import row_count
from hobble.rows.excerpts import Excerpt, cut_into_excerpts, load_excerpt, shuffle_key
from hobble.rows.layout import GAITS

MOST_SHOWN = 150  # at most this many clips have label curves, a row in the table and views of their ground
MOST_COUNTED = 600  # at most this many clips are read to count how many seconds of data there are


def choose_clips(material: ReportMaterial, most: int = MOST_SHOWN) -> frozenset[str]:
    """Names of the clips that the page shows: all clips, or `most` of them if there are more.

    The clips are divided into kinds by split, by main gait, and by whether a channel (group of inputs of the
    network) is above 0 in them. In each round every kind gives one clip, until there are `most`. Which clip
    of its kind comes first is random, but depends only on the names.
    """
    with_values = {report["clip"] for report in material.channels if report.get("values")}
    kinds: dict[tuple[str, str, bool], list[str]] = {}
    for report in material.labels:
        clip, seconds = report["clip"], report.get("seconds") or {}
        gait = max(seconds, key=lambda name: seconds[name], default="")
        kinds.setdefault((material.split_of(clip), gait, clip in with_values), []).append(clip)
    if sum(map(len, kinds.values())) <= most:
        return frozenset(name for names in kinds.values() for name in names)
    candidates = [
        (turn, kind, name) for kind in kinds for turn, name in enumerate(sorted(kinds[kind], key=shuffle_key))
    ]
    return frozenset(name for *_, name in sorted(candidates)[:most])


def sample_files(paths: Sequence[str], most: int = MOST_COUNTED) -> list[str]:
    """At most `most` of the paths, drawn at random. paths: one file for each clip, called after the clip.

    The draw depends only on the names, so it is the same each time.
    """
    if len(paths) <= most:
        return list(paths)
    chosen = set(sorted((Path(path).stem for path in paths), key=shuffle_key)[:most])
    return [path for path in paths if Path(path).stem in chosen]


def files_of_clips(paths: Iterable[str], names: frozenset[str]) -> list[str]:
    """Those of the paths that belong to the clips `names`. paths: files called after their clips."""
    return [path for path in paths if Path(path).stem in names]


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
    `hobble.labels.clip_labels` returns, and

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


ROWS_PER_SECOND = 60.0  # of the clips' rows
SPEED_EDGES = np.arange(0, 6.01, 0.2)  # edges of the bins of speeds, metres a second
# Edges of the bins of turning speeds, degrees a second, positive to the left.
TURN_EDGES = np.arange(-220, 221, 20.0)
# Middles of the bins of channel values, in tenths of the channel's highest value.
TENTHS = np.arange(1, 11)
MOST_EXCERPTS = 600  # the frames of at most this many excerpts of clips are counted
# Split, its name on the page, the colour of its bars.
SPLIT_BARS = (("train", "training", "@muted"), ("held_out", "held out", "@accent"))


def seconds_of_data(
    paths: Sequence[str | Path], splits: Mapping[str, str], all_clips: int | None = None
) -> dict[str, Any]:
    """Seconds of data in the files `database/clips/<clip>.npz`.

    splits: clip -> "train" or "held_out". all_clips: if `paths` are a random choice of clips, the number of
    clips from which they were chosen. Then the seconds are an estimate for all of these.

    The result has `turns`: split -> seconds in each bin between two TURN_EDGES; `both`: seconds at each
    combination, (bins between TURN_EDGES, bins between SPEED_EDGES); `channels`: channel -> column -> seconds
    in each bin of TENTHS; `estimate`: a sentence that says which part of the data was read, empty if all was
    read. Turning speeds and speeds outside the bins count in the outermost bin. Channel values below half a
    tenth do not count.
    """
    chosen, share = _chosen_excerpts(paths)
    # Each frame that is read stands for this many seconds of data.
    weight = max(all_clips or 0, len(paths)) / max(len(paths), 1) / share / ROWS_PER_SECOND
    turns = {split: np.zeros(len(TURN_EDGES) - 1) for split, *_ in SPLIT_BARS}
    both = np.zeros((len(TURN_EDGES) - 1, len(SPEED_EDGES) - 1))
    channels: dict[str, dict[str, Array]] = {}
    for path, excerpt in chosen:
        rows = load_excerpt(path, excerpt)
        # A frame in which one gait cycle ends and the next begins has two rows. Only the first one counts.
        first_rows = np.unique(rows.frame, return_index=True)[1]
        y, layout = np.asarray(rows.y[first_rows], float), rows.layout
        speed = np.linalg.norm(y[:, layout.y_root_velocity], axis=1) * ROWS_PER_SECOND / 100
        # The column y_turn has the opposite sign: it is the turn of the world relative to the root.
        turn = np.degrees(-y[:, layout.y_turn][:, 0]) * ROWS_PER_SECOND
        speed = np.clip(speed, SPEED_EDGES[0], SPEED_EDGES[-1] - 1e-6)
        turn = np.clip(turn, TURN_EDGES[0], TURN_EDGES[-1] - 1e-6)
        turns[splits.get(rows.clip, "train")] += np.histogram(turn, TURN_EDGES)[0] * weight
        both += np.histogram2d(turn, speed, (TURN_EDGES, SPEED_EDGES))[0] * weight
        skeleton = Skeleton.from_dict(rows.skeleton)
        for name, table in rows.channels.items():
            definition, seconds = channel(name), channels.setdefault(name, {})
            for column, values in zip(definition.columns(skeleton), table[first_rows].T, strict=True):
                if values.any():
                    counts = np.histogram(10 * values / definition.highest, np.arange(0.5, 11))[0]
                    seconds[column] = seconds.get(column, 0) + counts * weight
    read = [f"{len(paths):,} of {all_clips:,} clips"] if all_clips and all_clips > len(paths) else []
    read += [f"{100 * share:.0f} % of their frames"] if share < 1 else []
    estimate = f" Estimated from {' and '.join(read)}." if read else ""
    return {"turns": turns, "both": both, "channels": channels, "estimate": estimate}


def _chosen_excerpts(paths: Sequence[str | Path]) -> tuple[list[tuple[str | Path, Excerpt]], float]:
    """The excerpts to read, each with the file of its clip: all, or MOST_EXCERPTS drawn at random.

    Also returns their share of all rows.
    """
    every = [
        (path, excerpt) for path in paths for excerpt in cut_into_excerpts(Path(path).stem, row_count(path))
    ]
    if len(every) <= MOST_EXCERPTS:
        return every, 1.0
    drawn = sorted(every, key=lambda pair: shuffle_key(f"{pair[1].clip} {pair[1].first}"))[:MOST_EXCERPTS]
    return drawn, sum(excerpt.rows for _, excerpt in drawn) / sum(excerpt.rows for _, excerpt in every)


def turn_chart(counted: Mapping[str, Any]) -> Chart | None:
    """A bar for each turning speed; None without data. counted: from `seconds_of_data`."""
    traces: list[Trace] = [
        {
            "type": "bar",
            "name": label,
            "x": _middles(TURN_EDGES),
            "y": np.round(counted["turns"][split], 3).tolist(),
            "marker": {"color": colour},
            "hovertemplate": "%{x}°/s: %{y:.1f} s<extra></extra>",
        }
        for split, label, colour in SPLIT_BARS
        if counted["turns"][split].any()
    ]
    if not traces:
        return None
    layout = {
        "barmode": "stack",
        "bargap": 0.08,
        "xaxis": axis("degrees per second (positive: to the left)"),
        "yaxis": axis("seconds", rangemode="tozero"),
    }
    caption = "Seconds of data at each turning speed. With mirrored clips, left and right are alike."
    return Chart("turns", "Turning speed", caption + counted["estimate"], traces, layout, 300)


def speed_turn_chart(counted: Mapping[str, Any]) -> Chart | None:
    """A cell for each combination of speed and turn; None without data. counted: from `seconds_of_data`."""
    both = counted["both"]
    if not both.any():
        return None
    speeds_shown = int(np.flatnonzero(both.any(axis=0)).max()) + 1
    trace = {
        "type": "heatmap",
        "x": _middles(SPEED_EDGES)[:speeds_shown],
        "y": _middles(TURN_EDGES),
        "z": [[v or None for v in row] for row in np.round(both[:, :speeds_shown], 3).tolist()],
        "colorscale": [[0, "@sunken"], [0.15, "@muted"], [1, "@accent"]],
        # Not the maximum: with one very full cell, all others would look alike.
        "zmax": float(np.percentile(both[both > 0], 95)),
        "zmin": 0,
        "colorbar": {"title": {"text": "s"}, "thickness": 10, "outlinewidth": 0},
        "hovertemplate": "%{x:.1f} m/s, %{y}°/s: %{z:.1f} s<extra></extra>",
    }
    layout = {"xaxis": axis("m/s"), "yaxis": axis("degrees per second", automargin=True)}
    estimate = counted["estimate"]
    caption = f"Seconds of data at each combination of speed and turn. {_empty_cells(estimate)}.{estimate}"
    return Chart("speed-turn", "Speed and turn combined", caption, [trace], layout, 300)


def channel_charts(counted: Mapping[str, Any], shown_name: Callable[[str], str] = str) -> list[Chart]:
    """A chart for each channel that has a value above 0 in any clip: seconds at each value of each column.

    counted: from `seconds_of_data`. shown_name: column -> its name on the page.
    """
    return [
        _channel_chart(name, seconds, counted["estimate"], shown_name)
        for name, seconds in counted["channels"].items()
        if seconds
    ]


def _channel_chart(
    name: str, seconds: Mapping[str, Array], estimate: str, shown_name: Callable[[str], str]
) -> Chart:
    """The chart of the channel `name`. seconds: column -> seconds in each bin of TENTHS."""
    definition, columns = channel(name), list(seconds)[::-1]
    tenth = definition.highest / 10
    trace = {
        "type": "heatmap",
        "x": np.round(TENTHS * tenth, 6).tolist(),
        "y": [shown_name(column) for column in columns],
        "z": [[round(float(v), 3) or None for v in seconds[column]] for column in columns],
        "colorscale": [[0, "@hurt-low"], [1, "@hurt-high"]],
        "xgap": 3,
        "ygap": 3,
        "colorbar": {"title": {"text": "s"}, "thickness": 10, "outlinewidth": 0},
        "hovertemplate": "%{y} at %{x}: %{z:.1f} s<extra></extra>",
    }
    across = axis(definition.value_word, dtick=tenth, range=[0.4 * tenth, 10.6 * tenth])
    caption = (
        f"Each cell has the seconds of data at one {definition.value_word}, including mirrored clips. "
        f"{_empty_cells(estimate)} and has to interpolate there.{estimate}"
    )
    title, height = f"{definition.title}: amount of data", 120 + 24 * len(columns)
    layout = {"xaxis": across, "yaxis": {"automargin": True}}
    return Chart(f"{name}-coverage", title, caption, [trace], layout, height)


def _empty_cells(estimate: str) -> str:
    """The beginning of a sentence on empty cells, without a full stop. estimate: from `seconds_of_data`.

    If only a part of the data was read, the rest may have data for a cell that is empty.
    """
    if estimate:
        return "Where a cell is empty, the network had little or no data to learn from"
    return "Where a cell is empty, the network had no data to learn from"


def _middles(edges: Array) -> list[float]:
    """The middle of each bin."""
    return np.round((edges[:-1] + edges[1:]) / 2, 3).tolist()
