"""The limp that each hurt link causes.

The size of the limp is compared with people's limps. Two recognisers say whether they find the limp. `found`
is the content of limp.json.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import Field

from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.core.section import PositiveFloat
from hobble.measures.injury import table_of_rows, with_spoken_links
from hobble.measures.measure import Cost, Measure, SampleOptions, sample_sentence
from hobble.report.parts import (
    Chart,
    Column,
    PageSection,
    Paragraph,
    SectionPart,
    Table,
    Trace,
    axis,
    format_number,
    line_trace,
    marker_trace,
)
from hobble.runtime.options import Runtime

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""

    limp_seconds: PositiveFloat = Field(8.0, description="length of each walk whose limp is measured")


MEASURE = Measure(
    name="limp",
    module=__name__,
    inputs=("weights", "clips", "summaries"),
    options=Options,
    runtime=tuple(Runtime.model_fields),
    channel="injury",
    cost=Cost(memory_mb=600, mb_per_1000_frames=14, seconds_per_1000_frames=0.1, least_minutes=20),
)
Rows = Sequence[Mapping[str, Any]]  # rows of limp.json
# The effects in the chart and in the table of captured limps.
SHOWN_EFFECTS = ("speed", "stance", "step_hurt", "knee_hurt", "hip_hurt", "lean", "pelvis_drop", "arm_hurt")
MOST_NAMED = 8  # a sentence lists the hurt links if there are at most this many
RECOGNISERS = (
    "Two recognisers judge each walk in windows of four seconds. The linear recogniser learnt from people's "
    "strong limps. The graded recogniser learnt from milder versions of these limps, too."
)
RECOGNISED = {  # key of a row -> heading of its column
    "impaired": "share of windows in which the linear recogniser finds a limp",
    "named": "share of windows in which the graded recogniser finds a limp, and not on the wrong side",
    "wrong_side": "share of windows in which the graded recogniser finds a limp on the wrong side",
}
# Part of the body -> colour of its lines in the chart. All other parts, such as arms, have the colour @g0.
COLOURS = {"hip": "@g1", "pelvis": "@g1", "thigh": "@g2", "shank": "@g3", "foot": "@g4", "back": "@g5"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The part of the section on injuries that shows limp.json.

    It says where the limps of the training data come from. It has the chart of sizes, and all tables.
    """
    if not found.get("applies"):
        return PageSection("injury", [])
    name, shown_name = material.name, shown_names(material.network["skeleton"])
    found = with_spoken_links(found, material)
    words = {"called": "linear recogniser", "graded": "graded recogniser", **RECOGNISED}
    texts = ("gait", "link", "part", "side", "called", "graded")
    sources = hurt_motion_in_words(found["hurt_seconds"], shown_name) + sample_sentence(found)
    all_sizes = table_of_rows(f"{name}-limp-sizes", found["sizes"], "Sizes of all effects", words, texts)
    title = "Speed with a second injury in addition to the first"
    return PageSection(
        "injury",
        [
            SectionPart(1, Paragraph(sources)),
            SectionPart(2, size_chart(found)),
            SectionPart(3, Paragraph(RECOGNISERS)),
            SectionPart(3, recognised_table(name, found["named"])),
            SectionPart(5, other_channel_table(name, found["named_together"])),
            SectionPart(4, held_out_table(name, found["held_out_limps"], shown_name)),
            SectionPart(80, all_sizes),
            SectionPart(81, captured_table(name, found["captured"], shown_name)),
            SectionPart(82, table_of_rows(f"{name}-limp-second", found["second"], title)),
        ],
    )


def hurt_motion_in_words(
    hurt_seconds: Mapping[str, Mapping[str, float]], shown_name: Callable[[str], str] = str
) -> str:
    """Sentences that say how much captured and how much generated hurt motion the training data have.

    hurt_seconds: "captured" or "made" -> link -> seconds. shown_name: turns the name of a link into words for
    readers.
    """
    sentences = []
    for key, words in (("captured", "captured"), ("made", "generated from healthy clips")):
        if by_link := hurt_seconds[key]:
            names = f" ({', '.join(map(shown_name, sorted(by_link)))})" if len(by_link) <= MOST_NAMED else ""
            links = f"summed over {len(by_link)} links" if len(by_link) != 1 else "of one link"
            seconds = format_number(sum(by_link.values()), 3)
            sentences.append(f"Hurt motion in training, {words}: {seconds} s, {links}{names}.")
    if any(len(by_link) > 1 for by_link in hurt_seconds.values()):
        sentences.append("A second in which two links hurt counts twice.")
    return " ".join(sentences) or "No link was hurt in training."


