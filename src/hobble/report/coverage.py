"""How many seconds of data there are at each speed, turning speed and channel value."""

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
from hobble.rows.excerpts import Excerpt, excerpts, load_excerpt

FPS = 60.0  # of the clips' rows
SPEEDS = np.arange(0, 6.01, 0.2)  # edges of the bins, metres a second
TURNS = np.arange(-220, 221, 20.0)  # edges of the bins, degrees a second, positive to the left
TENTHS = np.arange(1, 11)  # middles of the bins of channel values, in tenths of the highest value
MOST_EXCERPTS = 600  # the frames of at most this many excerpts of clips are counted
# Split, its name on the page, the colour of its bars.
SPLITS = (("train", "training", "@muted"), ("held_out", "held out", "@accent"))


def seconds_of_data(
    paths: Sequence[str | Path], splits: Mapping[str, str], of: int | None = None
) -> dict[str, Any]:
    """Seconds of data in the files `database/clips/<clip>.npz`. A frame with several rows counts once.

    splits: clip -> "train" or "held_out". of: the number of all clips, if `paths` are a random choice of
    them; the seconds are then an estimate for all clips.

    The result has `turns`: split -> seconds in each bin of TURNS; `both`: (turns, speeds), seconds in each
    bin of turn and speed; `channels`: channel -> column -> seconds in each bin of TENTHS; `estimate`: a
    sentence that says which part of the data was read, empty if all was read.
    """
    chosen, share = _chosen(paths)
    # Each frame that is read stands for this many seconds of data.
    each = max(of or 0, len(paths)) / max(len(paths), 1) / share / FPS
    turns = {split: np.zeros(len(TURNS) - 1) for split, *_ in SPLITS}
    both = np.zeros((len(TURNS) - 1, len(SPEEDS) - 1))
    channels: dict[str, dict[str, Array]] = {}
    for path, excerpt in chosen:
        rows = load_excerpt(path, excerpt)
        once = np.unique(rows.frame, return_index=True)[1]
        y, layout = np.asarray(rows.y[once], float), rows.layout
        speed = np.linalg.norm(y[:, layout.y_root_velocity], axis=1) * FPS / 100
        # The column has the opposite sign: it is the turn of the world relative to the root.
        turn = np.degrees(-y[:, layout.y_turn][:, 0]) * FPS
        speed, turn = (np.clip(v, e[0], e[-1] - 1e-6) for v, e in ((speed, SPEEDS), (turn, TURNS)))
        turns[splits.get(rows.clip, "train")] += np.histogram(turn, TURNS)[0] * each
        both += np.histogram2d(turn, speed, (TURNS, SPEEDS))[0] * each
        skeleton = Skeleton.from_dict(rows.skeleton)
        for name, table in rows.channels.items():
            definition, seconds = channel(name), channels.setdefault(name, {})
            for column, values in zip(definition.columns(skeleton), table[once].T, strict=True):
                if values.any():
                    counts = np.histogram(10 * values / definition.highest, np.arange(0.5, 11))[0]
                    seconds[column] = seconds.get(column, 0) + counts * each
    part = [f"{len(paths):,} of {of:,} clips"] if of and of > len(paths) else []
    part += [f"{100 * share:.0f} % of their frames"] if share < 1 else []
    estimate = f" Estimated from {' and '.join(part)}." if part else ""
    return {"turns": turns, "both": both, "channels": channels, "estimate": estimate}


def _chosen(paths: Sequence[str | Path]) -> tuple[list[tuple[str | Path, Excerpt]], float]:
    """The excerpts to read: all, or MOST_EXCERPTS drawn at random. Also returns their share of all rows."""
    every = [(path, excerpt) for path in paths for excerpt in excerpts(Path(path).stem, row_count(path))]
    if len(every) <= MOST_EXCERPTS:
        return every, 1.0
    drawn = sorted(every, key=lambda pair: shuffle_key(f"{pair[1].clip} {pair[1].first}"))[:MOST_EXCERPTS]
    return drawn, sum(excerpt.rows for _, excerpt in drawn) / sum(excerpt.rows for _, excerpt in every)


def turn_chart(counted: Mapping[str, Any]) -> Chart | None:
    """Seconds at each turning speed. counted: from `seconds_of_data`."""
    traces: list[Trace] = [
        {
            "type": "bar",
            "name": label,
            "x": _middles(TURNS),
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


def both_chart(counted: Mapping[str, Any]) -> Chart | None:
    """Seconds at each combination of speed and turn. counted: from `seconds_of_data`."""
    both = counted["both"]
    if not both.any():
        return None
    last = int(np.flatnonzero(both.any(axis=0)).max()) + 1
    trace = {
        "type": "heatmap",
        "x": _middles(SPEEDS)[:last],
        "y": _middles(TURNS),
        "z": [[v or None for v in row] for row in np.round(both[:, :last], 3).tolist()],
        "colorscale": [[0, "@sunken"], [0.15, "@muted"], [1, "@accent"]],
        "zmax": float(np.percentile(both[both > 0], 95)),
        "zmin": 0,
        "colorbar": {"title": {"text": "s"}, "thickness": 10, "outlinewidth": 0},
        "hovertemplate": "%{x:.1f} m/s, %{y}°/s: %{z:.1f} s<extra></extra>",
    }
    layout = {"xaxis": axis("m/s"), "yaxis": axis("degrees per second", automargin=True)}
    caption = (
        "Seconds of data at each combination of speed and turn. The network was not trained on empty cells."
    )
    return Chart("speed-turn", "Speed and turn combined", caption + counted["estimate"], [trace], layout, 300)


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
    across = axis(definition.value, dtick=tenth, range=[0.4 * tenth, 10.6 * tenth])
    caption = (
        f"Each cell has the seconds of data at one {definition.value}, including mirrored clips. The network "
        "was not trained on empty cells and has to interpolate there."
    )
    title, height = f"{definition.title}: amount of data", 120 + 24 * len(columns)
    layout = {"xaxis": across, "yaxis": {"automargin": True}}
    return Chart(f"{name}-coverage", title, caption + estimate, [trace], layout, height)


def _middles(edges: Array) -> list[float]:
    return np.round((edges[:-1] + edges[1:]) / 2, 3).tolist()
