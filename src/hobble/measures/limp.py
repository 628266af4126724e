"""The limp that each hurt link causes.

The size of the limp is compared with people's limps. Two recognisers say whether they find the limp. `found`
is the content of limp.json.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.core.section import PositiveFloat
from hobble.measures.injury import with_spoken_links
from hobble.measures.measure import Cost, Measure, SampleOptions, sample_sentence
from hobble.measures.shown import (
    BARE,
    STRIP_HEIGHT,
    STRIP_WIDTH,
    Records,
    chart,
    stick_figures,
    strip_texts,
    table,
    words,
)
from hobble.report.parts import (
    Chart,
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
# The effects in the chart and in the table of captured limps.
SHOWN_EFFECTS = ("speed", "stance", "step_hurt", "knee_hurt", "hip_hurt", "lean", "pelvis_drop", "arm_hurt")
MOST_NAMED = 8  # a sentence lists the hurt links if there are at most this many
RECOGNISED = {  # key of a row -> heading of its column
    "impaired": "share of windows in which the linear recogniser finds a limp",
    "named": "share of windows in which the graded recogniser finds a limp, and not on the wrong side",
    "wrong_side": "share of windows in which the graded recogniser finds a limp on the wrong side",
}
TOGETHER = {"column": "with", "walks": "walks", "speed_share": "speed, share of the same walk without injury"}
EXAM = {
    "clip": "clip",
    "hurt": "hurt",
    "compared_with": "healthy walk of",
    "healthy": "distance of the healthy character",
    "distance": "distance of the hurt character",
    "nearer": "hurt character is nearer",
}
# Part of the body -> colour of its lines in the chart. All other parts, such as arms, have the colour @g0.
COLOURS = {"hip": "@g1", "pelvis": "@g1", "thigh": "@g2", "shank": "@g3", "foot": "@g4", "back": "@g5"}


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The part of the section on injuries that shows limp.json.

    It says where the limps of the training data come from. It has the chart of sizes, and all tables.
    """
    if not found.get("applies"):
        return PageSection("injury", [])
    shown_name = shown_names(material.network["skeleton"])
    found = with_spoken_links(found, material)

    def of(key: str, records: Records, heads: Mapping[str, str]) -> Table:
        show = {"nearer": lambda nearer: "yes" if nearer else "no"}
        return table(f"{material.name}-limp-{key}", records, heads, words(f"limp.{key}"), show)

    def hurt(row: Mapping[str, Any], key: str) -> dict[str, Any]:
        """The row with the hurt links (link -> severity) in words."""
        return {**row, "hurt": ", ".join(f"{shown_name(link)} {value:g}" for link, value in row[key].items())}

    sizes = found["sizes"]
    size_heads = {key: key.replace("_", " ") for key in (sizes[0] if sizes else ())}
    size_heads |= {"called": "linear recogniser", "graded": "graded recogniser", **RECOGNISED}
    captured = [hurt(row, "hurt") for row in found["captured"]]
    effects = {key: key.replace("_", " ") for key in SHOWN_EFFECTS}
    exam = [hurt({**row, "distance": row["hurt"]}, "hurt_links") for row in found["held_out_limps"]]
    sources = hurt_motion_in_words(found["hurt_seconds"], shown_name) + sample_sentence(found)
    parts = [
        SectionPart(1, Paragraph(sources)),
        SectionPart(2, size_chart(found)),
        SectionPart(2, gallery_chart(found, material.network["skeleton"], shown_name)),
        SectionPart(3, Paragraph(words("limp.recognisers"))),
        SectionPart(3, of("named", found["named"], {"severity": "severity", "walks": "walks", **RECOGNISED})),
        SectionPart(4, of("exam", exam, EXAM)),
        SectionPart(5, of("together", found["named_together"], TOGETHER | RECOGNISED)),
        SectionPart(80, of("sizes", sizes, size_heads)),
        SectionPart(
            81,
            of(
                "captured", captured, {"clip": "clip", "hurt": "hurt", "healthy": "healthy walk of"} | effects
            ),
        ),
    ]
    return PageSection("injury", parts)


