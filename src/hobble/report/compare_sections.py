"""Charts of configurations side by side, from compare.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.report.accuracy_section import quantiles
from hobble.report.charts import Chart, Trace, axis, line, log_axis
from hobble.report.cost_section import log_range
from hobble.report.formats import duration, size

Compared = Mapping[str, Any]
PALETTE = ("@accent", "@g2", "@g3", "@g4", "@g5", "@g0", "@g1", "@predicted")
SPLITS = {"held_out": "held-out clips", "train": "training clips"}
OVER = {"pass": "passes", "seconds": "seconds of training", "samples": "samples seen"}


def names(compared: Compared) -> list[str]:
    """The configurations in their order."""
    return [entry["configuration"] for entry in compared["configurations"]]


def colours(compared: Compared) -> dict[str, str]:
    """A colour for each configuration, the same in every chart."""
    return {name: PALETTE[i % len(PALETTE)] for i, name in enumerate(names(compared))}


def error_boxes(compared: Compared) -> Chart | None:
    """The spread of the relative error of each configuration, over all frames of a split."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLITS.items():
        traces: list[Trace] = []
        for entry in compared["accuracy"]:
            found = quantiles(entry[split])
            if found is None:
                continue
            low, q1, median, q3, high = ([100 * value] for value in found)
            colour = colours(compared)[entry["configuration"]]
            traces.append(
                {
                    "type": "box",
                    "name": entry["configuration"],
                    "x": [entry["configuration"]],
                    "lowerfence": low,
                    "q1": q1,
                    "median": median,
                    "q3": q3,
                    "upperfence": high,
                    "mean": [100 * entry[split]["mean"]],
                    "boxmean": True,
                    "marker": {"color": colour},
                    "line": {"width": 1.6, "color": colour},
                }
            )
        if traces:
            options[label] = traces
    published = [row for row in compared["published"]["accuracy"] if row["configuration"] in names(compared)]
    if not options:
        return None
    for traces in options.values():
        if published:
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": "mean as published",
                    "x": [row["configuration"] for row in published],
                    "y": [100 * row["mean"] for row in published],
                    "marker": {"symbol": "diamond-open", "size": 10, "color": "@ink"},
                    "hovertemplate": "%{x}: %{y:.2f} % as published<extra></extra>",
                }
            )
    return Chart(
        "compare-boxes",
        "Spread of the error",
        "Each box holds the middle half of the relative errors (eq. 3.1 of Segerstedt) over all frames, the "
        "line in it is the median, the dashed one the mean; whiskers reach from the 5th to the 95th "
        "percentile. Diamonds are published means, measured on other data.",
        layout={"yaxis": axis("relative error, %", rangemode="tozero"), "showlegend": False},
        height=400,
        choose="Over",
        options=options,
    )


def clip_dots(compared: Compared) -> Chart | None:
    """The mean error of every clip, a dot for each configuration."""
    clips = {(row["split"], row["clip"]) for entry in compared["accuracy"] for row in entry["clips"]}
    order = [
        clip for _, clip in sorted(clips, key=lambda pair: (pair[0] == "held_out", pair[1]), reverse=False)
    ]
    if not order:
        return None
    traces = []
    for entry in compared["accuracy"]:
        rows = [row for row in entry["clips"] if row.get("mean") is not None]
        traces.append(
            _dots(
                entry["configuration"],
                [100 * row["mean"] for row in rows],
                [row["clip"] for row in rows],
                colours(compared)[entry["configuration"]],
                "%{y}: %{x:.2f} %",
            )
        )
    layout = {
        "xaxis": axis("relative error, %", rangemode="tozero"),
        "yaxis": {"categoryorder": "array", "categoryarray": order, "automargin": True, "type": "category"},
    }
    caption = "Held-out clips stand on top. Where the dots of a row lie together, the configurations agree."
    return Chart("compare-clips", "Error of each clip", caption, traces, layout, 130 + 19 * len(order))


