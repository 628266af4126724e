"""Laps of a waypoint track: the time of a frame, and how closely the character follows the track.

The laps are repeated in each phase mode. A phase mode is a way to evaluate the network, such as cubic
interpolation over the phase.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import PhaseMode, Positive, Section
from hobble.measures.compare import (
    ComparisonAddition,
    ConfigurationResults,
    compare_series,
    fit_line,
    mean_and_sd,
    published_differences,
    published_row,
)
from hobble.measures.measure import Cost, Measure, Row
from hobble.measures.shown import boxes, chart, table, words
from hobble.report.parts import (
    Chart,
    Column,
    Compared,
    Hint,
    KeyFigure,
    KeyFigures,
    OverviewColumn,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    Trace,
    Verdict,
    axis,
    bar_trace,
    citation,
    configuration_colours,
    configuration_names,
    dot_trace,
    format_bytes,
    format_number,
    line_trace,
    marker_trace,
    reference_line,
    verdict_on_lowest,
    with_order,
)
from hobble.runtime.options import Runtime


class Options(Section):
    """The keys of this measurement in a configuration's section `evaluation`."""

    laps: Positive = Field(19, description="laps in the phase mode of the section `runtime`")
    laps_other_modes: Positive = Field(
        3,
        description="at most this many laps in each other phase mode, to save time; in the mode constant "
        "always `laps`, because the published times were measured in it",
    )
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="seconds after which a lap is stopped"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes to measure in addition to the one in the section `runtime`",
    )


MEASURE = Measure(
    name="responsivity",
    module=__name__,
    inputs=("weights",),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_mb=200, least_minutes=60),
)


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


def lap_chart(found: Json, material: ReportMaterial) -> Chart | None:
    """Milliseconds per frame of each step, stacked, lap by lap, for each phase mode."""
    if not found.get("laps"):
        return None
    # The configured phase mode comes first, because the chart begins with the first option.
    entries = sorted(found["modes"], key=lambda entry: entry["mode"] != found["mode"])
    options = {f"{entry['mode']} phase": _lap_bars(entry["laps"]) for entry in entries}
    line = {}
    if published := material.published_entry("responsivity"):
        text = f"{published['label']}: published mean"
        line = reference_line(published["milliseconds"], text, vertical=False)
    laps, fewest = (pick(len(entry["laps"]) for entry in entries) for pick in (max, min))
    layout = {
        "barmode": "stack",
        "xaxis": axis("lap", dtick=1 if laps < 25 else None),
        "yaxis": axis("ms per frame", rangemode="tozero"),
        **line,
    }
    more, choose = ["fewer"] if fewest < laps else [], "Phase mode" if len(options) > 1 else None
    return chart("laps", layout=layout, choose=choose, options=options, more=more, fewest=fewest)


def track_chart(found: Json) -> Chart | None:
    """The track from above, the stored paths of laps, and the places where they are far from the track."""
    track, runs = found.get("track") or {}, found.get("runs") or []
    if not runs or not track.get("x"):
        return None
    closed_x, closed_z = [*track["x"], track["x"][0]], [*track["z"], track["z"][0]]
    traces = [line_trace("track", closed_x, closed_z, "@faint", dash="dash", width=1.2, hoverinfo="skip")]
    for run in runs:
        name, shown = "laps" if run is runs[0] else f"lap {run['lap']}", run is runs[0]
        style = {"width": 1.5, "hoverinfo": "skip", "legendgroup": "runs", "showlegend": shown}
        traces.append(line_trace(name, run["x"], run["z"], "@accent", **style))
    places = [
        (x, z, [cm, run["lap"]])
        for run in runs
        for x, z, cm in zip(run["x"], run["z"], run["off_cm"], strict=True)
    ]
    off_track = [place for place in places if place[2][0] > OFF_TRACK]
    if off_track:
        x, z, cm_and_lap = map(list, zip(*off_track, strict=True))
        hover = "lap %{customdata[1]}: %{customdata[0]:.0f} cm off<extra></extra>"
        red, name = {"size": 6, "color": "@hurt-high"}, f"more than {OFF_TRACK:.0f} cm off"
        traces.append(marker_trace(name, x, z, red, customdata=cm_and_lap, hovertemplate=hover))
    circle = {"symbol": "circle-open", "size": 12, "color": "@ink"}
    labels = {
        "mode": "markers+text",
        "text": [f"{i}, {gait}" for i, gait in enumerate(track["gaits"])],
        "textposition": "top center",
        "textfont": {"size": 11, "color": "@soft"},
    }
    traces.append(marker_trace("waypoints", track["x"], track["z"], circle, hoverinfo="skip", **labels))
    layout = {
        "xaxis": axis("x, m", constrain="domain", zeroline=False),
        "yaxis": axis("z, m", scaleanchor="x", autorange="reversed", zeroline=False),
    }
    largest, more = f"{max(place[2][0] for place in places):.0f}", ["off"] if off_track else []
    return chart(
        "track", traces, layout, 520, more=[*more, "largest"], limit=f"{OFF_TRACK:.0f}", largest=largest
    )


