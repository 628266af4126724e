"""The time of a frame at run time, and how closely the character follows the track."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hobble.measures.given import Json
from hobble.report.charts import Chart, Trace, axis, line, mark
from hobble.report.formats import number
from hobble.report.gather import Material
from hobble.report.parts import Numbers, Part, Section, Words
from hobble.report.published import cited
from hobble.report.summary import Figure, Hint, placed
from hobble.report.tables import Column, Table
from hobble.runtime.controller import FASTEST_TURN

# The steps of a frame in order, with their colours.
STEPS = {
    "prepare": "@g0",
    "input": "@g3",
    "insert": "@g5",
    "predict": "@accent",
    "output": "@g2",
    "update": "@muted",
}

FEWEST_STEPS = 10  # with fewer steps, the mean foot slide is not shown
OFF_TRACK = 100.0  # cm from the line between two waypoints; farther places are marked
FRAME_BUDGET_MS = 1000 / 60
TRACK = "The character is steered around a track of six waypoints: it walks, side-steps, jogs and crouches."


def section(found: Json, material: Material) -> Section:
    """The track, the times of the laps, and the published times."""
    followed = track_figures(found)
    return Section(
        "speed",
        [
            Part(0, Words(TRACK) if followed else None),
            Part(10, Numbers(followed) if followed else None),
            Part(15, track_chart(found)),
            Part(20, lap_chart(found, material)),
            Part(30, speed_published(found, material), open=True, short=True),
            Part(60, lap_table(found, material.name)),
        ],
        title="Speed and response",
        at=30,
        nav="Speed",
    )


def figures(found: Json, material: Material) -> Iterator[Figure]:
    """The time of a frame."""
    milliseconds = frame_milliseconds(found)
    if milliseconds is not None:
        theirs = material.published_entry("responsivity")
        note = f"median; one core can run {number(FRAME_BUDGET_MS / milliseconds, 3)} characters at 60 Hz"
        if theirs:
            note += f"; mean {number(frame_mean(found), 2)} ms, published mean {theirs['milliseconds']} ms"
        yield Figure("Time per frame", number(milliseconds, 2), "ms", note, 20)


def hints(found: Json, material: Material) -> Iterator[Hint]:
    """Whether a frame fits into 1/60 s, and whether the character followed the track."""
    yield from placed(60, _speed(found))
    yield from placed(40, _track(found))


def lap_steps(lap: dict[str, Any]) -> dict[str, float]:
    """Milliseconds per frame of each step in one lap, without the total."""
    value = lap.get("milliseconds")
    if isinstance(value, dict):
        return {k: v for k, v in value.items() if k not in ("total", "sd") and isinstance(v, (int, float))}
    return {"frame": value} if isinstance(value, (int, float)) else {}


def _place(step: str) -> int:
    return list(STEPS).index(step) if step in STEPS else len(STEPS)


def lap_chart(found: Json, material: Material) -> Chart | None:
    """Milliseconds per frame of each step, stacked, lap by lap, for each phase mode."""
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
    theirs = material.published_entry("responsivity")
    if theirs:
        shape, note = mark(theirs["milliseconds"], f"{theirs['label']}: published mean", vertical=False)
        shapes, notes = [shape], [note]
    counts = [max(len(trace["x"]) for trace in traces) for traces in options.values()]
    laps = max(counts)
    fewer = (
        f" The other phase modes ran {min(counts)} laps, because from the second lap on all laps are alike."
        if min(counts) < laps
        else ""
    )
    return Chart(
        "laps",
        "Milliseconds per frame, lap by lap",
        "Each bar is one lap of the track. Its segments are the steps of a frame, averaged over the lap. A "
        "diamond is the median of whole frames: a few frames that another program delayed raise the bar but "
        "not the diamond. At 60 Hz, a frame may take 16.7 ms." + fewer,
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
    """The track from above, the paths of the laps, and where they left the track."""
    track, runs = found.get("track") or {}, found.get("runs") or []
    if not runs or not track.get("x"):
        return None
    ends = [f"{i}, {gait}" for i, gait in enumerate(track["gaits"])]
    along = {"x": [*track["x"], track["x"][0]], "z": [*track["z"], track["z"][0]]}
    traces = [line("track", along["x"], along["z"], "@faint", dash="dash", width=1.2, hoverinfo="skip")]
    for run in runs:
        name = "laps" if run is runs[0] else f"lap {run['lap']}"
        shown = {"legendgroup": "runs", "showlegend": run is runs[0]}
        traces.append(line(name, run["x"], run["z"], "@accent", width=1.5, hoverinfo="skip", **shown))
    off = [(x, z, cm, r["lap"]) for r in runs for x, z, cm in zip(r["x"], r["z"], r["off_cm"], strict=True)]
    left = [row for row in off if row[2] > OFF_TRACK]
    if left:
        traces.append(_left(left))
    traces.append(
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "waypoints",
            "x": track["x"],
            "y": track["z"],
            "text": ends,
            "textposition": "top center",
            "textfont": {"size": 11, "color": "@soft"},
            "marker": {"symbol": "circle-open", "size": 12, "color": "@ink"},
            "hoverinfo": "skip",
        }
    )
    most = max(row[2] for row in off)
    where = f"Red marks places more than {OFF_TRACK:.0f} cm from the track. " if left else ""
    return Chart(
        "track",
        "The track, and the path of the character",
        "From above. Dashed lines join the waypoints. Each waypoint has a number and the gait on the way to "
        "it; it counts as reached within a metre. Solid lines are the paths of the first laps. "
        f"{where}The largest distance from the track was {most:.0f} cm.",
        traces,
        {
            "xaxis": axis("x, m", constrain="domain", zeroline=False),
            "yaxis": axis("z, m", scaleanchor="x", autorange="reversed", zeroline=False),
        },
        height=520,
    )


def _left(places: list[tuple[float, float, float, int]]) -> Trace:
    """Markers where laps left the track. places: x, z, distance in cm and lap of each."""
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
    """The median milliseconds per frame of a lap, all steps together."""
    value = lap.get("milliseconds")
    return (value.get("spread") or {}).get("median") if isinstance(value, dict) else None


def lap_table(found: Json, name: str) -> Table | None:
    """A row per lap."""
    laps = found.get("laps")
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
    return Table(f"{name}-responsivity", columns, rows)


def _few(steps: int | None) -> bool:
    return steps is not None and steps < FEWEST_STEPS


def track_figures(found: Json) -> list[Figure]:
    """A few numbers on how the character followed the track."""
    if not isinstance(found.get("laps"), list):
        return []
    spread = (found.get("milliseconds") or {}).get("spread") or {}
    reached = f"{found.get('waypoints_reached')} of {found.get('waypoints')}"
    steps = sum(lap.get("steps") or 0 for lap in found["laps"])
    slide = None if _few(steps) else found.get("foot_slide_cm")
    measured = f"mean slide of the toe during a stance, over {steps:,} steps"
    laps = f"{found.get('laps_finished')} of {len(found['laps'])} laps finished"
    return [
        Figure("Waypoints reached", reached, "", laps),
        Figure(
            "Largest distance from the path",
            number(found.get("path_overshoot_cm")),
            "cm",
            "usually the largest is at a turn",
        ),
        Figure("Foot slide", number(slide), "cm" if slide is not None else "", measured),
        _turn(found),
        Figure("Slow frames", number(spread.get("p99")), "ms", "1 % of the frames are slower"),
    ]


def _turn(found: Json) -> Figure:
    """The largest turn of a joint in one frame: as predicted, and as drawn after the runtime's limit."""
    drawn, predicted = (number(found.get(key)) for key in ("largest_turn_degrees", "predicted_turn_degrees"))
    allowed = f"the runtime limits it to {np.degrees(FASTEST_TURN):.0f}°"
    if found.get("predicted_turn_degrees") is None:
        return Figure("Largest turn of a joint", drawn, "°", f"in one frame, as drawn; {allowed}")
    frames = sum(lap.get("frames") or 0 for lap in found["laps"])
    held = f"{found['turns_held_back']:,} of {frames:,} frames"
    note = f"of a joint in one frame; {allowed}, which changed {held}; largest turn drawn: {drawn}°"
    return Figure("Largest predicted turn", predicted, "°", note)