def rollout_chart(compared: Compared) -> Chart | None:
    """How the error grows when the figure is fed its own pose."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLITS.items():
        traces = []
        for name, colour in colours(compared).items():
            rows = [r for r in compared.get("rollouts", ()) if r["configuration"] == name]
            rows = [r for r in rows if (r[split] or {}).get("position_error_cm") is not None]
            if rows:
                x = [row["length"] for row in rows]
                y = [row[split]["position_error_cm"] for row in rows]
                traces.append(line(name, x, y, colour, mode="lines+markers"))
        if traces:
            options[label] = traces
    if not options:
        return None
    return Chart(
        "compare-rollouts",
        "Fed its own pose",
        "Mean distance of a joint from the captured one, over roll-outs of so many frames in which the "
        "network goes on from what it predicted itself. One frame is the error above.",
        layout={
            "xaxis": log_axis("frames", [x for t in options.values() for one in t for x in one["x"]]),
            "yaxis": axis("cm a joint", rangemode="tozero"),
        },
        choose="Over",
        options=options,
    )


def lap_lines(compared: Compared) -> Chart | None:
    """Milliseconds a frame, lap by lap, for each phase mode."""
    options: dict[str, list[Trace]] = {}
    for entry in sorted(compared["responsivity"], key=lambda entry: entry["mode"] != "cubic"):
        laps = [lap for lap in entry["laps"] if isinstance(lap.get("milliseconds"), dict)]
        x, y = [lap["lap"] for lap in laps], [lap["milliseconds"]["spread"]["median"] for lap in laps]
        colour = colours(compared)[entry["configuration"]]
        one = line(entry["configuration"], x, y, colour, mode="lines+markers")
        options.setdefault(f"{entry['mode']} phase", []).append(one)
    if not options:
        return None
    for traces in options.values():
        for row in compared["published"]["responsivity"]:
            if row["configuration"] in names(compared):
                most = max((max(t["x"], default=1) for t in traces), default=1)
                colour = colours(compared)[row["configuration"]]
                label = f"{row['label']}: mean as published"
                traces.append(
                    line(label, [1, most], [row["milliseconds"]] * 2, colour, dash="dot", width=1.2)
                )
    return Chart(
        "compare-laps",
        "Milliseconds a frame, lap by lap",
        "All steps of a frame, medians over each lap of the six-waypoint track. Dotted: the published "
        "means, measured on another machine.",
        layout={"xaxis": axis("lap", dtick=1), "yaxis": axis("ms a frame", rangemode="tozero")},
        choose="Looked up by",
        options=options,
    )


def fit_chart(compared: Compared) -> Chart | None:
    """Frame time over the number of parameters, with the straight lines through ours and the published."""
    shown = [
        f
        for f in compared["milliseconds"]["fit"]
        if f["computations"] == "true"
        and f["step"] == ("median" if f["whose"] == "hobble" else "total")
        and f["mode"] in (None, "cubic")
        and f["x"]
    ]
    traces: list[Trace] = []
    for fit, colour in zip(shown, ("@accent", "@g2"), strict=False):
        label = "ours, cubic phase: medians" if fit["whose"] == "hobble" else "published: means"
        dots = _dots(label, fit["x"], fit["y"], colour, "%{x:,} parameters: %{y:.3f} ms")
        traces.append(dots)
        if fit["slope"] is not None:
            ends = [min(fit["x"]), max(fit["x"])]
            values = [fit["intercept"] + fit["slope"] * x for x in ends]
            traces.append(line(f"{label}, line", ends, values, colour, width=1.4))
    if not traces:
        return None
    layout = {
        "xaxis": axis("parameters of a phase", tickformat="~s", rangemode="tozero"),
        "yaxis": axis("ms a frame", rangemode="tozero"),
    }
    caption = "A straight line means that a frame costs what its multiplications cost, and something fixed."
    return Chart("compare-fit", "Frame time over size", caption, traces, layout, 340)


def training_curves(compared: Compared) -> Chart | None:
    """Training and held-out error of all configurations, over passes, seconds and samples."""
    options: dict[str, list[Trace]] = {}
    values: list[float | None] = []
    for key, label in OVER.items():
        traces = []
        for entry in compared["training"]:
            name = entry["configuration"]
            x = _passes(entry) if key == "pass" else entry.get(key, [])
            colour = colours(compared)[name]
            held_out = entry.get("held_out_mse", [])
            if any(v is not None for v in held_out):
                traces.append(line(f"{name}, held out", x, held_out, colour))
                values += held_out
            train = entry.get("train_mse", [])
            traces.append(line(f"{name}, training", x, train, colour, width=1.2, dash="dot"))
            values += train
        if traces:
            options[label] = traces
    if not options:
        return None
    return Chart(
        "compare-training",
        "Learning",
        "Mean squared error of the standardised output. Whole lines: held-out clips; dotted: training clips, "
        "under dropout. Over passes one sees what the data gives, over seconds what it costs.",
        layout={"yaxis": log_axis("mean squared error", values)},
        height=420,
        choose="Over",
        options=options,
        option_layouts={label: {"xaxis": {**axis(label), "rangemode": "tozero"}} for label in options},
    )


def stage_dots(compared: Compared) -> list[Chart]:
    """Time and size of each stage."""
    order = list(dict.fromkeys(stage["stage"] for stage in compared["stages"]))[::-1]
    charts = []
    for key, title, label, show in (
        ("seconds", "Time of each stage", "seconds of computing, added up over its jobs", duration),
        ("bytes", "Size of each stage", "bytes on disk", size),
    ):
        values = [stage.get(key) or 0 for stage in compared["stages"]]
        traces = []
        for name, colour in colours(compared).items():
            rows = [s for s in compared["stages"] if s["configuration"] == name and s.get(key)]
            trace = _dots(name, [s[key] for s in rows], [s["stage"] for s in rows], colour, "%{y}: %{text}")
            traces.append(trace | {"text": [show(s[key]) for s in rows]})
        layout = {
            "xaxis": axis(label, type="log", tickformat="~s", dtick=1, range=log_range(values)),
            "yaxis": {"automargin": True, "categoryorder": "array", "categoryarray": order},
        }
        caption = "Stages that two configurations share (the same data set) cost their time once."
        charts.append(Chart(f"compare-{key}", title, caption, traces, layout, 110 + 32 * len(order)))
    return charts


def difference_map(compared: Compared) -> Chart | None:
    """Eq. 3.2 of every pair."""
    order, options = names(compared), {}
    for over, label in SPLITS.items():
        found = {(r["a"], r["b"]): r["difference"] for r in compared["difference"] if r["over"] == over}
        if not found:
            continue
        cells = [[found.get((a, b), found.get((b, a))) for b in order] for a in order]
        options[label] = [
            {
                "type": "heatmap",
                "x": order,
                "y": order,
                "z": cells,
                "colorscale": [[0, "@sunken"], [1, "@accent"]],
                "zmin": 0,
                "texttemplate": "%{z:.2f}",
                "xgap": 3,
                "ygap": 3,
                "showscale": False,
                "hovertemplate": "%{y} and %{x}: %{z:.3f}<extra></extra>",
            }
        ]
    if not options:
        return None
    layout = {
        "xaxis": {"type": "category"},
        "yaxis": {"type": "category", "autorange": "reversed", "automargin": True},
    }
    return Chart(
        "compare-difference",
        "How far apart two configurations are",
        "Eq. 3.2 of Segerstedt: twice the distance of the means over the sum of the standard deviations. "
        "Under 0.2 the two can hardly be told apart; 1 means that the means lie a standard deviation apart.",
        layout=layout,
        height=max(240, 90 + 42 * len(order)),
        choose="Error over",
        options=options,
    )


def _dots(name: str, x: Sequence, y: Sequence, colour: str, hover: str) -> Trace:
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": list(x),
        "y": list(y),
        "marker": {"color": colour, "size": 9, "opacity": 0.85},
        "hovertemplate": f"{hover}<extra>%{{fullData.name}}</extra>",
    }


def _passes(entry: Mapping[str, Any]) -> list[float]:
    """Where each section ends, in passes."""
    sections = [s for s in entry.get("section", ()) if s is not None]
    most = max(sections, default=1)
    return [p - 1 + s / most for p, s in zip(entry.get("pass", ()), entry.get("section", ()), strict=True)]