def _lap_bars(laps: Sequence[Json]) -> list[Trace]:
    """Stacked bars of the steps' mean times in each lap of a phase mode, and diamonds at the medians."""
    numbers, hover = [lap["lap"] for lap in laps], "lap %{x}: %{y:.3f} ms<extra>%{fullData.name}</extra>"
    bars = [
        bar_trace(step, numbers, [lap["milliseconds"][step] for lap in laps], colour, hover)
        for step, colour in STEPS.items()
    ]
    medians = [lap["milliseconds"]["spread"]["median"] for lap in laps]
    diamond = {"symbol": "diamond", "size": 8, "color": "@ink"}
    return [*bars, marker_trace("median", numbers, medians, diamond, hovertemplate=hover)]


FEWEST_STEPS = 10  # if the character takes fewer steps, the mean foot slide is not shown
FRAME_BUDGET_MS = 1000 / 60  # the time that a frame may take at 60 Hz
FLIP_DEGREES = 60  # if a joint turns by more than this in one frame, it flips visibly
# Columns of the table of laps, by the keys of a lap in responsivity.json.
LAP_HEADS = {
    "lap": "lap",
    "finished": "finished",
    "waypoints_reached": "waypoints reached",
    "seconds": "seconds",
    "frames": "frames",
    "path_distance_cm": "mean distance from the track, cm",
    "path_overshoot_cm": "largest distance from the track, cm",
    "steps": "steps",
    "foot_slide_cm": "mean foot slide of a step, cm",
    "predicted_turn_degrees": "largest turn of a joint in a frame as predicted, °",
    "largest_turn_degrees": "largest turn of a joint in a frame as drawn, °",
    "turns_held_back": "frames in which a turn was limited",
    **{step: f"{step}, mean ms" for step in STEPS},
    "median": "whole frame, median ms",
}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The track, the times of the laps, the published times, and a table of the laps."""
    if not found.get("laps"):
        return PageSection("speed", [])
    parts = [
        SectionPart(0, Paragraph(words("speed.track"))),
        SectionPart(10, KeyFigures(track_figures(found))),
        SectionPart(15, track_chart(found)),
        SectionPart(20, lap_chart(found, material)),
        SectionPart(30, speed_table(found, material), open=True, short=True),
        SectionPart(60, lap_table(found, material.name)),
    ]
    title, nav = "Steering and time per frame", "Steering and time"
    return PageSection("speed", parts, title=title, order=30, nav=nav)


def figures(found: Json, material: ReportMaterial) -> Iterator[KeyFigure]:
    """A key figure for the top of the report: the time of a frame."""
    if found.get("milliseconds"):
        milliseconds = frame_milliseconds(found)
        published = material.published_entry("responsivity")
        characters = format_number(FRAME_BUDGET_MS / milliseconds, 3)
        note = f"median; one core can run {characters} characters at 60 Hz"
        if published:
            mean = format_number(found["milliseconds"]["total"], 2)
            note += f"; mean {mean} ms, published mean {published['milliseconds']} ms"
        yield KeyFigure("Time per frame", format_number(milliseconds, 2), "ms", note, 20)


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Whether a frame fits into 1/60 s, and whether the character followed the track."""
    if found.get("laps"):
        yield from with_order(60, _speed_hints(found))
        yield from with_order(40, _track_hints(found))