def size_chart(found: Json) -> Chart:
    """A chart of one effect over severity, with a line for each link, and the means over people.

    The effect is chosen in a menu.
    """
    rows_of_link: dict[str, list[Mapping[str, Any]]] = {}
    for row in found["sizes"]:
        if row["gait"] == "walk" and (row["part"] in COLOURS or "arm" in row["part"]):
            rows_of_link.setdefault(row["link"], []).append(row)

    def line(link: str, rows: Rows, effect: str) -> Trace:
        x, y = [r["severity"] for r in rows], [r[effect] for r in rows]
        trace = line_trace(link, x, y, COLOURS.get(rows[0]["part"], "@g0"))
        trace["line"]["dash"] = "dot" if rows[0]["side"] == "right" else "solid"
        return trace

    def people(i: int, gait: str, mean: float, spread: float) -> Trace:
        x = [10.3 + 0.1 * i]  # side by side, to the right of severity 10
        bars = {"type": "data", "array": [spread], "visible": True}
        name = f"people, {gait.replace('_', ' ')}"
        return marker_trace(name, x, [mean], {"color": "@muted", "size": 8}, error_y=bars)

    return Chart(
        "limp-sizes",
        "Size of the limp",
        "The character walks at a target speed of 1.2 m/s with one link at severity 3, 5, 7 or 10, and is "
        "compared with its healthy walk. Lines of links on the right side are dotted. Grey markers show mean "
        "and standard deviation over ten people who imitated strong limps.",
        layout={"xaxis": axis("severity", range=[2.5, 11]), "yaxis": axis("size")},
        height=560,
        choose="Effect",
        options={
            found["effects"][effect]: [
                *(line(link, rows, effect) for link, rows in rows_of_link.items()),
                *(people(i, gait, *sizes[effect]) for i, (gait, sizes) in enumerate(found["people"].items())),
            ]
            for effect in SHOWN_EFFECTS
        },
    )


def recognised_table(name: str, rows: Rows) -> Table:
    """How well limps of hurt legs are recognised at each severity. rows: `named` of limp.json."""
    columns = {"severity": Column.number("severity"), "walks": Column.count("walks"), **_shares()}
    return Table.of(f"{name}-limp-named", columns, rows, "Is the limp of a hurt leg recognised?")


def _shares() -> dict[str, Column]:
    return {key: Column.number(label) for key, label in RECOGNISED.items()}


def other_channel_table(name: str, rows: Rows) -> Table:
    """How well limps of hurt legs are recognised while another channel has its highest value.

    rows: `named_together` of limp.json.
    """
    columns = {
        "column": Column("with"),
        "walks": Column.count("walks"),
        "speed_share": Column.number("speed, share of the same walk without injury"),
        **_shares(),
    }
    title = "Is the limp of a hurt leg (severity 10) recognised while another channel has its highest value?"
    return Table.of(f"{name}-limp-together", columns, rows, title)


def held_out_table(name: str, rows: Rows, shown_name: Callable[[str], str]) -> Table:
    """Compares captured limps, which were held out of training, with the character.

    rows: `held_out_limps` of limp.json.
    """
    columns = {
        "clip": Column("clip"),
        "hurt_links": Column("hurt"),
        "compared_with": Column("healthy walk of"),
        "healthy": Column.number("distance of the healthy character"),
        "hurt": Column.number("distance of the hurt character"),
        "nearer": Column("hurt character is nearer", lambda v: "yes" if v else "no"),
    }
    records = [{**r, "hurt_links": _in_words(r["hurt_links"], shown_name)} for r in rows]
    title = "Held-out captured limps: is the hurt character nearer to them than the healthy character?"
    return Table.of(f"{name}-limp-exam", columns, records, title)


def captured_table(name: str, rows: Rows, shown_name: Callable[[str], str]) -> Table:
    """A table of the SHOWN_EFFECTS of captured limps. rows: `captured` of limp.json."""
    columns = {"clip": Column("clip"), "hurt": Column("hurt"), "healthy": Column("healthy walk of")}
    columns |= {key: Column.number(key.replace("_", " ")) for key in SHOWN_EFFECTS}
    records = [{**r, "hurt": _in_words(r["hurt"], shown_name)} for r in rows]
    return Table.of(f"{name}-limp-captured", columns, records, "Effects of captured limps")


def _in_words(hurt: Mapping[str, float], shown_name: Callable[[str], str]) -> str:
    """hurt: link -> severity."""
    return ", ".join(f"{shown_name(link)} {severity:g}" for link, severity in hurt.items())
