"""Charts that compare configurations: their error in training, and the time and size of pipeline stages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hobble.report.charts import Chart, Trace, axis, line_trace, log_axis
from hobble.report.comparison_charts import Compared, configuration_colours, dot_trace
from hobble.report.cost_section import log_range
from hobble.report.formats import format_bytes, format_duration

# Column of a configuration's training history -> title of the horizontal axis.
X_AXES = {"pass": "passes", "seconds": "seconds of training", "samples": "samples seen"}


def training_curves(compared: Compared) -> Chart | None:
    """Training and held-out error of all configurations. A menu selects the horizontal axis, see X_AXES."""
    options: dict[str, list[Trace]] = {}
    values: list[float | None] = []
    for key, label in X_AXES.items():
        traces = []
        for entry in compared["training"]:
            name = entry["configuration"]
            x = _passes_done(entry) if key == "pass" else entry.get(key, [])
            colour = configuration_colours(compared)[name]
            held_out = entry.get("held_out_mse", [])
            if any(v is not None for v in held_out):
                traces.append(line_trace(f"{name}, held out", x, held_out, colour))
                values += held_out
            train = entry.get("train_mse", [])
            traces.append(line_trace(f"{name}, training", x, train, colour, width=1.2, dash="dot"))
            values += train
        if traces:
            options[label] = traces
    if not options:
        return None
    return Chart(
        "compare-training",
        "Error during training",
        "Mean squared error of the standardised output. Solid lines: held-out clips. Dotted lines: training "
        "clips, measured with dropout.",
        layout={"yaxis": log_axis("mean squared error", values)},
        height=420,
        choose="Horizontal axis",
        options=options,
        option_layouts={label: {"xaxis": {**axis(label), "rangemode": "tozero"}} for label in options},
    )


def stage_charts(compared: Compared) -> list[Chart]:
    """Two charts: the time and the size on disk of each stage of the pipeline."""
    # Plotly draws the first category at the bottom, so the order is reversed.
    order = list(dict.fromkeys(stage["stage"] for stage in compared["stages"]))[::-1]
    charts = []
    for key, title, label, as_text in (
        ("seconds", "Time of each stage", "seconds, sum over all jobs", format_duration),
        ("bytes", "Size of each stage", "bytes on disk", format_bytes),
    ):
        values = [stage.get(key) or 0 for stage in compared["stages"]]
        traces = []
        for name, colour in configuration_colours(compared).items():
            rows = [s for s in compared["stages"] if s["configuration"] == name and s.get(key)]
            trace = dot_trace(
                name, [s[key] for s in rows], [s["stage"] for s in rows], colour, "%{y}: %{text}"
            )
            traces.append(trace | {"text": [as_text(s[key]) for s in rows]})
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
            "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": order},
        }
        caption = "The stages that prepare a data set run only once for all configurations that use it."
        charts.append(Chart(f"compare-{key}", title, caption, traces, layout, 110 + 32 * len(order)))
    return charts


def _passes_done(entry: Mapping[str, Any]) -> list[float]:
    """How many passes were done at the end of each section of training. A section is a part of a pass.

    entry: an entry of `training` in compare.json.
    """
    sections = [s for s in entry.get("section", ()) if s is not None]
    per_pass = max(sections, default=1)
    passes = zip(entry.get("pass", ()), entry.get("section", ()), strict=True)
    return [pass_number - 1 + section / per_pass for pass_number, section in passes]