def lap_table(found: Json, name: str) -> Table:
    """A row per lap: how it went, the mean time of each step of a frame, and the median time of a frame."""
    records = [
        {**lap, **lap["milliseconds"], "median": lap["milliseconds"]["spread"]["median"]}
        | ({"foot_slide_cm": None} if lap["steps"] < FEWEST_STEPS else {})
        for lap in found["laps"]
    ]
    show = {"finished": lambda finished: "yes" if finished else "no"}
    return table(f"{name}-responsivity", records, LAP_HEADS, show=show)


def track_figures(found: Json) -> list[KeyFigure]:
    """Key figures: how well the character followed the track."""
    from hobble.runtime.network_rows import FASTEST_TURN  # here, because planning need not load numba

    laps = found["laps"]
    steps = sum(lap["steps"] for lap in laps)
    slide = None if steps < FEWEST_STEPS else found["foot_slide_cm"]
    turn = words(
        "speed.turn",
        limit=f"{np.degrees(FASTEST_TURN):.0f}",
        limited=f"{found['turns_held_back']:,} of {sum(lap['frames'] for lap in laps):,} frames",
        drawn=format_number(found["largest_turn_degrees"]),
    )
    reached = f"{found['waypoints_reached']} of {found['waypoints']}"
    overshoot, slow = format_number(found["path_overshoot_cm"]), found["milliseconds"]["spread"]["p99"]
    return [
        KeyFigure("Waypoints reached", reached, "", f"{found['laps_finished']} of {len(laps)} laps finished"),
        KeyFigure("Largest distance from the track", overshoot, "cm", "the largest of all laps"),
        KeyFigure(
            "Foot slide",
            format_number(slide),
            "cm" if slide is not None else "",
            words("speed.slide", steps=f"{steps:,}"),
        ),
        KeyFigure("Largest predicted turn", format_number(found["predicted_turn_degrees"]), "°", turn),
        KeyFigure("Slow frames", format_number(slow), "ms", "1 % of the frames are slower"),
    ]


def speed_table(found: Json, material: ReportMaterial) -> Table:
    """A table of milliseconds per frame: ours in each phase mode, followed by the published means.

    Mean and standard deviation (n - 1) are those of the means of the laps, as published.
    """
    rows: list[Row] = []
    for entry in found["modes"]:
        mean, sd = mean_and_sd(lap_means(entry))
        name = f"{material.name}, {entry['mode']} phase"
        times = {"median": frame_milliseconds(entry), "milliseconds": mean, "sd": sd}
        rows.append({"network": name, **times, "source": "this report"})
    for entry in (*material.published["responsivity"], *material.published["modes"]):
        name = entry.get("label") or f"prediction alone, {entry['configuration']}, {entry['mode']} phase"
        name += ", constant phase" if "label" in entry else ""
        rows.append({**entry, "network": name, "source": citation(entry, material.published["sources"])})
    heads = {
        "network": "network",
        "median": "median of all frames, ms",
        "milliseconds": "mean of the laps, ms per frame",
        "sd": "sd of the laps, ms",
        "source": "source",
    }
    title = "Comparison with published results"
    return table(f"{material.name}-published-speed", rows, heads, title, long=["source"])


def frame_milliseconds(found: Json) -> float:
    """Median milliseconds of a whole frame over all laps. A few slow frames hardly change it."""
    return float(found["milliseconds"]["spread"]["median"])


def _speed_hints(found: Json) -> Iterator[Hint]:
    milliseconds, slow = frame_milliseconds(found), found["milliseconds"]["spread"]["p99"]
    if milliseconds > FRAME_BUDGET_MS:
        head = f"A frame takes {milliseconds:.1f} ms, too slow for 60 Hz."
        yield Hint("warn", head, "Try mode: linear in the section runtime.")
    elif slow > FRAME_BUDGET_MS:
        head = f"1 % of the frames take {slow:.1f} ms or more, too slow for 60 Hz."
        yield Hint("warn", head, words("speed.slow", median=f"{milliseconds:.2f}"))
    else:
        share, most = 100 * milliseconds / FRAME_BUDGET_MS, math.ceil(100 * slow / FRAME_BUDGET_MS)
        head = words("speed.fast", share=f"{share:.1f}", most=most)
        yield Hint("good", head, "That is fast enough for a game.")


