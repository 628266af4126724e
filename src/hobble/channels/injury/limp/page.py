"""Shows the sizes of limps, and how well they are recognised, in the report's section on injuries."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hobble.channels.injury.response.page import with_spoken_links
from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.measures.measure import sample_sentence
from hobble.report.gather import ReportMaterial
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
)

# The effects in the chart and in the table of captured limps.
SHOWN_EFFECTS = ("speed", "stance", "step_hurt", "knee_hurt", "hip_hurt", "lean", "pelvis_drop", "arm_hurt")
MOST_NAMED = 8  # a sentence lists the hurt links if there are at most this many
RECOGNISERS = (
    "Two recognisers judge each walk in windows of four seconds. The linear recogniser learnt from people's "
    "strong limps. The graded recogniser learnt from milder versions of these limps, too."
)
# Columns of the tables of recognised limps: impaired, named and wrong_side in limp.json.
RECOGNISED_COLUMNS = (
    Column.number("share of windows in which the linear recogniser finds a limp"),
    Column.number("share of windows in which the graded recogniser finds a limp, and not on the wrong side"),
    Column.number("share of windows in which the graded recogniser finds a limp on the wrong side"),
)
# Part of the body -> colour of its lines in the chart. All other parts, such as arms, have the colour @g0.
COLOURS = {"hip": "@g1", "thigh": "@g2", "shank": "@g3", "foot": "@g4", "back": "@g5"}
# The chart has lines for the links of these parts of the body, and of the arms.
CHART_PARTS = ("hip", "pelvis", "thigh", "shank", "foot", "back")


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The part of the section on injuries that shows limp.json.

    It says where the limps of the training data come from. It has the chart of sizes, and all tables. found:
    the content of limp.json.
    """
    if not found.get("applies"):
        return PageSection("injury", [])
    name, shown_name = material.name, shown_names(material.network["skeleton"])
    found = with_spoken_links(found, material)
    return PageSection(
        "injury",
        [
            SectionPart(
                1,
                Paragraph(hurt_motion_in_words(found["hurt_seconds"], shown_name) + sample_sentence(found)),
            ),
            SectionPart(2, size_chart(found)),
            SectionPart(3, Paragraph(RECOGNISERS)),
            SectionPart(
                3,
                Table(
                    f"{name}-limp-named",
                    *_recognised_by_severity(found["named"]),
                    "Is the limp of a hurt leg recognised?",
                ),
            ),
            SectionPart(5, other_channel_table(name, found["named_together"])),
            SectionPart(4, held_out_table(name, found["held_out_limps"], shown_name)),
            SectionPart(80, size_table(name, found["sizes"])),
            SectionPart(81, captured_table(name, found["captured"], shown_name)),
            SectionPart(82, second_injury_table(name, found["second"])),
        ],
    )


def hurt_motion_in_words(
    hurt_seconds: Mapping[str, Mapping[str, float]], shown_name: Callable[[str], str] = str
) -> str:
    """Sentences that say how much captured and how much generated hurt motion the training data have.

    hurt_seconds: key of limp.json ("captured", "made") -> link -> seconds. shown_name: turns the name of a
    link into words for readers.
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

    The effect is chosen in a menu. found: the content of limp.json.
    """
    options: dict[str, list[Trace]] = {}
    rows = [row for row in found["sizes"] if row["gait"] == "walk"]
    for effect in SHOWN_EFFECTS:
        traces = []
        for link in dict.fromkeys(
            row["link"] for row in rows if row["part"] in CHART_PARTS or "arm" in row["part"]
        ):
            of_link = [row for row in rows if row["link"] == link]
            trace = line_trace(
                link,
                [r["severity"] for r in of_link],
                [r[effect] for r in of_link],
                COLOURS.get(of_link[0]["part"].replace("pelvis", "hip"), "@g0"),
            )
            trace["line"]["dash"] = "dot" if of_link[0]["side"] == "right" else "solid"
            traces.append(trace)
        for i, (gait, values) in enumerate(found["people"].items()):
            mean, spread = values[effect]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": f"people, {gait.replace('_', ' ')}",
                    "x": [10.3 + 0.1 * i],  # side by side, to the right of severity 10
                    "y": [mean],
                    "error_y": {"type": "data", "array": [spread], "visible": True},
                    "marker": {"color": "@muted", "size": 8},
                }
            )
        options[found["effects"][effect]] = traces
    return Chart(
        "limp-sizes",
        "Size of the limp",
        "The character walks at a target speed of 1.2 m/s with one link at severity 3, 5, 7 or 10, and is "
        "compared with its healthy walk. Lines of links on the right side are dotted. Grey markers show mean "
        "and standard deviation over ten people who imitated strong limps.",
        layout={"xaxis": axis("severity", range=[2.5, 11]), "yaxis": axis("size")},
        height=560,
        choose="Effect",
        options=options,
    )


