"""What the report shows of the laps: the time of a frame, and how closely the character follows the track."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from hobble.measures.inputs import Json
from hobble.measures.responsivity.lap_charts import (
    lap_chart,
    lap_median,
    lap_steps,
    step_order,
    track_chart,
)
from hobble.report.gather import ReportMaterial
from hobble.report.parts import (
    Column,
    Hint,
    KeyFigure,
    KeyFigures,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    citation,
    format_number,
    with_order,
)
from hobble.runtime.network_rows import FASTEST_TURN

FEWEST_STEPS = 10  # if the character takes fewer steps, the mean foot slide is not shown
FRAME_BUDGET_MS = 1000 / 60  # the time that a frame may take at 60 Hz
FLIP_DEGREES = 60  # if a joint turns by more than this in one frame, it flips visibly
# Columns of the table of laps, by the keys of `LapWalk` in hobble.measures.responsivity.results.
LAP_COLUMNS = {
    "lap": Column.count("lap"),
    "finished": Column("finished", lambda finished: "yes" if finished else "no"),
    "waypoints_reached": Column.count("waypoints reached"),
    "seconds": Column.number("seconds", 4),
    "frames": Column.count("frames"),
    "path_distance_cm": Column.number("mean distance from the track, cm"),
    "path_overshoot_cm": Column.number("largest distance from the track, cm"),
    "steps": Column.count("steps"),
    "foot_slide_cm": Column.number("mean foot slide of a step, cm"),
    "predicted_turn_degrees": Column.number("largest turn of a joint in a frame as predicted, °"),
    "largest_turn_degrees": Column.number("largest turn of a joint in a frame as drawn, °"),
    "turns_held_back": Column.count("frames in which a turn was limited"),
}
TRACK = "The character is steered around a track of six waypoints: it walks, side-steps, jogs and crouches."


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The track, the times of the laps, the published times, and a table of the laps."""
    figures_of_track = track_figures(found)
    return PageSection(
        "speed",
        [
            SectionPart(0, Paragraph(TRACK) if figures_of_track else None),
            SectionPart(10, KeyFigures(figures_of_track) if figures_of_track else None),
            SectionPart(15, track_chart(found)),
            SectionPart(20, lap_chart(found, material)),
            SectionPart(30, speed_table(found, material), open=True, short=True),
            SectionPart(60, lap_table(found, material.name)),
        ],
        title="Steering and time per frame",
        order=30,
        nav="Steering and time",
    )


def figures(found: Json, material: ReportMaterial) -> Iterator[KeyFigure]:
    """A key figure for the top of the report: the time of a frame."""
    milliseconds = frame_milliseconds(found)
    if milliseconds is not None:
        published = material.published_entry("responsivity")
        note = (
            f"median; one core can run {format_number(FRAME_BUDGET_MS / milliseconds, 3)} characters at 60 Hz"
        )
        if published:
            mean = format_number(frame_mean(found), 2)
            note += f"; mean {mean} ms, published mean {published['milliseconds']} ms"
        yield KeyFigure("Time per frame", format_number(milliseconds, 2), "ms", note, 20)


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Whether a frame fits into 1/60 s, and whether the character followed the track."""
    yield from with_order(60, _speed_hints(found))
    yield from with_order(40, _track_hints(found))


def lap_table(found: Json, name: str) -> Table | None:
    """A row per lap: how it went, the mean time of each step of a frame, and the median time of a frame."""
    laps = found.get("laps")
    if not isinstance(laps, list) or not laps:
        return None
    lap_columns = {key: column for key, column in LAP_COLUMNS.items() if key in laps[0]}
    frame_steps = sorted(lap_steps(laps[0]), key=step_order)
    columns = [*lap_columns.values(), *(Column.number(f"{step}, mean ms") for step in frame_steps)]
    columns.append(Column.number("whole frame, median ms"))
    rows = [
        [
            None if key == "foot_slide_cm" and _too_few_steps(lap.get("steps")) else lap.get(key)
            for key in lap_columns
        ]
        + [lap_steps(lap).get(step) for step in frame_steps]
        + [lap_median(lap)]
        for lap in laps
    ]
    return Table(f"{name}-responsivity", columns, rows)


def _too_few_steps(steps: int | None) -> bool:
    """Whether the character took too few steps for a mean foot slide."""
    return steps is not None and steps < FEWEST_STEPS


def track_figures(found: Json) -> list[KeyFigure]:
    """Key figures: how well the character followed the track."""
    if not isinstance(found.get("laps"), list):
        return []
    spread = (found.get("milliseconds") or {}).get("spread") or {}
    reached = f"{found.get('waypoints_reached')} of {found.get('waypoints')}"
    steps = sum(lap.get("steps") or 0 for lap in found["laps"])
    slide = None if _too_few_steps(steps) else found.get("foot_slide_cm")
    slide_note = f"mean slide of a toe during a stance, averaged over the laps ({steps:,} steps)"
    laps = f"{found.get('laps_finished')} of {len(found['laps'])} laps finished"
    return [
        KeyFigure("Waypoints reached", reached, "", laps),
        KeyFigure(
            "Largest distance from the track",
            format_number(found.get("path_overshoot_cm")),
            "cm",
            "the largest of all laps",
        ),
        KeyFigure("Foot slide", format_number(slide), "cm" if slide is not None else "", slide_note),
        _turn_figure(found),
        KeyFigure("Slow frames", format_number(spread.get("p99")), "ms", "1 % of the frames are slower"),
    ]


def _turn_figure(found: Json) -> KeyFigure:
    """The largest turn of a joint in one frame: as predicted, and as drawn after the runtime's limit."""
    drawn, predicted = (
        format_number(found.get(key)) for key in ("largest_turn_degrees", "predicted_turn_degrees")
    )
    limit = f"{np.degrees(FASTEST_TURN):.0f}°"
    if found.get("predicted_turn_degrees") is None:
        return KeyFigure(
            "Largest turn of a joint", drawn, "°", f"in one frame, as drawn; the runtime limits it to {limit}"
        )
    frames = sum(lap.get("frames") or 0 for lap in found["laps"])
    limited_frames = f"{found['turns_held_back']:,} of {frames:,} frames"
    note = f"of a joint in one frame, as predicted; the runtime limited it to {limit} in {limited_frames}; "
    note += f"after the feet were put on the ground, the largest turn was {drawn}°"
    return KeyFigure("Largest predicted turn", predicted, "°", note)