def _track_hints(found: Json) -> Iterator[Hint]:
    reached, total = found["waypoints_reached"], found["waypoints"]
    if reached < total:
        head = f"The character reached {reached} of {total} waypoints."
        yield Hint("warn", head, words("speed.circles"))
    drawn, predicted = found["largest_turn_degrees"], found["predicted_turn_degrees"]
    if drawn > FLIP_DEGREES:
        head = f"A joint turned by {drawn:.0f} degrees in one frame."
        yield Hint("warn", head, words("speed.flipped"))
    elif predicted > FLIP_DEGREES:
        head = f"The network predicted a turn of a joint by {predicted:.0f} degrees in one frame."
        yield Hint("note", head, words("speed.flips", drawn=f"{drawn:.0f}"))


# Three ways to count the weights and biases that one frame uses, explained at `parameter_counts` in
# hobble.measures.responsivity.run. compare.json calls such a count "computations".
COUNTS = ("true", "table_6_1", "table_6_1_as_printed")


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The laps of the track in each phase mode, the networks' sizes, and published sizes and times."""
    sizes, differences = {m.name: _sizes(m) for m in all_measured}, time_differences(all_measured)
    constant = [row for row in differences if row["over"] == "constant"]
    fits = fit_lines(all_measured, published)
    return ComparisonAddition(
        entries=[entry for m in all_measured for entry in mode_entries(m)],
        about=sizes,
        against_published=_published_sizes(sizes, published),
        milliseconds={
            "difference": differences,
            "fit": fits,
            "against_published": [
                *_published_times(all_measured, published),
                *published_differences("milliseconds", constant, published),
                *_published_regression(fits, published["regression"]),
            ],
        },
    )


def tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Three tables: every lap; the published laps; the lines of time over size, without their points."""
    fit = compared["milliseconds"]["fit"]
    return {
        "responsivity": [lap for entry in compared["responsivity"] for lap in _lap_rows(entry)],
        "published-laps": published_lap_rows(compared["published"]),
        "fit": [{k: v for k, v in row.items() if k not in ("x", "y")} for row in fit],
    }


def mode_entries(results: ConfigurationResults) -> list[Json]:
    """A configuration's results in each phase mode that was run. The key `configuration` has its name."""
    modes = results.results_of("responsivity")["modes"]
    return [{**entry, "configuration": results.name} for entry in modes]


def _sizes(results: ConfigurationResults) -> dict[str, Any]:
    found = results.results_of("responsivity")
    counts = found["parameters"]
    return {
        "computations": {key: counts[key] if counts else None for key in COUNTS},
        "weights_bytes": {mode: count * found["bytes_each"] for mode, count in found["stored"].items()},
        "exact": found["exact"],
    }


def time_differences(all_measured: Sequence[ConfigurationResults]) -> list[dict[str, Any]]:
    """How much the frame times of any two configurations differ, in each phase mode that both have run.

    The difference is computed by eq. 3.2 of Segerstedt (2021), see `compare_series`.
    """
    series: dict[str, dict[str, Json]] = {}
    for results in all_measured:
        for entry in mode_entries(results):
            times = entry["milliseconds"]
            of_mode = {"mean": times["total"], "sd": times["spread"]["sd"], "means": lap_means(entry)}
            series.setdefault(results.name, {})[entry["mode"]] = of_mode
    return [
        {"a": a, "b": b, "over": mode, **compare_series(series[a][mode], series[b][mode])}
        for a, b in combinations(series, 2)
        for mode in series[a]
        if mode in series[b]
    ]


