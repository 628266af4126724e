"""The section on the data: gaits, speeds, turns, channel values, retargeting, files, repairs and labels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.messages import group_messages
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.retarget import MOST_DIFFERENCE, most_different
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, Column, Table, axis, bar_trace
from hobble.rows.clip_rows import ClipRows, cut_into_excerpts, load_excerpt, row_count, shuffle_key
from hobble.rows.layout import GAITS

MOST_SHOWN = 150  # the terrain of at most this many clips is shown
MOST_ROWS = 2000  # the table of clips has at most this many rows
MOST_COUNTED = 600  # at most this many clips are read to count how many seconds of data there are
MOST_REMARKS = 500  # the table of doubts, warnings and repairs has at most this many rows
# Split, its name on the page, the colour of its bars.
SPLITS = (("train", "training", "@muted"), ("held_out", "held out", "@accent"))
SPLIT_WORDS = {split: words for split, words, _ in SPLITS}
SPEED_EDGES = np.arange(0, 6.01, 0.2)  # edges of the bins of speeds, metres a second
TURN_EDGES = np.arange(-220, 221, 20.0)  # of turning speeds, degrees a second, positive to the left
TENTHS = np.arange(1, 11)  # middles of the bins of channel values, in tenths of the channel's highest value


def some_clips(names: Iterable[str], most: int) -> frozenset[str]:
    """`most` of the clips, drawn at random; all if there are no more.

    So the size of the page does not grow with the data set. The draw depends only on the names.
    """
    return frozenset(sorted(names, key=shuffle_key)[:most])


def some_files(paths: Sequence[str], most: int) -> list[str]:
    """The files of `some_clips`. paths: one file for each clip, called after the clip."""
    chosen = some_clips((Path(path).stem for path in paths), most)
    return [path for path in paths if Path(path).stem in chosen]


def seconds_of_data(paths: Sequence[str], splits: Mapping[str, str]) -> dict[str, Any]:
    """Seconds of data in the files `database/clips/<clip>.npz`.

    splits: clip -> "train" or "held_out". If there are more than MOST_COUNTED clips, some are read, and the
    seconds are an estimate for all.

    The result has `both`: split -> seconds at each combination, (bins between two TURN_EDGES, bins between
    two SPEED_EDGES); `channels`: channel -> column -> seconds in each bin of TENTHS; `estimate`: a sentence
    that says which part of the data was read, empty if all was read. Turning speeds and speeds outside the
    bins count in the outermost bin. Channel values below half a tenth do not count.
    """
    read_paths = some_files(paths, MOST_COUNTED)
    # Each frame that is read stands for this many seconds of data. The clips have 60 frames a second.
    weight = len(paths) / max(len(read_paths), 1) / 60
    both = {split: np.zeros((len(TURN_EDGES) - 1, len(SPEED_EDGES) - 1)) for split in SPLIT_WORDS}
    channels: dict[str, dict[str, Array]] = {}
    for rows in _in_pieces(read_paths):
        # A frame in which one gait cycle ends and the next begins has two rows. Only the first one counts.
        first_rows = np.unique(rows.frame, return_index=True)[1]
        y, layout = np.asarray(rows.y[first_rows], float), rows.layout
        speed = np.linalg.norm(y[:, layout.y_root_velocity], axis=1) * 60 / 100
        # The column y_turn has the opposite sign: it is the turn of the world relative to the root.
        turn = np.degrees(-y[:, layout.y_turn][:, 0]) * 60
        speed = np.clip(speed, SPEED_EDGES[0], SPEED_EDGES[-1] - 1e-6)
        turn = np.clip(turn, TURN_EDGES[0], TURN_EDGES[-1] - 1e-6)
        counts = np.histogram2d(turn, speed, (TURN_EDGES, SPEED_EDGES))[0]
        both[splits.get(rows.clip, "train")] += counts * weight
        skeleton = Skeleton.from_dict(rows.skeleton)
        for name, table in rows.channels.items():
            definition, seconds = channel(name), channels.setdefault(name, {})
            for column, values in zip(definition.columns(skeleton), table[first_rows].T, strict=True):
                if values.any():
                    counts = np.histogram(10 * values / definition.highest, np.arange(0.5, 11))[0]
                    seconds[column] = seconds.get(column, 0) + counts * weight
    some = len(read_paths) < len(paths)
    estimate = f" Estimated from {len(read_paths):,} of {len(paths):,} clips." if some else ""
    return {"both": both, "channels": channels, "estimate": estimate}


def _in_pieces(paths: Iterable[str]) -> Iterator[ClipRows]:
    """The rows of the clips, a long clip in pieces, so that they need little memory."""
    for path in paths:
        for excerpt in cut_into_excerpts(Path(path).stem, row_count(path)):
            yield load_excerpt(path, excerpt)


def gait_chart(material: ReportMaterial) -> Chart | None:
    """Seconds of each gait, in training clips and held-out clips; None without labels."""
    totals = {split: dict.fromkeys(GAITS, 0.0) for split, *_ in SPLITS}
    for report in material.labels:
        of_split = totals[material.split_of(report["clip"])]
        for gait, seconds in (report.get("seconds") or {}).items():
            of_split[gait] += seconds
    traces = [
        bar_trace(label, GAITS, list(totals[split].values()), colour, "%{x}: %{y:.1f} s<extra></extra>")
        for split, label, colour in SPLITS
        if any(totals[split].values())
    ]
    layout = {"barmode": "stack", "yaxis": axis("seconds", rangemode="tozero"), "xaxis": {"type": "category"}}
    caption = (
        "Seconds of each gait, including mirrored clips. The network learns little of a gait with a low bar."
    )
    return Chart("gaits", "Seconds of each gait", caption, traces, layout, 300) if traces else None


def speed_and_turn_chart(counted: Mapping[str, Any]) -> Chart | None:
    """Seconds at each combination of speed and turning speed. counted: from `seconds_of_data`."""
    speeds, turns, both = _middles(SPEED_EDGES), _middles(TURN_EDGES), sum(counted["both"].values())
    if not both.any():
        return None
    shown = int(np.flatnonzero(both.any(axis=0)).max()) + 1  # number of bins of speeds
    trace = {
        **_heat_trace(speeds[:shown], turns, both[:, :shown]),
        "colorscale": [[0, "@sunken"], [0.15, "@muted"], [1, "@accent"]],
        # Not the maximum: with one very full cell, all others would look alike.
        "zmax": float(np.percentile(both[both > 0], 95)),
        "zmin": 0,
        "hovertemplate": "%{x:.1f} m/s, %{y}°/s: %{z:.1f} s<extra></extra>",
    }
    turning = axis("degrees per second (positive: to the left)", automargin=True)
    layout, estimate = {"xaxis": axis("m/s"), "yaxis": turning}, counted["estimate"]
    caption = f"Seconds of data at each combination of speed and turn. {_empty_cells(estimate)}.{estimate}"
    return Chart("speed-turn", "Speed and turn", caption, [trace], layout, 300)


def channel_charts(counted: Mapping[str, Any], shown_name: Callable[[str], str] = str) -> list[Chart]:
    """A chart for each channel that has a value above 0 in any clip: seconds at each value of each column.

    counted: from `seconds_of_data`. shown_name: column -> its name on the page.
    """
    charts, estimate = [], counted["estimate"]
    for name, seconds in counted["channels"].items():
        if not seconds:
            continue
        definition, columns = channel(name), list(seconds)[::-1]
        tenth = definition.highest / 10
        x, y = np.round(TENTHS * tenth, 6).tolist(), [shown_name(column) for column in columns]
        trace = {
            **_heat_trace(x, y, np.array([seconds[column] for column in columns])),
            "colorscale": [[0, "@hurt-low"], [1, "@hurt-high"]],
            "xgap": 3,
            "ygap": 3,
            "hovertemplate": "%{y} at %{x}: %{z:.1f} s<extra></extra>",
        }
        across = axis(definition.value_word, dtick=tenth, range=[0.4 * tenth, 10.6 * tenth])
        caption = (
            f"Each cell has the seconds of data at one {definition.value_word}, including mirrored clips. "
            f"{_empty_cells(estimate)} and has to interpolate there.{estimate}"
        )
        title, height = f"{definition.title}: amount of data", 120 + 24 * len(columns)
        layout = {"xaxis": across, "yaxis": {"automargin": True}}
        charts.append(Chart(f"{name}-coverage", title, caption, [trace], layout, height))
    return charts


def _heat_trace(x: Sequence, y: Sequence, seconds: Array) -> dict[str, Any]:
    """A heatmap of seconds, (len(y), len(x)). Cells without data are empty."""
    cells = [[value or None for value in row] for row in np.round(seconds, 3).tolist()]
    bar = {"title": {"text": "s"}, "thickness": 10, "outlinewidth": 0}
    return {"type": "heatmap", "x": x, "y": y, "z": cells, "colorbar": bar}


def _empty_cells(estimate: str) -> str:
    """The beginning of a sentence on empty cells, without a full stop. estimate: from `seconds_of_data`.

    If only a part of the data was read, the rest may have data for a cell that is empty.
    """
    amount = "little or no" if estimate else "no"
    return f"Where a cell is empty, the network had {amount} data to learn from"


def _middles(edges: Array) -> list[float]:
    """The middle of each bin."""
    return np.round((edges[:-1] + edges[1:]) / 2, 3).tolist()


def clip_table(material: ReportMaterial) -> Table:
    """A row for each clip: split, file, length, labels, difference from its file, and checksum.

    Clips that were retargeted and differ most from their files come first.
    """
    columns = {
        "clip": Column("clip"),
        "split": Column("split", lambda value: SPLIT_WORDS.get(value, value)),
        "source": Column("file"),
        "frames": Column.count("frames"),
        "source_fps": Column.number("source fps", 4),
        "seconds": Column.number("seconds", 4),
        "cycles": Column.count("cycles"),
        "phase_source": Column("labels from"),
        "bytes": Column.size("size"),
        "sha256": Column("SHA-256", lambda v: str(v)[:12], "hash"),
    }
    labels = {report["clip"]: report for report in material.labels}
    shown, records = some_clips((report["clip"] for report in material.motion), MOST_ROWS), []
    for report in material.motion:
        if report["clip"] not in shown:
            continue
        record = {**labels.get(report["clip"], {}), **report, "split": material.split_of(report["clip"])}
        if report.get("retarget"):
            record["joint"], record["degrees"] = most_different(report["retarget"])
        records.append(record)
    if any("degrees" in record for record in records):
        columns["degrees"] = Column.number(
            f"retargeting: largest difference, degrees (refused from {MOST_DIFFERENCE:.0f})"
        )
        columns["joint"] = Column("joint or limb that differs most")
    records.sort(key=lambda record: -record.get("degrees", 0.0))
    total = len(material.motion)
    which = f"All {total:,} clips" if len(records) == total else f"{len(records):,} of {total:,} clips"
    return Table.of(f"{material.name}-clips", columns, records, f"{which}, with checksums")


def remarks_table(material: ReportMaterial) -> Table | None:
    """A row for each kind of doubt, warning and repair, doubts first; None without any."""
    messages = [
        (report["clip"], stage or report["channel"], sentence)
        for stage, reports, key in (
            ("doubt", material.motion, "unsure"),
            ("labels", material.labels, "warnings"),
            (None, material.channels, "warnings"),
            ("repair", material.motion, "repairs"),
        )
        for report in reports
        for sentence in report.get(key) or ()
    ]
    if not messages:
        return None
    columns = [Column.count("clips"), Column("stage"), Column("example"), Column("message", kind="long")]
    rows = [
        [len(group.clips), group.stage, group.clips[0], group.message] for group in group_messages(messages)
    ]
    title = f"{len(messages):,} messages on doubts, warnings and repairs, by kind"
    return Table(f"{material.name}-remarks", columns, rows[:MOST_REMARKS], title)