def speed_published(found: Json, material: Material) -> Table | None:
    """Our milliseconds, followed by the published means."""
    ours = frame_milliseconds(found)
    if ours is None:
        return None
    sources = material.published["sources"]
    mode = found.get("mode")
    rows: list[list[Any]] = [
        [
            f"{material.name}, {mode} phase" if mode else material.name,
            ours,
            frame_mean(found),
            "this report",
        ]
    ]
    for entry in material.published["responsivity"]:
        rows.append([entry["label"], None, entry["milliseconds"], cited(entry, sources)])
    for entry in material.published["modes"]:
        rows.append(
            [
                f"prediction alone, {entry['mode']} phase",
                None,
                entry["milliseconds"],
                cited(entry, sources),
            ]
        )
    columns = [
        Column("network"),
        Column.number("median, ms per frame"),
        Column.number("mean, ms per frame"),
        Column("source", kind="long"),
    ]
    return Table(f"{material.name}-published-speed", columns, rows, "Comparison with published results")


def frame_milliseconds(found: Json) -> float | None:
    """Median milliseconds per frame over all laps, all steps together; robust against outliers."""
    value = found.get("milliseconds")
    median = (value.get("spread") or {}).get("median") if isinstance(value, dict) else None
    return frame_mean(found) if median is None else float(median)