def fit_lines(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Straight lines of milliseconds per frame over computations, for our times and for the published times.

    computations: one of COUNTS. step: which time is fitted. "total" is the mean time of a whole frame; the
    published times are such means. "predict" is the mean time of the step `predict`. "median" is the median
    time of a whole frame; other programs on the machine change it least. mode: None for published times.
    slope: milliseconds per computation. Configurations with the same network are separate points. Networks
    without layers are left out.
    """
    entries = [
        (m.results_of("responsivity")["parameters"], entry) for m in all_measured for entry in mode_entries(m)
    ]
    entries = [(sizes, entry) for sizes, entry in entries if sizes]
    modes = dict.fromkeys(entry["mode"] for _, entry in entries)
    out = []

    def add(
        whose: str, mode: str | None, step: str, counts: str, points: Sequence[tuple[int, float]]
    ) -> None:
        """points: (computations, milliseconds)."""
        labels = {"whose": whose, "mode": mode, "step": step, "computations": counts}
        x, y = [size for size, _ in points], [time for _, time in points]
        out.append({**labels, "x": x, "y": y, **fit_line(x, y)})

    for counts, mode, step in product(COUNTS, modes, ("total", "predict", "median")):
        times = [
            (sizes[counts], (e["milliseconds"] | e["milliseconds"]["spread"])[step])
            for sizes, e in entries
            if e["mode"] == mode
        ]
        add("hobble", mode, step, counts, times)
    published_times = {row["configuration"]: row["milliseconds"] for row in published["responsivity"]}
    for counts, key in (("true", "parameters"), ("table_6_1_as_printed", "table_6_1")):
        rows = [row for row in published["computations"] if row["configuration"] in published_times]
        add("published", None, "total", counts, [(r[key], published_times[r["configuration"]]) for r in rows])
    return out


def lap_means(entry: Json) -> list[float]:
    """Milliseconds per frame of each lap, all steps together."""
    return [lap["milliseconds"]["total"] for lap in entry["laps"]]


def _published_sizes(sizes_of: Mapping[str, Json], published: Json) -> list[dict[str, Any]]:
    """Published sizes of networks next to ours. sizes_of: configuration -> sizes of its network."""
    out = []
    for row in published["computations"]:
        counts = sizes_of.get(row["configuration"], {}).get("computations", {})
        printed, in_table = counts.get("table_6_1_as_printed"), {**row, "table": "6.1"}
        counted = {**row, "source": "hobble"}
        out.append(published_row("computations of Table 6.1", in_table, row["table_6_1"], printed))
        out.append(published_row("parameters of a phase", counted, row["parameters"], counts.get("true")))
    for row in published["stages"]:
        if row["stage"] == "training" and "bytes" in row:
            # The published weights are those of the constant mode, which stores the weights of 50 phases.
            ours = sizes_of.get(row["configuration"], {}).get("weights_bytes", {}).get("constant")
            out.append(published_row(row["what"], row, row["bytes"], ours, "bytes"))
    return out


def _published_times(all_measured: Sequence[ConfigurationResults], published: Json) -> list[dict[str, Any]]:
    """Published times next to ours: of a frame, from whole laps in the mode constant, and of a prediction."""
    modes = {m.name: {e["mode"]: e for e in mode_entries(m)} for m in all_measured}
    out = []
    for row in published["responsivity"]:
        entry = modes.get(row["configuration"], {}).get("constant")
        mean, sd = mean_and_sd(lap_means(entry) if entry else [])
        out.append(published_row("a frame", row, row["milliseconds"], mean, "ms"))
        out.append(published_row("standard deviation of the means of laps", row, row["sd"], sd, "ms"))
    for row in published["modes"]:
        entry = modes.get(row["configuration"], {}).get(row["mode"])
        ours, what = entry["milliseconds"]["predict"] if entry else None, f"a prediction, {row['mode']}"
        out.append(published_row(what, row, row["milliseconds"], ours, "ms"))
    return out


def _published_regression(fits: Sequence[Json], row: Json) -> list[dict[str, Any]]:
    """The line of Figure 6.1 beside ours in the mode constant, both over the computations of Table 6.1."""
    wanted = {"whose": "hobble", "mode": "constant", "step": "total", "computations": "table_6_1_as_printed"}
    ours = next((fit for fit in fits if wanted.items() <= fit.items()), {"slope": None, "intercept": None})
    row = {**row, "configuration": "all"}
    per_computation = "milliseconds for each computation of Table 6.1"
    return [
        published_row(per_computation, row, row["slope"], ours["slope"]),
        published_row("milliseconds at no computation", row, row["intercept"], ours["intercept"], "ms"),
    ]


def _lap_rows(entry: Json) -> list[Row]:
    """A row for each lap in one phase mode. entry: from `mode_entries`."""
    rows: list[Row] = []
    for lap in entry["laps"]:
        times = lap["milliseconds"]
        of_steps = {f"milliseconds_{key}": times[key] for key in (*STEPS, "total")}
        of_steps |= {f"milliseconds_{key}_sd": sd for key, sd in times["sd"].items()}
        of_steps |= {f"milliseconds_{key}": value for key, value in times["spread"].items()}
        row = {key: value for key, value in lap.items() if key != "milliseconds"}
        rows.append({"configuration": entry["configuration"], "mode": entry["mode"], **row, **of_steps})
    return rows


def published_lap_rows(published: Json) -> list[Row]:
    """Table A.3 of Segerstedt (2021): milliseconds a frame in each of 19 laps."""
    return [
        {"lap": lap, **dict(zip(published["laps"], times, strict=True))}
        for lap, times in enumerate(zip(*published["laps"].values(), strict=True), 1)
    ]


def compared_section(compared: Compared) -> PageSection:
    """Charts of the times of the laps, and of the time of a frame over the size of the network."""
    rows, title = published_lap_rows(compared["published"]), "Table A.3 of Segerstedt, ms per frame"
    parts = [
        SectionPart(10, lap_lines(compared)),
        SectionPart(15, lap_boxes(compared)),
        SectionPart(20, fit_chart(compared)),
        SectionPart(30, table("compare-published-laps", rows, title=title)),
    ]
    return PageSection("speed", parts, title="Time per frame", order=30)


def compared_columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Median time per frame (in the exact phase mode if it was run), and two sizes of the network."""
    exact = in_exact_mode(compared)
    frames = {name: entry["milliseconds"]["spread"]["median"] for name, entry in exact.items()}
    yield OverviewColumn(30, Column.number("ms per frame, median"), frames)
    about = {entry["configuration"]: entry for entry in compared["configurations"]}
    counts = {name: (entry["computations"] or {}).get("true") for name, entry in about.items()}
    yield OverviewColumn(40, Column.count("parameters of one frame"), counts)
    yield OverviewColumn(110, Column("in memory", lambda v: format_bytes(float(v)), "n"), _bytes(compared))


def compared_verdicts(compared: Compared) -> Iterator[Verdict]:
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


def lap_lines(compared: Compared) -> Chart:
    """Milliseconds per frame, lap by lap, for each phase mode, and the published laps (Figure 5.1)."""
    options: dict[str, list[Trace]] = {}
    colours = configuration_colours(compared)
    # The published mode comes first, because the chart begins with the first option.
    for entry in sorted(compared["responsivity"], key=lambda entry: entry["mode"] != "constant"):
        x, y, name = [lap["lap"] for lap in entry["laps"]], lap_means(entry), entry["configuration"]
        trace = line_trace(name, x, y, colours[name], mode="lines+markers")
        options.setdefault(f"{entry['mode']} phase", []).append(trace)
    for name, laps in compared["published"]["laps"].items():
        if name in colours:
            x, label = list(range(1, len(laps) + 1)), f"{name}, published"
            published = line_trace(label, x, laps, colours[name], dash="dot", width=1.2)
            options.setdefault("constant phase", []).append(published)
    layout = {"xaxis": axis("lap", dtick=1), "yaxis": axis("ms per frame", rangemode="tozero")}
    return chart("compare-laps", layout=layout, choose="Phase mode", options=options)


def lap_boxes(compared: Compared) -> Chart:
    """A box over the laps of each configuration in the mode constant, ours and published (Figure 5.2)."""
    ours = {e["configuration"]: lap_means(e) for e in compared["responsivity"] if e["mode"] == "constant"}
    theirs = compared["published"]["laps"]
    traces = [
        boxes(f"{name}, {whose}", colour, y=laps[name], boxmean=True)
        for name in configuration_names(compared)
        for whose, laps, colour in (("ours", ours, "@accent"), ("published", theirs, "@muted"))
        if name in laps
    ]
    layout = {"yaxis": axis("ms per frame", rangemode="tozero"), "showlegend": False}
    return chart("compare-lap-boxes", traces, layout)


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
    return chart("compare-fit", traces, layout)
