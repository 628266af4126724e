"""What a frame costs in configurations side by side."""

from __future__ import annotations

from collections.abc import Iterator

from hobble.report.charts import Chart, Trace, axis, line
from hobble.report.formats import size
from hobble.report.measured import Overview
from hobble.report.parts import Part, Section
from hobble.report.side_by_side import Compared, colours, dots, names
from hobble.report.tables import Column


def section(compared: Compared) -> Section:
    """Laps, and time over size."""
    parts = [Part(10, lap_lines(compared)), Part(20, fit_chart(compared))]
    return Section("speed", parts, title="Speed and response", at=30, nav="Speed")


def columns(compared: Compared) -> Iterator[Overview]:
    """The median of a frame, in the cubic mode where it was run, and the size of the network."""
    frames = {
        entry["configuration"]: entry["milliseconds"]["spread"]["median"]
        for entry in sorted(compared["responsivity"], key=lambda entry: entry["mode"] == "cubic")
    }
    yield Overview(30, Column.number("ms a frame, median"), frames)
    about = {entry["configuration"]: entry for entry in compared["configurations"]}
    counts = {name: entry["computations"]["true"] for name, entry in about.items()}
    yield Overview(40, Column.count("parameters"), counts)
    weights = {name: entry["weights_bytes"]["cubic"] for name, entry in about.items()}
    yield Overview(110, Column("weights", lambda v: size(float(v)), "n"), weights)


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
        traces.append(dots(label, fit["x"], fit["y"], colour, "%{x:,} parameters: %{y:.3f} ms"))
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