def speed_table(found: Json, material: ReportMaterial) -> Table | None:
    """A table of milliseconds per frame: our median and mean, followed by the published means."""
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
        rows.append([entry["label"], None, entry["milliseconds"], citation(entry, sources)])
    for entry in material.published["modes"]:
        rows.append(
            [
                f"prediction alone, {entry['mode']} phase",
                None,
                entry["milliseconds"],
                citation(entry, sources),
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
    """Median milliseconds of a whole frame over all laps; the mean if there is no median.

    The median is shown because a few slow frames hardly change it.
    """
    times = found.get("milliseconds")
    median = (times.get("spread") or {}).get("median") if isinstance(times, dict) else None
    return frame_mean(found) if median is None else float(median)


def frame_mean(found: Json) -> float | None:
    """Mean milliseconds of a whole frame, to compare with the published means."""
    value = found.get("milliseconds")
    if isinstance(value, dict):
        value = value.get("total", sum(v for v in value.values() if isinstance(v, (int, float))))
    return float(value) if isinstance(value, (int, float)) else None


def _speed_hints(found: Json) -> Iterator[Hint]:
    milliseconds = frame_milliseconds(found)
    if milliseconds is None:
        return
    if milliseconds > FRAME_BUDGET_MS:
        yield Hint(
            "warn",
            f"A frame takes {milliseconds:.1f} ms, too slow for 60 Hz.",
            "Try mode: linear in the section runtime.",
        )
        return
    share = milliseconds / FRAME_BUDGET_MS
    times = found.get("milliseconds")
    slow = (times.get("spread") or {}).get("p99") if isinstance(times, dict) else None
    if slow is not None and slow > FRAME_BUDGET_MS:
        yield Hint(
            "warn",
            f"1 % of the frames take {slow:.1f} ms or more, too slow for 60 Hz.",
            f"The median is {milliseconds:.2f} ms. Measure again while nothing else runs on the machine.",
        )
    elif slow is not None:
        yield Hint(
            "good",
            f"A frame takes {100 * share:.1f} % of the 16.7 ms that 60 Hz allows. 99 of 100 frames take at "
            f"most {math.ceil(100 * slow / FRAME_BUDGET_MS)} % of that time.",
            "That is fast enough for a game.",
        )
    else:
        yield Hint("good", f"A frame takes {100 * share:.1f} % of the 16.7 ms that 60 Hz allows.", "")


def _track_hints(found: Json) -> Iterator[Hint]:
    reached, total = (found.get(key) for key in ("waypoints_reached", "waypoints"))
    if total and reached is not None and reached < total:
        yield Hint(
            "warn",
            f"The character reached {reached} of {total} waypoints.",
            "It circles around a waypoint or stops before it. See the laps in the section on steering.",
        )
    drawn, predicted = (found.get(key) for key in ("largest_turn_degrees", "predicted_turn_degrees"))
    if drawn is not None and drawn > FLIP_DEGREES:
        yield Hint(
            "warn",
            f"A joint turned by {drawn:.0f} degrees in one frame.",
            "It flips, which is visible on a skinned character.",
        )
    elif predicted is not None and predicted > FLIP_DEGREES:
        yield Hint(
            "note",
            f"The network predicted a turn of a joint by {predicted:.0f} degrees in one frame.",
            f"As drawn, no joint turned by more than {drawn:.0f} degrees. Check whether joint rotations flip "
            "in the clips.",
        )
