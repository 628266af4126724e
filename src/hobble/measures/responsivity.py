"""Laps of a waypoint track: the time of a frame, and how closely the character follows the track.

The laps are repeated in each phase mode. A phase mode is a way to evaluate the network, such as cubic
interpolation over the phase.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import PhaseMode, Positive, Section
from hobble.measures import compare, measure
from hobble.measures.measure import Row
from hobble.measures.shown import ours_and_published
from hobble.report import parts
from hobble.report.parts import Chart, Compared, Hint, KeyFigure, PageSection, SectionPart, Trace
from hobble.runtime import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(Section):
    """The keys of this measurement in a configuration's section `evaluation`."""

    laps: Positive = Field(
        19, description="laps in the phase mode of the section `runtime` and in the mode constant"
    )
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="seconds after which a lap is stopped"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes to measure in addition to the one in the section `runtime`",
    )


MEASURE = measure.Measure(
    name="responsivity",
    module=__name__,
    inputs=("weights",),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=measure.Cost(memory_mb=200, least_minutes=60),
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

TIME_AXIS = parts.axis("ms per frame", rangemode="tozero")
FRAME_BUDGET_MS = 1000 / 60  # the time that a frame may take at 60 Hz
FLIP_DEGREES = 60  # if a joint turns by more than this in one frame, it flips visibly


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The track, the times of the laps, and the published times."""
    if not found.get("laps"):
        return PageSection("speed", [])
    shown = [
        SectionPart(0, parts.Paragraph(parts.words("speed.track"))),
        SectionPart(10, parts.KeyFigures(track_figures(found))),
        SectionPart(15, track_chart(found)),
        SectionPart(20, step_chart(found, material)),
        SectionPart(30, speed_table(found, material), open=True),
    ]
    title, nav = "Steering and time per frame", "Steering and time"
    return PageSection("speed", shown, title=title, order=30, nav=nav)


def figures(found: Json, material: ReportMaterial) -> Iterator[KeyFigure]:
    """A key figure for the top of the report: the time of a frame."""
    if found.get("milliseconds"):
        milliseconds = median_time(found)
        characters = parts.format_number(FRAME_BUDGET_MS / milliseconds, 3)
        note = f"median; one core can run {characters} characters at 60 Hz"
        if published := material.published_entry("responsivity"):
            mean = parts.format_number(found["milliseconds"]["total"], 2)
            note += f"; mean {mean} ms, published mean {published['milliseconds']} ms"
        yield KeyFigure("Time per frame", parts.format_number(milliseconds, 2), "ms", note, 20)


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Whether a frame fits into 1/60 s, and whether the character followed the track."""
    if not found.get("laps"):
        return
    milliseconds, slow = median_time(found), found["milliseconds"]["spread"]["p99"]
    if milliseconds > FRAME_BUDGET_MS:
        head = f"A frame takes {milliseconds:.1f} ms, too slow for 60 Hz."
        yield Hint("warn", head, "Try mode: linear in the section runtime.", 60)
    elif slow > FRAME_BUDGET_MS:
        head = f"1 % of the frames take {slow:.1f} ms or more, too slow for 60 Hz."
        yield Hint("warn", head, parts.words("speed.slow", median=f"{milliseconds:.2f}"), 60)
    else:
        share, most = 100 * milliseconds / FRAME_BUDGET_MS, math.ceil(100 * slow / FRAME_BUDGET_MS)
        head = parts.words("speed.fast", share=f"{share:.1f}", most=most)
        yield Hint("good", head, "That is fast enough for a game.", 60)
    reached, total = found["waypoints_reached"], found["waypoints"]
    if reached < total:
        head = f"The character reached {reached} of {total} waypoints."
        yield Hint("warn", head, parts.words("speed.circles"), 40)
    if found["largest_turn_degrees"] > FLIP_DEGREES:
        head = f"A joint turned by {found['largest_turn_degrees']:.0f} degrees in one frame."
        yield Hint("warn", head, parts.words("speed.flipped"), 40)


def step_chart(found: Json, material: ReportMaterial) -> Chart:
    """Milliseconds per frame of each step, stacked, and diamonds at the medians, for each phase mode."""
    modes, times = zip(*((entry["mode"], entry["milliseconds"]) for entry in found["modes"]), strict=True)
    hover = "%{x}: %{y:.3f} ms<extra>%{fullData.name}</extra>"
    traces = [
        parts.bar_trace(step, modes, [of[step] for of in times], colour, hover)
        for step, colour in STEPS.items()
    ]
    diamond, medians = {"symbol": "diamond", "size": 8, "color": "@ink"}, [*map(median_time, found["modes"])]
    traces.append(parts.marker_trace("median", modes, medians, diamond, hovertemplate=hover))
    layout: dict[str, Any] = {"barmode": "stack", "xaxis": parts.axis("phase mode"), "yaxis": TIME_AXIS}
    if published := material.published_entry("responsivity"):
        text = f"{published['label']}: published mean"
        layout |= parts.reference_line(published["milliseconds"], text, vertical=False)
    return parts.chart("steps", traces, layout)


def track_chart(found: Json) -> Chart:
    """The track from above, and the stored paths of laps."""
    track, runs = found["track"], found["runs"]
    corners_x, corners_z = ([*track[key], track[key][0]] for key in "xz")
    x, z = ([v for run in runs for v in (*run[key], None)] for key in "xz")  # None: a gap between two laps
    traces = [
        parts.line_trace("track", corners_x, corners_z, "@faint", dash="dash", width=1.2, hoverinfo="skip"),
        parts.line_trace("laps", x, z, "@accent", width=1.5, hoverinfo="skip"),
    ]
    labels = {
        "mode": "markers+text",
        "text": [f"{i}, {gait}" for i, gait in enumerate(track["gaits"])],
        "textposition": "top center",
        "textfont": {"size": 11, "color": "@soft"},
    }
    circle = {"symbol": "circle-open", "size": 12, "color": "@ink"}
    traces.append(parts.marker_trace("waypoints", track["x"], track["z"], circle, hoverinfo="skip", **labels))
    layout = {
        "xaxis": parts.axis("x, m", constrain="domain", zeroline=False),
        "yaxis": parts.axis("z, m", scaleanchor="x", autorange="reversed", zeroline=False),
    }
    return parts.chart("track", traces, layout, 520)


def track_figures(found: Json) -> list[KeyFigure]:
    """Key figures: how well the character followed the track, and how much the slowest frames take."""
    reached = f"{found['waypoints_reached']} of {found['waypoints']}"
    finished = f"{found['laps_finished']} of {len(found['laps'])} laps finished"
    figures = (
        ("path_overshoot_cm", "Largest distance from the track", ("cm", "the largest of all laps")),
        ("largest_turn_degrees", "Largest turn", ("°", "of a joint in one frame")),
    )
    slow = parts.format_number(found["milliseconds"]["spread"]["p99"])
    return [
        KeyFigure("Waypoints reached", reached, "", finished),
        *(KeyFigure(name, parts.format_number(found[key]), *more) for key, name, more in figures),
        KeyFigure("Slow frames", slow, "ms", "1 % of the frames are slower"),
    ]


def speed_table(found: Json, material: ReportMaterial) -> parts.Table:
    """A table of milliseconds per frame: ours in each phase mode, followed by the published means.

    Mean and standard deviation (n - 1) are those of the means of the laps, as published.
    """
    rows: list[Row] = []
    for entry in found["modes"]:
        name, (mean, sd) = f"{material.name}, {entry['mode']} phase", measure.mean_and_sd(lap_means(entry))
        times = {"median": median_time(entry), "milliseconds": mean, "sd": sd}
        rows.append({"network": name, **times, "source": "this report"})
    for entry in material.published_records("responsivity"):
        rows.append({**entry, "network": f"{entry['network']}, constant phase"})
    for entry in material.published_records("modes"):
        name = f"prediction alone, {entry['configuration']}, {entry['mode']} phase"
        rows.append({**entry, "network": name})
    heads = {
        "network": "network",
        "median": "median of all frames, ms",
        "milliseconds": "mean of the laps, ms per frame",
        "sd": "sd of the laps, ms",
        "source": "source",
    }
    title = "Comparison with published results"
    return parts.table(f"{material.name}-published-speed", rows, heads, title)


def median_time(found: Json) -> float:
    """Median milliseconds of a whole frame, in all laps or in one. A few slow frames hardly change it."""
    return float(found["milliseconds"]["spread"]["median"])


def lap_means(entry: Json) -> list[float]:
    """Milliseconds per frame of each lap, all steps together."""
    return [lap["milliseconds"]["total"] for lap in entry["laps"]]


def compared(
    all_measured: Sequence[compare.ConfigurationResults], published: Json
) -> compare.ComparisonAddition:
    """The laps of the track in each phase mode, the networks' sizes, and published sizes and times."""
    found = {m.name: m.results_of("responsivity") for m in all_measured}
    about = {
        name: {
            "computations": of["parameters"] or {},
            "weights_bytes": {mode: count * of["bytes_each"] for mode, count in of["stored"].items()},
            "exact": of["exact"],
        }
        for name, of in found.items()
    }
    modes = {name: {entry["mode"]: entry for entry in of["modes"]} for name, of in found.items()}
    differences = compare.pair_differences(
        {name: {mode: lap_means(entry) for mode, entry in of.items()} for name, of in modes.items()}
    )
    fits, line = fit_lines(found, published), {**published["regression"], "configuration": "all"}
    constant = [row for row in differences if row["over"] == "constant"]
    return compare.ComparisonAddition(
        entries=[{**entry, "configuration": name} for name, of in modes.items() for entry in of.values()],
        about=about,
        against_published=_published_sizes(about, published),
        milliseconds={
            "difference": differences,
            "fit": fits,
            "against_published": [
                *_published_times(modes, published),
                *compare.published_differences("milliseconds", constant, published),
                *(
                    compare.published_row(what, line, line[key], fits[0][key], unit)
                    for key, what, unit in (
                        ("slope", "milliseconds for each computation of Table 6.1", ""),
                        ("intercept", "milliseconds at no computation", "ms"),
                    )
                ),
            ],
        },
    )


def fit_lines(found: Mapping[str, Json], published: Json) -> list[dict[str, Any]]:
    """Straight lines of milliseconds a frame (y) over computations of Table 6.1 (x), ours and published.

    Ours are means in the phase mode constant, as the published ones. found: configuration -> content of its
    responsivity.json. Networks without layers are left out.
    """
    times = {row["configuration"]: row["milliseconds"] for row in published["responsivity"]}
    points = {
        "hobble": [
            (of["parameters"]["table_6_1_as_printed"], entry["milliseconds"]["total"])
            for of in found.values()
            for entry in of["modes"]
            if of["parameters"] and entry["mode"] == "constant"
        ],
        "published": [
            (row["table_6_1"], times[row["configuration"]])
            for row in published["computations"]
            if row["configuration"] in times
        ],
    }
    out = []
    for whose, pairs in points.items():
        x, y = [size for size, _ in pairs], [time for _, time in pairs]
        out.append({"whose": whose, "x": x, "y": y, **compare.fit_line(x, y)})
    return out


def _published_sizes(about: Mapping[str, Json], published: Json) -> list[dict[str, Any]]:
    """Published sizes of networks next to ours. about: configuration -> sizes of its network."""
    printed, true = (
        {name: of["computations"].get(key) for name, of in about.items()}
        for key in ("table_6_1_as_printed", "true")
    )
    # The published weights are those of the constant mode, which stores the weights of 50 phases.
    stored = {name: of["weights_bytes"].get("constant") for name, of in about.items()}
    in_table = [{**row, "table": "6.1"} for row in published["computations"]]
    counted = [{**row, "source": "hobble"} for row in published["computations"]]
    weights = [row for row in published["stages"] if row["stage"] == "training" and "bytes" in row]
    return [
        *compare.beside_ours("computations of Table 6.1", in_table, "table_6_1", printed),
        *compare.beside_ours("parameters of a phase", counted, "parameters", true),
        *compare.beside_ours("weights of 50 phases", weights, "bytes", stored, "bytes"),
    ]


def _published_times(modes: Mapping[str, Mapping[str, Json]], published: Json) -> list[dict[str, Any]]:
    """Published times next to ours: of a frame, from whole laps in the mode constant, and of a prediction."""
    constant = {name: of["constant"] for name, of in modes.items() if "constant" in of}
    laps = {name: measure.mean_and_sd(lap_means(entry)) for name, entry in constant.items()}
    means, sds = ({name: both[at] for name, both in laps.items()} for at in (0, 1))
    rows = published["responsivity"]
    out = compare.beside_ours("a frame", rows, "milliseconds", means, "ms")
    out += compare.beside_ours("standard deviation of the means of laps", rows, "sd", sds, "ms")
    for mode in dict.fromkeys(row["mode"] for row in published["modes"]):
        of_mode = [row for row in published["modes"] if row["mode"] == mode]
        ours = {name: of[mode]["milliseconds"]["predict"] for name, of in modes.items() if mode in of}
        out += compare.beside_ours(f"a prediction, {mode}", of_mode, "milliseconds", ours, "ms")
    return out


def tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Two tables: every lap; the lines of time over size, without their points."""
    fit = compared["milliseconds"]["fit"]
    return {
        "responsivity": measure.flat_rows(compared["responsivity"], "laps", "configuration", "mode"),
        "fit": [{k: v for k, v in row.items() if k not in ("x", "y")} for row in fit],
    }


def compared_section(compared: Compared) -> PageSection:
    """Charts of the times of the laps, and of the time of a frame over the size of the network."""
    shown = [SectionPart(10, lap_boxes(compared)), SectionPart(20, fit_chart(compared))]
    return PageSection("speed", shown, title="Time per frame", order=30)


def compared_values(compared: Compared) -> Iterator[parts.ComparedValue]:
    """How closely each configuration follows the track, its time per frame, and its size.

    Times are in the exact phase mode if it was run. Only configurations that reached every waypoint are
    compared on the track.
    """
    exact = in_exact_mode(compared)
    arrived = {name: e for name, e in exact.items() if e["waypoints_reached"] == e["waypoints"]}
    astray = [name for name in exact if name not in arrived]
    left_out = f" Did not reach every waypoint: {', '.join(astray)}." if astray else ""
    off, turns = (
        {name: entry[key] for name, entry in arrived.items()}
        for key in ("path_overshoot_cm", "largest_turn_degrees")
    )
    frames = {name: median_time(entry) for name, entry in exact.items()}
    about = {entry["configuration"]: entry for entry in compared["configurations"]}
    counts = {name: entry["computations"].get("true") for name, entry in about.items()}
    stored = {name: entry["weights_bytes"][entry["exact"]] for name, entry in about.items()}
    number, value = parts.Column.number, parts.ComparedValue
    of_off = "{name} is never more than {value} cm off the track"
    of_time, of_size = "the median frame of {name} takes {value} ms", "{name} needs {value} of memory to run"
    yield value(30, number("off the track, cm"), off, "Closest to the track", of_off, left_out)
    yield value(32, number("largest turn, °"), turns)
    yield value(40, number("ms per frame, median"), frames, "Fastest", of_time)
    yield value(41, parts.Column.count("parameters of one frame"), counts)
    yield value(110, parts.Column("in memory", parts.format_bytes, "n"), stored, "Smallest", of_size)


def in_exact_mode(compared: Compared) -> dict[str, Any]:
    """Configuration -> its results in the exact phase mode, or in another one if the exact mode was not run.

    The exact mode evaluates the network without approximation.
    """
    exact = {entry["configuration"]: entry["exact"] for entry in compared["configurations"]}
    # The exact mode of a configuration comes last, so that it replaces the other modes.
    ordered = sorted(compared["responsivity"], key=lambda e: e["mode"] == exact[e["configuration"]])
    return {entry["configuration"]: entry for entry in ordered}


def lap_boxes(compared: Compared) -> Chart:
    """A box over the laps of each configuration, and their points, for each phase mode (Figures 5.1 and 5.2).

    The published laps are in the mode constant, which comes first.
    """
    names, options = parts.configuration_names(compared), {}
    modes = sorted({entry["mode"] for entry in compared["responsivity"]}, key=lambda m: m != "constant")
    for mode in modes:
        ours = {e["configuration"]: lap_means(e) for e in compared["responsivity"] if e["mode"] == mode}
        theirs = compared["published"]["laps"] if mode == "constant" else {}
        options[f"{mode} phase"] = ours_and_published(names, ours, theirs, boxpoints="all")
    layout = {"yaxis": TIME_AXIS, "showlegend": False}
    return parts.chart("compare-laps", layout=layout, choose="Phase mode", options=options)


def fit_chart(compared: Compared) -> Chart:
    """Frame time over the computations of Table 6.1: ours and published, each with a fitted line."""
    traces: list[Trace] = []
    for fit, colour in zip(compared["milliseconds"]["fit"], ("@accent", "@g2"), strict=True):
        label = {"hobble": "ours"}.get(fit["whose"], fit["whose"])
        if fit["x"]:
            traces.append(parts.dot_trace(label, fit["x"], fit["y"], colour, "%{x:,}: %{y:.3f} ms"))
        if fit["slope"] is not None:
            ends = [min(fit["x"]), max(fit["x"])]
            values = [fit["intercept"] + fit["slope"] * x for x in ends]
            traces.append(parts.line_trace(f"{label}, straight fit", ends, values, colour, width=1.4))
    x = parts.axis("computations of Table 6.1", tickformat="~s", rangemode="tozero")
    return parts.chart("compare-fit", traces, {"xaxis": x, "yaxis": TIME_AXIS})
