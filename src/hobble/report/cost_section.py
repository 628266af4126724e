"""What a frame costs at run time, and what each stage of the pipeline cost."""

from __future__ import annotations

from typing import Any

from hobble.report.charts import Chart, Trace, axis, mark
from hobble.report.findings import published
from hobble.report.formats import duration, number, size
from hobble.report.gather import Material
from hobble.report.tables import Column, Table

STEP_COLOURS = ("@g1", "@g2", "@g3", "@g4", "@g5", "@g0")


def lap_steps(lap: dict[str, Any]) -> dict[str, float]:
    """Milliseconds a frame of each step of a lap, without their total."""
    value = lap.get("milliseconds")
    if isinstance(value, dict):
        return {k: v for k, v in value.items() if k != "total" and isinstance(v, (int, float))}
    return {"frame": value} if isinstance(value, (int, float)) else {}


def lap_chart(material: Material) -> Chart | None:
    """Milliseconds a frame of each step, stacked, lap by lap."""
    laps = material.responsivity.get("laps")
    laps = [lap for lap in laps if lap_steps(lap)] if isinstance(laps, list) else []
    if not laps:
        return None
    numbers = [lap.get("lap", i + 1) for i, lap in enumerate(laps)]
    steps = list(lap_steps(laps[0]))
    traces: list[Trace] = [
        {
            "type": "bar",
            "name": step,
            "x": numbers,
            "y": [lap_steps(lap).get(step) for lap in laps],
            "marker": {"color": STEP_COLOURS[i % len(STEP_COLOURS)]},
            "hovertemplate": "lap %{x}: %{y:.3f} ms<extra>%{fullData.name}</extra>",
        }
        for i, step in enumerate(steps)
    ]
    shapes, notes = [], []
    theirs = published(material, "responsivity")
    if theirs:
        shape, note = mark(theirs["milliseconds"], f"{theirs['label']} as published", vertical=False)
        shapes, notes = [shape], [note]
    return Chart(
        "laps",
        "Milliseconds a frame, lap by lap",
        "Each bar is one lap of the six-waypoint track; its parts are the steps of a frame. The bars should be of one "
        "height: a slow first lap is warming up, a slow one in between was another program's doing. "
        "A frame at 60 Hz has 16.7 ms.",
        traces,
        {
            "barmode": "stack",
            "xaxis": axis("lap", dtick=1 if len(laps) < 25 else None),
            "yaxis": axis("ms a frame", rangemode="tozero"),
            "shapes": shapes,
            "annotations": notes,
        },
    )


def lap_table(material: Material) -> Table | None:
    """The laps as numbers."""
    laps = material.responsivity.get("laps")
    if not isinstance(laps, list) or not laps:
        return None
    plain = [k for k, v in laps[0].items() if k != "milliseconds" and isinstance(v, (int, float, str))]
    steps = list(lap_steps(laps[0]))
    columns = [Column.number(k.replace("_", " "), 4) for k in plain] + [
        Column.number(f"{s}, ms") for s in steps
    ]
    rows = [[lap.get(k) for k in plain] + [lap_steps(lap).get(s) for s in steps] for lap in laps]
    return Table(f"{material.name}-responsivity", columns, rows)


def stage_charts(material: Material) -> list[Chart]:
    """Seconds and bytes of each stage, side by side."""
    stages = list(material.pipeline.get("stages") or ())[::-1]
    names = [stage["stage"] for stage in stages]
    charts = []
    for key, title, label, show, caption in (
        ("seconds", "Time of each stage", "seconds of computing", duration,
         "Seconds added up over the jobs of a stage; with several cores the wait is shorter. Logarithmic."),
        ("bytes", "Size of each stage", "bytes", size,
         "What each stage leaves on disk. Logarithmic."),
    ):  # fmt: skip
        values = [stage.get(key) or 0 for stage in stages]
        trace = {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "x": [value or None for value in values],
            "text": [show(value) if value else "nothing" for value in values],
            "textposition": "auto",
            "marker": {"color": "@accent"},
            "hovertemplate": "%{y}: %{text}<extra></extra>",
            "cliponaxis": False,
        }
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s"),
            "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": names},
            "showlegend": False,
        }
        charts.append(Chart(f"stage-{key}", title, caption, [trace], layout, 80 + 30 * len(names)))
    return charts


def stage_table(material: Material) -> Table:
    """A row per stage, the published figures beside ours."""
    theirs = {row["stage"]: row for row in material.published["stages"]}
    columns = [
        Column("stage"),
        Column.number("jobs", 4),
        Column("time", lambda v: duration(float(v)), "n"),
        Column("longest job", lambda v: duration(float(v)), "n"),
        Column("peak memory", lambda v: f"{number(v)} MB", "n"),
        Column.number("files", 5),
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
