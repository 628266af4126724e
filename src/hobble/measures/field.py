"""Measures that papers of the field publish: skating, rotation of joints, paths, response, naturalness."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

from collections.abc import Iterator, Sequence
from functools import partial

from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import Positive, Section
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Cost, Measure, Row
from hobble.measures.shown import words
from hobble.report.parts import (
    Column,
    Compared,
    Hint,
    OverviewColumn,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    Verdict,
    format_number,
    verdict_on_lowest,
)
from hobble.runtime.options import Runtime


class Options(Section):
    """The keys of this measurement in a configuration's section `evaluation`."""

    path_laps: Positive = Field(1, description="laps of the circle, the square and the star")
    field_seconds: Positive = Field(30, description="seconds of the straight walk")


MEASURE = Measure(
    name="field",
    module=__name__,
    inputs=("weights", "clips", "published"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=Cost(memory_mb=300, mb_per_1000_frames=10, seconds_per_1000_frames=1.0, least_minutes=30),
)

# Measure -> its name and unit. Measures of motion are also measured of captured motion.
OF_MOTION = {
    "skating_cm": "foot skating, cm a frame",
    "skating_heels_cm": "skating of heels, cm a frame",
    "skating_toes_cm": "skating of toes, cm a frame",
    "joint_update_degrees": "rotation of a joint, degrees a frame",
    "jerk": "jerk, m/s3",
    "contact_speed": "speed of feet on the ground, share of their largest",
    "frechet": "Frechet distance, variance of captured windows",
    "diversity": "diversity of windows, spread of captured windows",
}
PATHS = ("circle", "square", "star")
GAITS = {"walk": "from standing to 1.2 m/s, s", "jog": "from standing to 4.2 m/s, s"}
# More than this many times the captured motion's value is worth a hint.
MUCH_MORE = 1.3
WORTH_A_HINT = {"skating_cm": "feet skate", "jerk": "joints jerk"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The table, and how each value was measured."""
    if "straight" not in found:
        return PageSection("field", [])
    clips = "held-out" if found["split"] == "held_out" else "training"
    parts = [
        SectionPart(10, Paragraph(words("field.introduction", stretches=found["stretches"], clips=clips))),
        SectionPart(20, Table("field", COLUMNS, rows(found), "Measures of the field"), open=True),
    ]
    return PageSection("field", parts, title="Measures of the field", order=35)


COLUMNS = [
    Column("measure"),
    *map(Column.number, ("straight walk", "as asked", "captured")),
    Column("published, other bodies and data"),
]


def rows(found: Json) -> list[list[object]]:
    """The rows of the table: measure, straight walk, as asked, captured, published."""
    asked = found["asked"] or {"character": {}, "captured": {}}
    published = {row["measure"]: row for row in found["published"]}
    out: list[list[object]] = [
        [name, found["straight"].get(key), asked["character"].get(key), asked["captured"].get(key), key]
        for key, name in OF_MOTION.items()
    ]
    for path in PATHS:
        for unit, label in (("cm", "distance from a {}, cm"), ("degrees", "angle to a {}, degrees")):
            out.append([label.format(path), found["paths"][path][unit], None, None, f"{path}_{unit}"])
    out += [[label, found["response"][gait], None, None, f"response_{gait}"] for gait, label in GAITS.items()]
    return [[*row[:-1], _published_words(published.get(str(row[-1])))] for row in out]


def _published_words(row: Json | None) -> str:
    """A published value with its source, or ""."""
    return f"{row['value']} ({row['source']})" if row else ""


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Where the character is much worse than captured people who did the same."""
    asked = found.get("asked") or {}
    for key, faults in WORTH_A_HINT.items():
        mine, theirs = (asked.get(who, {}).get(key) for who in ("character", "captured"))
        if mine and theirs and mine > MUCH_MORE * theirs:
            yield Hint(
                "note",
                f"The character's {faults} more than captured people's.",
                f"{OF_MOTION[key]}: {format_number(mine)} against {format_number(theirs)}. "
                + words(f"field.{key}"),
                order=40,
            )


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """An entry for each configuration that was measured."""
    return ComparisonAddition(
        entries=[
            {"configuration": m.name, **_flat(m.results_of("field"))}
            for m in all_measured
            if m.results_of("field").get("straight")
        ]
    )


def _flat(found: Json) -> Json:
    """The values of one configuration by name, without those of captured motion."""
    paths = {f"{path}_{unit}": value for path, of in found["paths"].items() for unit, value in of.items()}
    asked = (found["asked"] or {}).get("character", {})
    return {
        **found["straight"],
        **{f"asked_{key}": value for key, value in asked.items()},
        **paths,
        **{f"response_{gait}": value for gait, value in found["response"].items()},
    }


def tables(compared: Json) -> dict[str, list[Row]]:
    """One table, with a row for each configuration."""
    return {"field": compared["field"]}


def compared_columns(compared: Compared) -> Iterator[OverviewColumn]:
    """Skating, the circle and the Frechet distance of each configuration."""
    for order, (key, label) in enumerate(
        (("skating_cm", "skating, cm"), ("circle_cm", "off a circle, cm"), ("asked_frechet", "Frechet"))
    ):
        values = {row["configuration"]: row.get(key) for row in compared.get("field", ())}
        yield OverviewColumn(60 + order, Column.number(label), values)


def compared_verdicts(compared: Compared) -> Iterator[Verdict]:
    """Which configuration's feet skate least, and which follows a circle most closely."""
    for order, head, key, ending in (
        (41, "Cleanest feet", "skating_cm", "cm a frame in a straight walk"),
        (42, "Closest to a circle", "circle_cm", "cm from it on average"),
    ):
        values = {row["configuration"]: row.get(key) for row in compared.get("field", ())}
        yield from verdict_on_lowest(order, head, values, partial(_value_words, ending))


def _value_words(ending: str, name: str, value: float) -> str:
    """Half of a sentence on the configuration `name`."""
    return f"{name} has {format_number(value, 3)} {ending}"
