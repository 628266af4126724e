"""What the page of a comparison shows of frame times, network sizes and laps of the track."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hobble.report.parts import (
    Chart,
    Column,
    Compared,
    OverviewColumn,
    PageSection,
    SectionPart,
    Trace,
    Verdict,
    axis,
    configuration_colours,
    configuration_names,
    dot_trace,
    format_bytes,
    format_number,
    line_trace,
    verdict_on_lowest,
)


def section(compared: Compared) -> PageSection:
    """Two charts: the times of the laps, and the time of a frame over the size of the network."""
    parts = [SectionPart(10, lap_lines(compared)), SectionPart(20, fit_chart(compared))]
    return PageSection("speed", parts, title="Time per frame", order=30)


def columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Median time per frame (in the exact phase mode if it was run), and two sizes of the network."""
    exact = in_exact_mode(compared)
    frames = {name: entry["milliseconds"]["spread"]["median"] for name, entry in exact.items()}
    yield OverviewColumn(30, Column.number("ms per frame, median"), frames)
    about = {entry["configuration"]: entry for entry in compared["configurations"]}
    counts = {name: (entry["computations"] or {}).get("true") for name, entry in about.items()}
    yield OverviewColumn(40, Column.count("parameters of one frame"), counts)
    yield OverviewColumn(110, Column("in memory", lambda v: format_bytes(float(v)), "n"), _bytes(compared))


def verdicts(compared: Compared) -> Iterator[Verdict]:
    """Which configuration stays closest to the track, and which is smoothest, fastest and smallest.

    Only configurations that reached every waypoint can be the closest or the smoothest.
    """
    exact = in_exact_mode(compared)
    arrived = {name: e for name, e in exact.items() if e["waypoints_reached"] == e["waypoints"]}
    astray = [name for name in exact if name not in arrived]
    left_out = f" Did not reach every waypoint: {', '.join(astray)}." if astray else ""
    yield from verdict_on_lowest(
        20,
        "Closest to the track",
        {name: e["path_overshoot_cm"] for name, e in arrived.items()},
        lambda name, v: f"{name} is never more than {format_number(v, 3)} cm off the track",
        left_out,
    )
    yield from verdict_on_lowest(
        30,
        "Smoothest",
        {name: e["foot_slide_cm"] for name, e in arrived.items()},
        lambda name, v: (
            f"the feet of {name} slide {format_number(v, 2)} cm a step, and no joint turns more than "
            f"{format_number(exact[name]['largest_turn_degrees'], 2)} degrees in a frame"
        ),
    )
    yield from verdict_on_lowest(
        40,
        "Fastest",
        {name: e["milliseconds"]["spread"]["median"] for name, e in exact.items()},
        lambda name, v: f"the median frame of {name} takes {format_number(v, 3)} ms",
    )
    yield from verdict_on_lowest(
        50, "Smallest", _bytes(compared), lambda name, v: f"{name} needs {format_bytes(v)} of memory to run"
    )


def in_exact_mode(compared: Compared) -> dict[str, Any]:
    """Configuration -> its results in the exact phase mode, or in another one if the exact mode was not run.

    The exact mode evaluates the network without approximation.
    """
    exact = {entry["configuration"]: entry["exact"] for entry in compared["configurations"]}
    # The exact mode of a configuration comes last, so that it replaces the other modes in `by_name`.
    ordered = sorted(compared["responsivity"], key=lambda e: e["mode"] == exact[e["configuration"]])
    by_name = {entry["configuration"]: entry for entry in ordered}
    return {name: by_name[name] for name in configuration_names(compared) if name in by_name}


def _bytes(compared: Compared) -> dict[str, float]:
    """Configuration -> bytes of its network's weights in memory, in the exact phase mode."""
    return {e["configuration"]: e["weights_bytes"][e["exact"]] for e in compared["configurations"]}


def lap_lines(compared: Compared) -> Chart | None:
    """Milliseconds per frame, lap by lap, for each phase mode."""
    options: dict[str, list[Trace]] = {}
    # The cubic mode comes first, because the chart begins with the first option.
    for entry in sorted(compared["responsivity"], key=lambda entry: entry["mode"] != "cubic"):
        laps = [lap for lap in entry["laps"] if isinstance(lap.get("milliseconds"), dict)]
        x, y = [lap["lap"] for lap in laps], [lap["milliseconds"]["spread"]["median"] for lap in laps]
        colour = configuration_colours(compared)[entry["configuration"]]
        trace = line_trace(entry["configuration"], x, y, colour, mode="lines+markers")
        options.setdefault(f"{entry['mode']} phase", []).append(trace)
    if not options:
        return None
    for traces in options.values():
        for row in compared["published"]["responsivity"]:
            if row["configuration"] in configuration_names(compared):
                last_lap = max((max(t["x"], default=1) for t in traces), default=1)
                colour = configuration_colours(compared)[row["configuration"]]
                label = f"{row['label']}: published mean"
                traces.append(
                    line_trace(label, [1, last_lap], [row["milliseconds"]] * 2, colour, dash="dot", width=1.2)
                )
    return Chart(
        "compare-laps",
        "Milliseconds per frame, lap by lap",
        "Median time of a whole frame in each lap of the track. Dotted lines are published means, measured "
        "on another machine.",
        layout={"xaxis": axis("lap", dtick=1), "yaxis": axis("ms per frame", rangemode="tozero")},
        choose="Phase mode",
        options=options,
    )


def fit_chart(compared: Compared) -> Chart | None:
    """Frame time over the number of parameters: our times and the published ones, each with a fitted line."""
    # At most two fits: our medians in the cubic mode, and the published means, which have no mode.
    shown_fits = [
        fit
        for fit in compared["milliseconds"]["fit"]
        if fit["computations"] == "true"
        and fit["step"] == ("median" if fit["whose"] == "hobble" else "total")
        and fit["mode"] in (None, "cubic")
        and fit["x"]
    ]
    traces: list[Trace] = []
    for fit, colour in zip(shown_fits, ("@accent", "@g2"), strict=False):
        label = "ours (medians, cubic phase)" if fit["whose"] == "hobble" else "published (means)"
        traces.append(dot_trace(label, fit["x"], fit["y"], colour, "%{x:,} parameters: %{y:.3f} ms"))
        if fit["slope"] is not None:
            ends = [min(fit["x"]), max(fit["x"])]
            values = [fit["intercept"] + fit["slope"] * x for x in ends]
            traces.append(line_trace(f"{label}, straight fit", ends, values, colour, width=1.4))
    if not traces:
        return None
    layout = {
        "xaxis": axis("parameters of one frame", tickformat="~s", rangemode="tozero"),
        "yaxis": axis("ms per frame", rangemode="tozero"),
    }
    caption = (
        "If the dots lie on a straight line, the time of a frame is a constant plus a time proportional to "
        "the number of parameters."
    )
    return Chart("compare-fit", "Frame time over network size", caption, traces, layout, 340)
