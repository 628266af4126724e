"""The report's sections on training, data, terrain, and the time and disk space of each stage."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import shown_names
from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.messages import group_messages
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.retarget import MOST_DIFFERENCE, most_different
from hobble.report import parts
from hobble.report.gather import ReportMaterial
from hobble.rows.clip_rows import ClipRows, cut_into_excerpts, load_excerpt, row_count, shuffle_key
from hobble.rows.layout import GAITS

UNFOLDED = ("terrain", "costs", "published")  # sections whose tables are open
MOST_SHOWN = 150  # the terrain of at most this many clips is shown
MOST_ROWS = 2000  # the table of clips has at most this many rows
MOST_COUNTED = 600  # at most this many clips are read to count how many seconds of data there are
MOST_REMARKS = 500  # the table of doubts, warnings and repairs has at most this many rows
# Split -> its name on the page, the colour of its bars.
SPLITS = {"train": ("training", "@muted"), "held_out": ("held out", "@accent")}
SPEED_EDGES = np.arange(0, 6.01, 0.2)  # edges of the bins of speeds, metres a second
TURN_EDGES = np.arange(-220, 221, 20.0)  # of turning speeds, degrees a second, positive to the left
TENTHS = np.arange(1, 11)  # middles of the bins of channel values, in tenths of the channel's highest value
BLOCK_COLOURS = ("@g1", "@g2", "@g3", "@g4", "@g5", "@g0", "@predicted")
# Columns of the training history. Each further column has the held-out error of one block of the network's
# output Y. A block is a group of columns of Y, such as the joint positions.
GENERAL_COLUMNS = ("pass", "section", "samples", "seconds", "train_mse", "held_out_mse")
# The network's output consists of blocks. The names of these blocks do not say that they belong to the path,
# so the page uses other names.
PATH_PARTS = {"position": "path position", "direction": "path direction"}
# Key of a record -> how the tables show it.
SHOW: Mapping[str, Callable[[Any], str]] = {
    "split": lambda split: SPLITS[split][0],
    "sha256": lambda text: text[:12],
    "bytes": parts.format_bytes,
    "published_bytes": parts.format_bytes,
    "seconds": parts.format_duration,
    "longest": parts.format_duration,
    "published_seconds": parts.format_duration,
    "max_rss_mb": lambda memory: f"{parts.format_number(memory)} MB",
}


def own_sections(material: ReportMaterial, counted: Mapping[str, Any]) -> Iterator[parts.PageSection]:
    """The sections of a report that no measurement has.

    counted: from `seconds_of_data`.
    """
    stages = {material.name: material.pipeline.get("stages") or ()}
    costs = stage_charts(stages, "stage", parts.words("stages.sum"), {material.name: "@accent"})
    missing = ", ".join(material.pipeline.get("missing") or ())
    fits = fit_table(some_files(material.terrain_files, MOST_SHOWN))
    yield own_section("training", learning_curve(material))
    yield own_section(
        "data",
        parts.ChartGroup([gait_chart(material), speed_and_turn_chart(counted)]),
        *channel_charts(counted, shown_names(material.network["skeleton"])),
        remarks_table(material),
        clip_table(material),
    )
    about = parts.words("terrain.table" if fits.rows else "terrain.flat")
    yield own_section("terrain", parts.Paragraph(about), fits)
    yield own_section(
        "costs",
        parts.ChartGroup(costs),
        stage_table(material),
        parts.Paragraph(parts.words("stages.missing", files=missing)) if missing else None,
    )
    yield own_section("configuration", parts.TemplatePart("configuration.html.j2"))
    yield own_section("origin", parts.TemplatePart("origin.html.j2"))


def own_section(name: str, *contents: parts.Content | None) -> parts.PageSection:
    """A section after those of the measurements, with title and note from captions.yaml."""
    content = [parts.SectionPart(i, each, open=name in UNFOLDED) for i, each in enumerate(contents)]
    return parts.PageSection(
        name,
        content,
        parts.words(f"sections.{name}.title"),
        order=90,
        note=parts.words(f"sections.{name}.note"),
    )


def some_clips(names: Iterable[str], most: int) -> frozenset[str]:
    """`most` of the clips, drawn at random; all if there are no more.

    So the size of the page does not grow with the data set. The draw depends only on the names.
    """
    return frozenset(sorted(names, key=shuffle_key)[:most])


def some_files(paths: Sequence[str], most: int) -> list[str]:
    """The files of `some_clips`. paths: one file for each clip, called after the clip."""
    chosen = some_clips((Path(path).stem for path in paths), most)
    return [path for path in paths if Path(path).stem in chosen]


def passes_axis(history: Mapping[str, Sequence[float | None]]) -> list[float]:
    """How many passes were done at the end of each section of training: section 5 of 10 in pass 2 is at 1.5.

    A pass goes over the training data once, and is divided into sections. history: column of history.csv ->
    values.
    """
    sections = history.get("section", ())
    last = max((s for s in sections if s is not None), default=1)
    pairs = zip(history.get("pass", ()), sections, strict=False)
    return [p - 1 + s / last for p, s in pairs if p is not None and s is not None]


def published_curve(published: Mapping[str, Any], configuration: str) -> tuple[list[float], list[float]]:
    """(passes, mean squared errors) of Tables A.6 to A.9 of Segerstedt (2021); empty if none has the network.

    He counts each of 20 passes a hundred times: ten sections, ten times each. Every tenth of these "epochs"
    is printed. The curve of HOLDEN-XT begins after the 20 passes of HOLDEN.
    """
    errors = published["curves"].get(configuration, [])
    before = 20 if configuration == "holden-xt" else 0
    return [before + (n + 1) / 10 for n in range(len(errors))], errors


def learning_curve(material: ReportMaterial) -> parts.Chart:
    """The training error and, if clips were held out, the held-out error, on a logarithmic scale.

    Thin lines: the held-out error of each block of the output, the one with the largest error first.
    """
    history, has_held_out = material.history, any(material.history.get("held_out_mse", ()))
    x = passes_axis(history)
    traces = [parts.line_trace("training", x, history.get("train_mse", []), "@muted")]
    if has_held_out:
        traces.append(parts.line_trace("held out", x, history["held_out_mse"], "@accent", width=3))
    known = {name: [v for v in history[name] if v is not None] for name in history}
    last = {name: v[-1] for name, v in known.items() if v and name not in GENERAL_COLUMNS}
    for i, name in enumerate(sorted(last, key=lambda name: last[name], reverse=True)):
        block = name.removeprefix("held_out_")
        label = f"{PATH_PARTS.get(block, block.replace('_', ' '))}, {parts.format_number(last[name])}"
        colour = BLOCK_COLOURS[i % len(BLOCK_COLOURS)]
        traces.append(parts.line_trace(label, x, history[name], colour, width=1.1))
    more = ["held-out" if has_held_out else "none-held-out"]
    passes, errors_of_his = published_curve(material.published, material.name)
    if passes:
        traces.append(parts.line_trace("published", passes, errors_of_his, "@g2", dash="dot", width=1.4))
        more.append("published")
    errors = parts.log_axis("mean squared error", [v for t in traces for v in t["y"]])
    layout = {"xaxis": parts.axis("pass", rangemode="tozero"), "yaxis": errors}
    return parts.chart("learning-curve", traces, layout, 440, more=more)


def fit_table(paths: Iterable[str | Path]) -> parts.Table:
    """The errors of the terrain fits, with a row for each clip on uneven ground, the largest first.

    paths: files `terrain/clips/<clip>.npz`. A fit is a ground that suits a gait cycle. C cycles of a clip
    have K fits each, the best first; a clip on flat ground has only one. Raises InputError if an array is
    missing.
    """
    records: list[dict[str, Any]] = []
    for path in paths:
        try:
            # (C, K, 2) mean and largest distance of a foot in contact, cm; (C, K) fitting error, cm².
            feet, error = load_npz(path, ("foot_error", "error")).values()
            if error.shape[1] > 1 and len(error):
                distances = {"mean": float(feet[:, :, 0].mean()), "largest": float(feet[:, :, 1].max())}
                errors = {"best": float(error[:, 0].mean()), "worst": float(error[:, -1].mean())}
                records.append({"clip": Path(path).stem, "cycles": len(error), **distances, **errors})
        except (ValueError, IndexError) as problem:
            fix = "Delete the file; the workflow makes it again."
            raise InputError(path, f"not the terrain of a clip ({problem})", fix=fix) from problem
    records.sort(key=lambda record: -record["mean"])
    return parts.told_table("terrain", records, "terrain.fits")


def stage_charts(
    stages: Mapping[str, Sequence[Mapping[str, Any]]], prefix: str, jobs: str, colours: Mapping[str, str]
) -> list[parts.Chart]:
    """Two charts: the seconds and the bytes of each stage.

    stages: configuration -> its stages, from pipeline.json. prefix: of the charts' names. jobs: a sentence
    on the times. colours: configuration -> colour.
    """
    # Plotly draws the first category at the bottom, so the order is reversed.
    names = list(dict.fromkeys(stage["stage"] for each in stages.values() for stage in each))[::-1]
    charts = []
    for key, label, as_text in (
        ("seconds", "seconds, sum over all jobs", parts.format_duration),
        ("bytes", "bytes on disk", parts.format_bytes),
    ):
        traces, values = [], []
        for name, each in stages.items():
            rows = [stage for stage in each if stage.get(key)]
            x, y = [stage[key] for stage in rows], [stage["stage"] for stage in rows]
            values += x
            trace = parts.dot_trace(name, x, y, colours[name], "%{y}: %{text}") | {"cliponaxis": False}
            trace["text"] = [f"  {as_text(value)}" for value in x]
            if len(stages) == 1:
                trace |= {"mode": "markers+text", "textposition": "middle right"}
                trace["textfont"] = {"size": 11.5, "color": "@soft"}
            traces.append(trace)
        layout = {
            "xaxis": parts.axis(label, type="log", tickformat="~s", dtick=1, range=parts.log_range(values)),
            "yaxis": parts.ordered_axis(names),
            "showlegend": len(stages) > 1,
        }
        height = (80 if len(stages) == 1 else 110) + 31 * len(names)
        name = f"{prefix}-{key}"
        charts.append(parts.chart(name, traces, layout, height, entry=f"stage-{key}", jobs=jobs))
    return charts


def stage_table(material: ReportMaterial) -> parts.Table:
    """A table of times and sizes: a row for each stage.

    It has columns of published times and sizes if there are any for this configuration.
    """
    published = {
        row["stage"]: {"published_seconds": row.get("seconds"), "published_bytes": row.get("bytes")}
        for row in material.published["stages"]
        if row["configuration"] == material.name
    }
    stages = material.pipeline.get("stages") or ()
    records = [{**stage, **published.get(stage["stage"], {})} for stage in stages]
    return parts.told_table(f"{material.name}-pipeline", records, "stages.table", SHOW)


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
    both = {split: np.zeros((len(TURN_EDGES) - 1, len(SPEED_EDGES) - 1)) for split in SPLITS}
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
        for name, of_rows in rows.channels.items():
            definition, seconds = channel(name), channels.setdefault(name, {})
            for column, values in zip(definition.columns(skeleton), of_rows[first_rows].T, strict=True):
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


def gait_seconds(material: ReportMaterial) -> dict[str, dict[str, float]]:
    """Split -> gait -> seconds in all clips."""
    totals = {split: dict.fromkeys(GAITS, 0.0) for split in SPLITS}
    for report in material.labels:
        for gait, seconds in (report.get("seconds") or {}).items():
            totals[material.split_of(report["clip"])][gait] += seconds
    return totals


def gait_chart(material: ReportMaterial) -> parts.Chart:
    """Seconds of each gait, in training clips and held-out clips; empty without labels."""
    traces = [
        parts.bar_trace(label, GAITS, [*seconds.values()], colour, "%{x}: %{y:.1f} s<extra></extra>")
        for (label, colour), seconds in zip(SPLITS.values(), gait_seconds(material).values(), strict=True)
        if any(seconds.values())
    ]
    layout = {
        "barmode": "stack",
        "yaxis": parts.axis("seconds", rangemode="tozero"),
        "xaxis": {"type": "category"},
    }
    return parts.chart("gaits", traces, layout, 300)


def speed_and_turn_chart(counted: Mapping[str, Any]) -> parts.Chart | None:
    """Seconds at each combination of speed and turning speed. counted: from `seconds_of_data`."""
    speeds, turns, both = _middles(SPEED_EDGES), _middles(TURN_EDGES), sum(counted["both"].values())
    if not both.any():
        return None
    shown = int(np.flatnonzero(both.any(axis=0)).max()) + 1  # number of bins of speeds
    trace = _seconds_trace(speeds[:shown], turns, both[:, :shown], "%{x:.1f} m/s, %{y}°/s: %{z:.1f} s") | {
        "colorscale": [[0, "@sunken"], [0.15, "@muted"], [1, "@accent"]],
        # Not the maximum: with one very full cell, all others would look alike.
        "zmax": float(np.percentile(both[both > 0], 95)),
        "zmin": 0,
    }
    turning = parts.axis("degrees per second (positive: to the left)", automargin=True)
    layout = {"xaxis": parts.axis("m/s"), "yaxis": turning}
    return parts.chart("speed-turn", [trace], layout, 300, estimate=counted["estimate"])


def channel_charts(counted: Mapping[str, Any], shown_name: Callable[[str], str] = str) -> list[parts.Chart]:
    """A chart for each channel that has a value above 0 in any clip: seconds at each value of each column.

    counted: from `seconds_of_data`. shown_name: column -> its name on the page.
    """
    charts = []
    for name, seconds in counted["channels"].items():
        if not seconds:
            continue
        definition, columns = channel(name), list(seconds)[::-1]
        tenth = definition.highest / 10
        x, y = np.round(TENTHS * tenth, 6).tolist(), [shown_name(column) for column in columns]
        hover = "%{y} at %{x}: %{z:.1f} s"
        trace = _seconds_trace(x, y, np.array([seconds[column] for column in columns]), hover)
        trace |= {"colorscale": [[0, "@hurt-low"], [1, "@hurt-high"]], "xgap": 3, "ygap": 3}
        across = parts.axis(definition.value_word, dtick=tenth, range=[0.4 * tenth, 10.6 * tenth])
        layout, height = {"xaxis": across, "yaxis": {"automargin": True}}, 120 + 24 * len(columns)
        values = {"of": definition.title, "value": definition.value_word, "estimate": counted["estimate"]}
        name = f"{name}-coverage"
        charts.append(parts.chart(name, [trace], layout, height, entry="coverage", **values))
    return charts


def _seconds_trace(x: Sequence, y: Sequence, seconds: Array, hover: str) -> parts.Trace:
    """A heatmap of seconds, (len(y), len(x)). Cells without data are empty."""
    cells = [[value or None for value in row] for row in np.round(seconds, 3).tolist()]
    bar = {"title": {"text": "s"}, "thickness": 10, "outlinewidth": 0}
    look = {"type": "heatmap", "colorbar": bar, "hovertemplate": f"{hover}<extra></extra>"}
    return {**look, "x": x, "y": y, "z": cells}


def _middles(edges: Array) -> list[float]:
    """The middle of each bin."""
    return np.round((edges[:-1] + edges[1:]) / 2, 3).tolist()


def clip_table(material: ReportMaterial) -> parts.Table:
    """A row for each clip: split, file, length, labels, difference from its file, and checksum.

    Clips that were retargeted and differ most from their files come first.
    """
    labels = {report["clip"]: report for report in material.labels}
    shown, records = some_clips((report["clip"] for report in material.motion), MOST_ROWS), []
    for report in material.motion:
        if report["clip"] not in shown:
            continue
        record = {**labels.get(report["clip"], {}), **report, "split": material.split_of(report["clip"])}
        if report.get("retarget"):
            record["joint"], record["degrees"] = most_different(report["retarget"])
        records.append(record)
    records.sort(key=lambda record: -record.get("degrees", 0.0))
    total = len(material.motion)
    which = f"All {total:,}" if len(records) == total else f"{len(records):,} of {total:,}"
    values = {"which": which, "most": f"{MOST_DIFFERENCE:.0f}"}
    return parts.told_table(f"{material.name}-clips", records, "sections.data.clips", SHOW, **values)


def remarks_table(material: ReportMaterial) -> parts.Table:
    """A row for each kind of doubt, warning and repair, doubts first."""
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
    records = [
        {"clips": len(each.clips), "stage": each.stage, "example": each.clips[0], "message": each.message}
        for each in group_messages(messages)[:MOST_REMARKS]
    ]
    name, count = f"{material.name}-remarks", f"{len(messages):,}"
    return parts.told_table(name, records, "sections.data.remarks", count=count)