def frame_mean(found: Json) -> float | None:
    """Mean milliseconds per frame, to compare with the published means."""
    value = found.get("milliseconds")
    if isinstance(value, dict):
        value = value.get("total", sum(v for v in value.values() if isinstance(v, (int, float))))
    return float(value) if isinstance(value, (int, float)) else None


def _speed(found: Json) -> Iterator[Hint]:
    milliseconds = frame_milliseconds(found)
    if milliseconds is None:
        return
    if milliseconds > FRAME_BUDGET_MS:
        yield Hint("warn", f"A frame takes {milliseconds:.1f} ms, too slow for 60 Hz.", "Try mode: linear.")
        return
    share = milliseconds / FRAME_BUDGET_MS
    value = found.get("milliseconds")
    slow = (value.get("spread") or {}).get("p99") if isinstance(value, dict) else None
    if slow is not None and slow > FRAME_BUDGET_MS:
        yield Hint(
            "warn",
            f"1 % of the frames take {slow:.1f} ms or more, too slow for 60 Hz.",
            f"The median is {milliseconds:.2f} ms. Measure again while nothing else runs on the machine.",
        )
    elif slow is not None:
        yield Hint(
            "good",
            f"A frame takes {100 * share:.1f} % of the 16.7 ms that 60 Hz allows; 1 % of the frames take "
            f"{100 * slow / FRAME_BUDGET_MS:.0f} % or more.",
            "That is fast enough for a game.",
        )
    else:
        yield Hint("good", f"A frame takes {100 * share:.1f} % of the 16.7 ms that 60 Hz allows.", "")


def _track(found: Json) -> Iterator[Hint]:
    reached, total = (found.get(key) for key in ("waypoints_reached", "waypoints"))
    if total and reached is not None and reached < total:
        yield Hint(
            "warn",
            f"The character reached {reached} of {total} waypoints.",
            "It circles or stops before a waypoint that it does not reach. See the laps under Speed and "
            "response.",
        )
    drawn, predicted = (found.get(key) for key in ("largest_turn_degrees", "predicted_turn_degrees"))
    if drawn is not None and drawn > 60:
        yield Hint(
            "warn",
            f"A joint turned by {drawn:.0f} degrees in one frame.",
            "That is a flip, which is visible on a skinned character.",
        )
    elif predicted is not None and predicted > 60:
        yield Hint(
            "note",
            f"The network predicted a turn of a joint by {predicted:.0f} degrees in one frame.",
            f"The runtime limited it to {drawn:.0f}. Check whether joint rotations flip in the clips.",
        )
