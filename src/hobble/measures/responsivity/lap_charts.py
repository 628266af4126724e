"""Charts of the laps of the track: the time of each step of a frame, and the paths of the character."""

from __future__ import annotations

from typing import Any

from hobble.measures.inputs import Json
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, Trace, axis, line_trace, reference_line

# The steps of a frame, in order -> their colours. `hobble.runtime.controller` says what each step does.
STEPS = {
    "prepare": "@g0",
    "input": "@g3",
    "insert": "@g5",
    "predict": "@accent",
    "output": "@g2",
    "update": "@muted",
}

OFF_TRACK = 100.0  # cm from the line between two waypoints; places farther away are marked in the chart


def lap_steps(lap: dict[str, Any]) -> dict[str, float]:
    """Step of a frame -> its mean milliseconds per frame in one lap.

    If the lap only has the time of a whole frame, the key is "frame".
    """
    times = lap.get("milliseconds")
    if isinstance(times, dict):
        return {k: v for k, v in times.items() if k not in ("total", "sd") and isinstance(v, (int, float))}
    return {"frame": times} if isinstance(times, (int, float)) else {}


def step_order(step: str) -> int:
    """A sort key: steps of a frame have the order of STEPS, and unknown steps come last."""
    return list(STEPS).index(step) if step in STEPS else len(STEPS)


def lap_chart(found: Json, material: ReportMaterial) -> Chart | None:
    """Milliseconds per frame of each step, stacked, lap by lap, for each phase mode."""
    options = {}
    for entry in found.get("modes") or [found]:
        traces = _lap_bars(entry)
        if traces:
            options[f"{entry.get('mode', 'the')} phase"] = traces
    if not options:
        return None
    # The configured phase mode comes first, because the chart begins with the first option.
    configured = f"{found.get('mode', 'the')} phase"
    options = {name: options[name] for name in sorted(options, key=lambda name: name != configured)}
    shapes, notes = [], []
    published = material.published_entry("responsivity")
    if published:
        shape, note = reference_line(
            published["milliseconds"], f"{published['label']}: published mean", vertical=False
        )
        shapes, notes = [shape], [note]
    lap_counts = [max(len(trace["x"]) for trace in traces) for traces in options.values()]
    laps = max(lap_counts)
    fewer_laps = (
        f" In the other phase modes there are only {min(lap_counts)} laps, to save time."
        if min(lap_counts) < laps
        else ""
    )
    return Chart(
        "laps",
        "Milliseconds per frame, lap by lap",
        "Each bar is one lap of the track. Its segments are the stages of computing a frame, averaged over "
        "the first seconds of the lap. Prepare: the target, the path and the ground; input: collect the "
        "network's input; insert: standardise this input; predict: evaluate the network; output: turn its "
        "output into a pose; update: move on by a frame. A diamond is the median time of a whole frame. If "
        "another program delays a few frames, the bar becomes higher, but the diamond hardly moves. At 60 "
        "Hz, a frame may take 16.7 ms." + fewer_laps,
        layout={
            "barmode": "stack",
            "xaxis": axis("lap", dtick=1 if laps < 25 else None),
            "yaxis": axis("ms per frame", rangemode="tozero"),
            "shapes": shapes,
            "annotations": notes,
        },
        choose="Phase mode" if len(options) > 1 else None,
        options=options,
    )


def track_chart(found: Json) -> Chart | None:
    """The track from above, the stored paths of laps, and the places where they are far from the track."""
    track, runs = found.get("track") or {}, found.get("runs") or []
    if not runs or not track.get("x"):
        return None
    labels = [f"{i}, {gait}" for i, gait in enumerate(track["gaits"])]
    closed_x, closed_z = [*track["x"], track["x"][0]], [*track["z"], track["z"][0]]
    traces = [line_trace("track", closed_x, closed_z, "@faint", dash="dash", width=1.2, hoverinfo="skip")]
    for run in runs:
        name = "laps" if run is runs[0] else f"lap {run['lap']}"
        shown = {"legendgroup": "runs", "showlegend": run is runs[0]}
        traces.append(line_trace(name, run["x"], run["z"], "@accent", width=1.5, hoverinfo="skip", **shown))
    places = [
        (x, z, cm, run["lap"])
        for run in runs
        for x, z, cm in zip(run["x"], run["z"], run["off_cm"], strict=True)
    ]
    off_track = [place for place in places if place[2] > OFF_TRACK]
    if off_track:
        traces.append(_off_track_markers(off_track))
    traces.append(
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "waypoints",
            "x": track["x"],
            "y": track["z"],
            "text": labels,
            "textposition": "top center",
            "textfont": {"size": 11, "color": "@soft"},
            "marker": {"symbol": "circle-open", "size": 12, "color": "@ink"},
            "hoverinfo": "skip",
        }
    )
    largest = max(place[2] for place in places)
    where = f"Places more than {OFF_TRACK:.0f} cm from the track are red. " if off_track else ""
    return Chart(
        "track",
        "The track, and the path of the character",
        "From above. Dashed lines join the waypoints. The label of a waypoint is its number and the gait on "
        "the way to it. A waypoint is reached when the character is within a metre of it. Solid lines are "
        "the paths of the first laps. "
        f"{where}On these laps, the largest distance from the track was {largest:.0f} cm.",
        traces,
        {
            "xaxis": axis("x, m", constrain="domain", zeroline=False),
            "yaxis": axis("z, m", scaleanchor="x", autorange="reversed", zeroline=False),
        },
        height=520,
    )


def _off_track_markers(places: list[tuple[float, float, float, int]]) -> Trace:
    """Markers at places far from the track. places: (x and z in m, distance from the track in cm, lap)."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": f"more than {OFF_TRACK:.0f} cm off",
        "x": [x for x, *_ in places],
        "y": [z for _, z, *_ in places],
        "customdata": [[cm, lap] for *_, cm, lap in places],
        "marker": {"size": 6, "color": "@hurt-high"},
        "hovertemplate": "lap %{customdata[1]}: %{customdata[0]:.0f} cm off<extra></extra>",
    }


def _lap_bars(entry: dict[str, Any]) -> list[Trace]:
    """Stacked bars of the steps' mean times in each lap, and diamonds at the medians.

    entry: the results of one phase mode.
    """
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
        for step in sorted(lap_steps(laps[0]), key=step_order)
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
    """Median time of a whole frame in one lap, ms; None if it is not known."""
    times = lap.get("milliseconds")
    return (times.get("spread") or {}).get("median") if isinstance(times, dict) else None
