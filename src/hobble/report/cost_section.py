"""What a frame costs at run time, and what each stage of the pipeline cost."""

from __future__ import annotations

import math
from typing import Any

from hobble.report.charts import Chart, Trace, axis, mark
from hobble.report.findings import Figure, frame_mean, frame_milliseconds, published
from hobble.report.formats import duration, number, size
from hobble.report.gather import Material
from hobble.report.tables import Column, Table

# The steps of a frame in their order, and their colours.
STEPS = {
    "prepare": "@g0",
    "input": "@g3",
    "insert": "@g5",
    "predict": "@accent",
    "output": "@g2",
    "update": "@muted",
}


FEWEST_STEPS = 10  # under so many, what the feet did says nothing


def lap_steps(lap: dict[str, Any]) -> dict[str, float]:
    """Milliseconds a frame of each step of a lap, without their total."""
    value = lap.get("milliseconds")
    if isinstance(value, dict):
        return {k: v for k, v in value.items() if k not in ("total", "sd") and isinstance(v, (int, float))}
    return {"frame": value} if isinstance(value, (int, float)) else {}


def _place(step: str) -> int:
    return list(STEPS).index(step) if step in STEPS else len(STEPS)


def lap_chart(material: Material) -> Chart | None:
    """Milliseconds a frame of each step, stacked, lap by lap, for each way of looking up the phase."""
    found = material.responsivity
    options = {}
    for entry in found.get("modes") or [found]:
        traces = _lap_bars(entry)
        if traces:
            options[f"{entry.get('mode', 'the')} phase"] = traces
    if not options:
        return None
    own = f"{found.get('mode', 'the')} phase"
    options = {name: options[name] for name in sorted(options, key=lambda name: name != own)}
    shapes, notes = [], []
    theirs = published(material, "responsivity")
    if theirs:
        shape, note = mark(theirs["milliseconds"], f"{theirs['label']}: mean as published", vertical=False)
        shapes, notes = [shape], [note]
    laps = max(len(trace["x"]) for traces in options.values() for trace in traces)
    return Chart(
        "laps",
        "Milliseconds a frame, lap by lap",
        "Each bar is one lap of the six-waypoint track; its parts are the steps of a frame, means over the "
        "lap. Diamonds are medians of the whole frame. A few frames that another program held up raise a "
        "bar and leave the diamond where it is. A frame at 60 Hz has 16.7 ms.",
        layout={
            "barmode": "stack",
            "xaxis": axis("lap", dtick=1 if laps < 25 else None),
            "yaxis": axis("ms a frame", rangemode="tozero"),
            "shapes": shapes,
            "annotations": notes,
        },
        choose="Looked up by" if len(options) > 1 else None,
        options=options,
    )


def _lap_bars(entry: dict[str, Any]) -> list[Trace]:
    laps = entry.get("laps")
    laps = [lap for lap in laps if lap_steps(lap)] if isinstance(laps, list) else []
    if not laps:
        return []
    numbers = [lap.get("lap", i + 1) for i, lap in enumerate(laps)]
    bars: list[Trace] = [
        {
            "type": "bar",
            "name": step,
            "x": numbers,
            "y": [lap_steps(lap).get(step) for lap in laps],
            "marker": {"color": STEPS.get(step, "@g0")},
            "hovertemplate": "lap %{x}: %{y:.3f} ms<extra>%{fullData.name}</extra>",
        }
        for step in sorted(lap_steps(laps[0]), key=_place)
    ]
    medians = [lap_median(lap) for lap in laps]
    if all(value is None for value in medians):
        return bars
    dots: Trace = {
        "type": "scatter",
        "mode": "markers",
        "name": "median",
        "x": numbers,
        "y": medians,
        "marker": {"symbol": "diamond", "size": 8, "color": "@ink"},
        "hovertemplate": "lap %{x}: %{y:.3f} ms<extra>%{fullData.name}</extra>",
    }
    return [*bars, dots]


def lap_median(lap: dict[str, Any]) -> float | None:
    """The median of the milliseconds a frame of a lap, all steps together."""
    value = lap.get("milliseconds")
    return (value.get("spread") or {}).get("median") if isinstance(value, dict) else None


def lap_table(material: Material) -> Table | None:
    """The laps as numbers."""
    laps = material.responsivity.get("laps")
    if not isinstance(laps, list) or not laps:
        return None
    plain = [k for k, v in laps[0].items() if k != "milliseconds" and isinstance(v, (int, float, str))]
    steps = sorted(lap_steps(laps[0]), key=_place)
    columns = [Column.number(k.replace("_", " "), 4) for k in plain] + [
        Column.number(f"{s}, mean ms") for s in steps
    ]
    columns.append(Column.number("all, median ms"))
    rows = [
        [None if k == "foot_slide_cm" and _few(lap.get("steps")) else lap.get(k) for k in plain]
        + [lap_steps(lap).get(s) for s in steps]
        + [lap_median(lap)]
        for lap in laps
    ]
    return Table(f"{material.name}-responsivity", columns, rows)


def _few(steps: int | None) -> bool:
    return steps is not None and steps < FEWEST_STEPS


