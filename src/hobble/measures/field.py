"""Measures that papers of the field publish: skating, rotation of joints, paths, response, naturalness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import Positive, Section
from hobble.measures import measure
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import Row
from hobble.report import parts
from hobble.report.parts import Compared, Hint, PageSection, SectionPart
from hobble.runtime import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(Section):
    """The keys of this measurement in a configuration's section `evaluation`."""

    field_seconds: Positive = Field(30, description="seconds of the straight walk")


MEASURE = measure.Measure(
    name="field",
    module=__name__,
    inputs=("weights", "clips"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    cost=measure.Cost(memory_mb=300, mb_per_1000_frames=10, seconds_per_1000_frames=1.0, least_minutes=30),
)

# Measure -> its name and unit. Measures of motion are also measured of captured motion.
OF_MOTION = {
    "skating": "foot skating, cm a frame",
    "skating_heels": "skating of heels, cm a frame",
    "skating_toes": "skating of toes, cm a frame",
    "joint_update": "rotation of a joint, degrees a frame",
    "jerk": "jerk, m/s3",
    "contact_speed": "speed of feet on the ground, share of their largest",
    "frechet": "Frechet distance, variance of captured windows",
    "diversity": "diversity of windows, spread of captured windows",
}
OF_PATHS = {
    f"paths_{path}_{unit}": label.format(path)
    for path in ("circle", "square", "star")
    for unit, label in (("cm", "distance from a {}, cm"), ("degrees", "angle to a {}, degrees"))
}
OF_RESPONSE = {"response_walk": "from standing to 1.2 m/s, s", "response_jog": "from standing to 4.2 m/s, s"}
HEADS = {
    "measure": "measure",
    "straight": "straight walk",
    "asked": "as asked",
    "captured": "captured",
    "published": "published, other bodies and data",
}
# More than this many times the captured motion's value is worth a hint.
MUCH_MORE = 1.3
WORTH_A_HINT = {"skating": "feet skate", "jerk": "joints jerk"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The table, and how each value was measured."""
    if "straight" not in found:
        return PageSection("field", [])
    clips = "held-out" if found["split"] == "held_out" else "training"
    shown = [
        SectionPart(
            10, parts.Paragraph(parts.words("field.introduction", stretches=found["stretches"], clips=clips))
        ),
        SectionPart(
            20,
            parts.table("field", rows(found, material.published["field"]), HEADS, "Measures of the field"),
            open=True,
        ),
    ]
    return PageSection("field", shown, title="Measures of the field", order=35)


def rows(found: Json, published: Sequence[Json]) -> list[Row]:
    """A row for each measure: the character's values, captured people's, and a published one (see HEADS)."""
    values = measure.flatten(found)
    theirs = {row["measure"]: f"{row['value']} ({row['source']})" for row in published}
    return [
        {
            "measure": name,
            "straight": values.get(f"straight_{key}", values.get(key)),
            "asked": values.get(f"asked_character_{key}"),
            "captured": values.get(f"asked_captured_{key}"),
            "published": theirs.get(key, ""),
        }
        for key, name in (OF_MOTION | OF_PATHS | OF_RESPONSE).items()
    ]


def hints(found: Json, material: ReportMaterial) -> Iterator[Hint]:
    """Where the character is much worse than captured people who did the same."""
    asked = found.get("asked") or {}
    for key, faults in WORTH_A_HINT.items():
        mine, theirs = (asked.get(who, {}).get(key) for who in ("character", "captured"))
        if mine and theirs and mine > MUCH_MORE * theirs:
            beside = f"{parts.format_number(mine)} against {parts.format_number(theirs)}."
            text = f"{OF_MOTION[key]}: {beside} {parts.words(f'field.{key}')}"
            yield Hint("note", f"The character's {faults} more than captured people's.", text, order=40)


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The values of each configuration by name."""
    entries = []
    for m in all_measured:
        if (found := m.results_of("field")).get("straight"):
            values = {key: found[key] for key in ("straight", "asked", "paths", "response")}
            entries.append({"configuration": m.name, **measure.flatten(values)})
    return ComparisonAddition(entries=entries)


def tables(compared: Json) -> dict[str, list[Row]]:
    """One table, with a row for each configuration."""
    return {"field": compared["field"]}


def compared_values(compared: Compared) -> Iterator[parts.ComparedValue]:
    """Skating, path, response, jerk and Frechet distance, with who is best at three of them."""
    skating = "Cleanest feet", "the feet of {name} skate {value} cm a frame in a straight walk"
    circle = "Closest to a circle", "{name} is {value} cm off a circle on average"
    quick = "Quickest to walk", "{name} walks {value} s after it was asked to"
    for order, key, label, verdict in (
        (60, "straight_skating", "skating, cm", skating),
        (61, "paths_circle_cm", "off a circle, cm", circle),
        (62, "paths_square_cm", "off a square, cm", ()),
        (63, "response_walk", "from standing to a walk, s", quick),
        (64, "response_jog", "from standing to a jog, s", ()),
        (65, "asked_character_skating", "skating as asked, cm", ()),
        (66, "asked_character_jerk", "jerk as asked, m/s3", ()),
        (67, "asked_character_frechet", "Frechet", ()),
    ):
        values = {row["configuration"]: row.get(key) for row in compared.get("field", ())}
        yield parts.ComparedValue(order, parts.Column.number(label), values, *verdict)
