"""Counts the seconds of data at each speed, turning speed and channel value, and draws charts of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.measures.stratified_sample import shuffle_key
from hobble.report.charts import Chart, Trace, axis
from hobble.rows.clip_rows import row_count
from hobble.rows.excerpts import Excerpt, cut_into_excerpts, load_excerpt

FPS = 60.0  # of the clips' rows
SPEED_EDGES = np.arange(0, 6.01, 0.2)  # edges of the bins of speeds, metres a second
# Edges of the bins of turning speeds, degrees a second, positive to the left.
TURN_EDGES = np.arange(-220, 221, 20.0)
# Middles of the bins of channel values, in tenths of the channel's highest value.
TENTHS = np.arange(1, 11)
MOST_EXCERPTS = 600  # the frames of at most this many excerpts of clips are counted
# Split, its name on the page, the colour of its bars.
SPLITS = (("train", "training", "@muted"), ("held_out", "held out", "@accent"))


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
    weight = max(all_clips or 0, len(paths)) / max(len(paths), 1) / share / FPS
    turns = {split: np.zeros(len(TURN_EDGES) - 1) for split, *_ in SPLITS}
    both = np.zeros((len(TURN_EDGES) - 1, len(SPEED_EDGES) - 1))
    channels: dict[str, dict[str, Array]] = {}
    for path, excerpt in chosen:
        rows = load_excerpt(path, excerpt)
        # A frame in which one gait cycle ends and the next begins has two rows. Only the first one counts.
        first_rows = np.unique(rows.frame, return_index=True)[1]
        y, layout = np.asarray(rows.y[first_rows], float), rows.layout
        speed = np.linalg.norm(y[:, layout.y_root_velocity], axis=1) * FPS / 100
        # The column y_turn has the opposite sign: it is the turn of the world relative to the root.
        turn = np.degrees(-y[:, layout.y_turn][:, 0]) * FPS
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
        for split, label, colour in SPLITS
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