def _recognised_by_severity(rows: Sequence[Mapping[str, Any]]) -> tuple[list[Column], list[list[Any]]]:
    """Columns and rows of a table that says how well limps of hurt legs are recognised at each severity."""
    columns = [
        Column.number("severity"),
        Column.count("walks"),
        *RECOGNISED_COLUMNS,
    ]
    return columns, [[r["severity"], r["walks"], r["impaired"], r["named"], r["wrong_side"]] for r in rows]


def held_out_table(
    name: str, rows: Sequence[Mapping[str, Any]], shown_name: Callable[[str], str]
) -> Table | None:
    """A table that compares captured limps, which were held out of training, with the character.

    rows: `held_out_limps` of limp.json.
    """
    if not rows:
        return None
    columns = [
        Column("clip"),
        Column("hurt"),
        Column("healthy walk of"),
        Column.number("distance of the healthy character"),
        Column.number("distance of the hurt character"),
        Column("hurt character is nearer", lambda v: "yes" if v else "no"),
    ]
    table = [
        [
            r["clip"],
            ", ".join(f"{shown_name(k)} {v:g}" for k, v in r["hurt_links"].items()),
            r["compared_with"],
            r["healthy"],
            r["hurt"],
            r["nearer"],
        ]
        for r in rows
    ]
    return Table(
        f"{name}-limp-exam",
        columns,
        table,
        "Held-out captured limps: is the hurt character nearer to them than the healthy character?",
    )


def size_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """A table of the effects in each walk and of the recognised limp. rows: `sizes` of limp.json."""
    text_keys = ("gait", "link", "part", "side", "called", "graded")
    if not rows:
        return None
    words = {"called": "linear recogniser", "graded": "graded recogniser"}
    words |= dict(
        zip(("impaired", "named", "wrong_side"), (c.label for c in RECOGNISED_COLUMNS), strict=True)
    )
    titles = {key: words.get(key, key.replace("_", " ")) for key in rows[0]}
    columns = [Column(title) if key in text_keys else Column.number(title) for key, title in titles.items()]
    return Table(f"{name}-limp-sizes", columns, [list(row.values()) for row in rows], "Sizes of all effects")


def other_channel_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """A table: how well limps of hurt legs are recognised while another channel has its highest value.

    rows: `named_together` of limp.json.
    """
    if not rows:
        return None
    columns = [
        Column("with"),
        Column.count("walks"),
        Column.number("speed, share of the same walk without injury"),
        *RECOGNISED_COLUMNS,
    ]
    keys = ("column", "walks", "speed_share", "impaired", "named", "wrong_side")
    title = "Is the limp of a hurt leg (severity 10) recognised while another channel has its highest value?"
    return Table(f"{name}-limp-together", columns, [[row.get(key) for key in keys] for row in rows], title)


def captured_table(
    name: str, rows: Sequence[Mapping[str, Any]], shown_name: Callable[[str], str]
) -> Table | None:
    """A table of the SHOWN_EFFECTS of captured limps. rows: `captured` of limp.json."""
    if not rows:
        return None
    columns = [
        Column("clip"),
        Column("hurt"),
        Column("healthy walk of"),
        *(Column.number(k.replace("_", " ")) for k in SHOWN_EFFECTS),
    ]
    table = [
        [
            r["clip"],
            ", ".join(f"{shown_name(k)} {v:g}" for k, v in r["hurt"].items()),
            r["healthy"],
            *(r[k] for k in SHOWN_EFFECTS),
        ]
        for r in rows
    ]
    return Table(f"{name}-limp-captured", columns, table, "Effects of captured limps")


def second_injury_table(name: str, rows: Sequence[Mapping[str, Any]]) -> Table | None:
    """A table of the speeds of walks with two injuries. rows: `second` of limp.json."""
    if not rows:
        return None
    keys = list(rows[0])
    columns = [Column(k) if k in ("first", "second") else Column.number(k.replace("_", " ")) for k in keys]
    return Table(
        f"{name}-limp-second",
        columns,
        [[r[k] for k in keys] for r in rows],
        "Speed with a second injury in addition to the first",
    )
