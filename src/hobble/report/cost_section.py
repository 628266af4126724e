"""The time and disk space of each stage of the pipeline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from hobble.report.charts import Chart, axis
from hobble.report.formats import format_bytes, format_duration, format_number
from hobble.report.gather import ReportMaterial
from hobble.report.tables import Column, Table


def stage_charts(material: ReportMaterial) -> list[Chart]:
    """Two charts: the seconds and the bytes of each stage."""
    # Plotly draws the first category at the bottom, so the order is reversed.
    stages = list(material.pipeline.get("stages") or ())[::-1]
    names = [stage["stage"] for stage in stages]
    charts = []
    key: Literal["seconds", "bytes"]
    for key, title, label, as_text, caption in (
        ("seconds", "Time of each stage", "seconds, sum over all jobs", format_duration,
         "The sum over all jobs of a stage. Jobs run in parallel, so the run itself takes less time. The "
         "scale is logarithmic."),
        ("bytes", "Size of each stage", "bytes", format_bytes,
         "The files that each stage writes. The scale is logarithmic."),
    ):  # fmt: skip
        values = [stage.get(key) or 0 for stage in stages]
        trace = {
            "type": "scatter",
            "mode": "markers+text",
            "y": names,
            "x": [value or None for value in values],
            "text": [f"  {as_text(value)}" for value in values],
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


def log_range(values: Sequence[float]) -> list[float]:
    """The two ends of a logarithmic axis for `values`, as exponents of ten.

    It begins with the whole decade below the smallest positive value. Beyond the largest value there is room
    for a text.
    """
    powers = [math.log10(value) for value in values if value > 0] or [0.0, 1.0]
    return [math.floor(min(powers)), max(powers) + 0.4 * (max(powers) - math.floor(min(powers)) + 1)]


def stage_table(material: ReportMaterial) -> Table:
    """A table of times and sizes: a row for each stage.

    It has columns of published times and sizes if there are any for this configuration.
    """
    published = {
        row["stage"]: row for row in material.published["stages"] if row["configuration"] == material.name
    }
    columns = [
        Column("stage"),
        Column.count("jobs"),
        Column("time of all jobs", lambda v: format_duration(float(v)), "n"),
        Column("longest job", lambda v: format_duration(float(v)), "n"),
        Column("peak memory", lambda v: f"{format_number(v)} MB", "n"),
        Column.count("files"),
        Column("size", lambda v: format_bytes(float(v)), "n"),
    ]
    if published:
        columns.append(Column("published time", lambda v: format_duration(float(v)), "n"))
        columns.append(Column("published size", lambda v: format_bytes(float(v)), "n"))
    rows = [
        [
            stage["stage"],
            stage.get("jobs"),
            stage.get("seconds"),
            stage.get("longest"),
            stage.get("max_rss_mb"),
            stage.get("files"),
            stage.get("bytes"),
            *(
                (published.get(stage["stage"], {}).get(key) for key in ("seconds", "bytes"))
                if published
                else ()
            ),
        ]
        for stage in material.pipeline.get("stages") or ()
    ]
    return Table(f"{material.name}-pipeline", columns, rows)