def track_figures(material: Material) -> list[Figure]:
    """How the track was followed, in a few numbers."""
    found = material.responsivity
    if not isinstance(found.get("laps"), list):
        return []
    spread = (found.get("milliseconds") or {}).get("spread") or {}
    reached = f"{found.get('waypoints_reached')} of {found.get('waypoints')}"
    steps = sum(lap.get("steps") or 0 for lap in found["laps"])
    slide = None if _few(steps) else found.get("foot_slide_cm")
    measured = f"of the toe in a stance, on average; {steps:,} steps were measured"
    laps = f"{found.get('laps_finished')} of {len(found['laps'])} laps finished"
    return [
        Figure("Waypoints reached", reached, "", laps),
        Figure("Furthest off the path", number(found.get("path_overshoot_cm")), "cm", "at the turns"),
        Figure("Foot slide", number(slide), "cm" if slide is not None else "", measured),
        Figure(
            "Largest turn of a joint",
            number(found.get("largest_turn_degrees")),
            "°",
            "from a frame to the next",
        ),
        Figure("Slow frames", number(spread.get("p99")), "ms", "one frame in a hundred is slower"),
    ]


def speed_published(material: Material) -> Table | None:
    """Our milliseconds with the published means under them."""
    ours = frame_milliseconds(material)
    if ours is None:
        return None
    sources = material.published["sources"]
    mode = material.responsivity.get("mode")
    rows: list[list[Any]] = [
        [
            f"{material.name}, {mode} phase" if mode else material.name,
            ours,
            frame_mean(material),
            "this report",
        ]
    ]
    for entry in material.published["responsivity"]:
        rows.append([entry["label"], None, entry["milliseconds"], sources[entry["source"]]])
    for entry in material.published["modes"]:
        rows.append(
            [
                f"prediction alone, {entry['mode']} phase",
                None,
                entry["milliseconds"],
                sources[entry["source"]],
            ]
        )
    columns = [
        Column("network"),
        Column.number("median, ms a frame"),
        Column.number("mean, ms a frame"),
        Column("source", kind="long"),
    ]
    return Table(f"{material.name}-published-speed", columns, rows, "Beside the published figures")


def stage_charts(material: Material) -> list[Chart]:
    """Seconds and bytes of each stage, side by side."""
    stages = list(material.pipeline.get("stages") or ())[::-1]
    names = [stage["stage"] for stage in stages]
    charts = []
    for key, title, label, show, caption in (
        ("seconds", "Time of each stage", "seconds, summed over jobs", duration,
         "With several cores the wait is shorter than the sum over the jobs of a stage. Each line is ten "
         "times the one before."),
        ("bytes", "Size of each stage", "bytes", size,
         "What each stage leaves on disk."),
    ):  # fmt: skip
        values = [stage.get(key) or 0 for stage in stages]
        trace = {
            "type": "scatter",
            "mode": "markers+text",
            "y": names,
            "x": [value or None for value in values],
            "text": [f"  {show(value)}" for value in values],
            "textposition": "middle right",
            "textfont": {"size": 11.5, "color": "@soft"},
            "marker": {"color": "@accent", "size": 10},
            "hovertemplate": "%{y}: %{text}<extra></extra>",
            "cliponaxis": False,
        }
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
            "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": names},
            "showlegend": False,
        }
        charts.append(Chart(f"stage-{key}", title, caption, [trace], layout, 80 + 30 * len(names)))
    return charts


def log_range(values: list[float]) -> list[float]:
    """Whole decades around the values that are above zero, with room to the right for the last one's text."""
    some = [math.log10(value) for value in values if value > 0] or [0.0, 1.0]
    return [math.floor(min(some)), max(some) + 0.25 * (max(some) - math.floor(min(some)) + 1)]


def stage_table(material: Material) -> Table:
    """A row per stage, the published figures beside ours."""
    theirs = {row["stage"]: dict(row) for row in material.published["stages"]}
    own = published(material, "sizes") or {}
    for stage, key in (("database", "database"), ("training", "weights")):
        if key in own:  # of this configuration, where it was published
            theirs[stage]["bytes"] = own[key]
    columns = [
        Column("stage"),
        Column.count("jobs"),
        Column("time, summed over jobs", lambda v: duration(float(v)), "n"),
        Column("longest job", lambda v: duration(float(v)), "n"),
        Column("peak memory", lambda v: f"{number(v)} MB", "n"),
        Column.count("files"),
        Column("size", lambda v: size(float(v)), "n"),
        Column("published time", lambda v: duration(float(v)), "n"),
        Column("published size", lambda v: size(float(v)), "n"),
    ]
    rows = [
        [
            stage["stage"],
            stage.get("jobs"),
            stage.get("seconds"),
            stage.get("longest"),
            stage.get("max_rss_mb"),
            stage.get("files"),
            stage.get("bytes"),
            theirs.get(stage["stage"], {}).get("seconds"),
            theirs.get(stage["stage"], {}).get("bytes"),
        ]
        for stage in material.pipeline.get("stages") or ()
    ]
    return Table(f"{material.name}-pipeline", columns, rows)