def hurt_motion_in_words(
    hurt_seconds: Mapping[str, Mapping[str, float]], shown_name: Callable[[str], str] = str
) -> str:
    """Sentences that say how much captured and how much generated hurt motion the training data have.

    hurt_seconds: "captured" or "made" -> link -> seconds. shown_name: turns the name of a link into words for
    readers.
    """
    sentences = []
    for key, origin in (("captured", "captured"), ("made", "generated from healthy clips")):
        if by_link := hurt_seconds[key]:
            names = f" ({', '.join(map(shown_name, sorted(by_link)))})" if len(by_link) <= MOST_NAMED else ""
            links = f"summed over {len(by_link)} links" if len(by_link) != 1 else "of one link"
            seconds = format_number(sum(by_link.values()), 3)
            sentences.append(f"Hurt motion in training, {origin}: {seconds} s, {links}{names}.")
    if any(len(by_link) > 1 for by_link in hurt_seconds.values()):
        sentences.append("A second in which two links hurt counts twice.")
    return " ".join(sentences) or "No link was hurt in training."


def gallery_chart(found: Json, skeleton: Json, shown_name: Callable[[str], str] = str) -> Chart | Paragraph:
    """Captured limps above the character with the same injury and the healthy character, over a gait cycle.

    A menu chooses the limp, and whether it is seen from the side or from behind.
    """
    if not found["gallery"]:
        return Paragraph(words("limp.no-gallery"))
    options: dict[str, list[Trace]] = {}
    rows = {"captured": ("@ink", 2), "character": ("@accent", 1), "healthy": ("@muted", 0)}
    for limp in found["gallery"]:
        hurt = ", ".join(f"{shown_name(link)} {severity:g}" for link, severity in limp["hurt"].items())
        labels = (f"{limp['clip']}, captured", f"the character, {hurt}", "the healthy character")
        for view in ("side", "behind"):
            options[f"{limp['clip']} ({hurt}), from {'the ' * (view == 'side')}{view}"] = [
                *(
                    stick_figures(skeleton, np.array(limp["poses"][key]), colour, view, STRIP_HEIGHT * row)
                    for key, (colour, row) in rows.items()
                ),
                strip_texts(
                    labels, [(1.5 * STRIP_WIDTH, STRIP_HEIGHT * (row + 1) - 12) for row in (2, 1, 0)]
                ),
            ]
    layout = {"xaxis": BARE, "yaxis": {**BARE, "scaleanchor": "x"}}
    return chart("limp-gallery", layout=layout, height=560, choose="Captured limp", options=options)


def size_chart(found: Json) -> Chart:
    """A chart of one effect over severity, with a line for each link, and the means over people.

    The effect is chosen in a menu.
    """
    rows_of_link: dict[str, list[Mapping[str, Any]]] = {}
    for row in found["sizes"]:
        if row["gait"] == "walk" and (row["part"] in COLOURS or "arm" in row["part"]):
            rows_of_link.setdefault(row["link"], []).append(row)

    def line(link: str, rows: Records, effect: str) -> Trace:
        x, y = [r["severity"] for r in rows], [r[effect] for r in rows]
        trace = line_trace(link, x, y, COLOURS.get(rows[0]["part"], "@g0"))
        trace["line"]["dash"] = "dot" if rows[0]["side"] == "right" else "solid"
        return trace

    def people(i: int, gait: str, mean: float, spread: float) -> Trace:
        x = [10.3 + 0.1 * i]  # side by side, to the right of severity 10
        bars = {"type": "data", "array": [spread], "visible": True}
        name = f"people, {gait.replace('_', ' ')}"
        return marker_trace(name, x, [mean], {"color": "@muted", "size": 8}, error_y=bars)

    options = {
        found["effects"][effect]: [
            *(line(link, rows, effect) for link, rows in rows_of_link.items()),
            *(people(i, gait, *sizes[effect]) for i, (gait, sizes) in enumerate(found["people"].items())),
        ]
        for effect in SHOWN_EFFECTS
    }
    layout = {"xaxis": axis("severity", range=[2.5, 11]), "yaxis": axis("size")}
    return chart("limp-sizes", layout=layout, height=560, choose="Effect", options=options)
