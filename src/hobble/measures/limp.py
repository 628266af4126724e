"""The limp that each hurt link causes.

The size of the limp is compared with people's limps. Two recognisers say whether they find the limp. `found`
is the content of limp.json.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import PositiveFloat
from hobble.measures.measure import Cost, Measure, SampleOptions, sample_sentence
from hobble.measures.shown import STRIP_HEIGHT, STRIP_WIDTH, grouped, line, strip, strips, with_spoken_names
from hobble.report import parts
from hobble.runtime import Runtime

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
# The effects in the chart.
SHOWN_EFFECTS = ("speed", "stance", "step_hurt", "knee_hurt", "hip_hurt", "lean", "pelvis_drop", "arm_hurt")
# Part of the body -> colour of its lines in the chart. All other parts, such as arms, have the colour @g0.
COLOURS = {"hip": "@g1", "pelvis": "@g1", "thigh": "@g2", "shank": "@g3", "foot": "@g4", "back": "@g5"}


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """The part of the section on injuries that shows limp.json.

    It has the chart of sizes, the gallery, and all tables.
    """
    if not found.get("applies"):
        return parts.PageSection("injury", [])
    skeleton = material.network["skeleton"]
    found = with_spoken_names(found, skeleton)

    def say(key: str, records: parts.Records) -> parts.Table:
        return parts.told_table(f"{material.name}-limp-{key}", records, f"limp.{key}")

    exam = [{**row, "injury": _injury(row["hurt_links"])} for row in found["held_out_limps"]]
    imitated = [{**row, "walk": _walk_of_people(row)} for row in found["imitated"][1:]]
    content = [
        parts.SectionPart(2, size_chart(found)),
        parts.SectionPart(2, gallery_chart(found, skeleton)),
        parts.SectionPart(3, parts.Paragraph(parts.words("limp.recognisers") + sample_sentence(found))),
        parts.SectionPart(3, say("named", found["named"])),
        parts.SectionPart(3, say("imitated", imitated)),
        parts.SectionPart(3, say("goals", [_goal(row) for row in found["goals"]])),
        parts.SectionPart(4, say("exam", exam)),
    ]
    return parts.PageSection("injury", content)


def _goal(row: Json) -> Json:
    """A row of the table of goals in words and numbers."""
    least, most = ("" if row[key] is None else f"{row[key]:g}" for key in ("least", "most"))
    goal = f"{least} to {most}" if least and most else f"at least {least}" if least else f"at most {most}"
    values = {side: ", ".join(f"{value:.2f}" for value in row[side]) for side in ("right", "left")}
    return {"row": parts.words(f"limp.goals.rows.{row['row']}"), "goal": goal, **values, "met": row["met"]}


def _injury(hurt: Mapping[str, float]) -> str:
    """The hurt links (link -> severity) in words."""
    return ", ".join(f"{link} {severity:g}" for link, severity in hurt.items())


def gallery_chart(found: Json, skeleton: Json) -> parts.Chart | parts.ChartGroup:
    """Captured limps above the character with the same injury and the healthy character, over a gait cycle.

    A menu chooses the limp, and whether it is seen from the side or from behind. Without captured limps, the
    ten people's walks are shown instead.
    """
    if not found["gallery"]:
        return people_charts(found["imitated"])
    options: dict[str, list[parts.Trace]] = {}
    for limp in found["gallery"]:
        hurt = _injury(limp["hurt"])
        rows = (  # from below
            ("healthy", "the healthy character", "@muted"),
            ("character", f"the character, {hurt}", "@accent"),
            ("captured", f"{limp['clip']}, captured", "@ink"),
        )
        for view in ("side", "behind"):
            options[f"{limp['clip']} ({hurt}), from {'the ' * (view == 'side')}{view}"] = [
                trace
                for row, (key, label, colour) in enumerate(rows)
                for trace in strip(
                    skeleton,
                    np.array(limp["poses"][key]),
                    colour,
                    [(label, 1.5 * STRIP_WIDTH, STRIP_HEIGHT - 12)],
                    view,
                    STRIP_HEIGHT * row,
                )
            ]
    return strips("limp-gallery", options, 560, "Captured limp")


def people_charts(walks: parts.Records) -> parts.ChartGroup:
    """Mean curves of the ten people and of the character over a gait cycle. A menu chooses the walk.

    walks: `imitated` of limp.json. Its first row has the normal walks.
    """
    title, caption = (parts.words(f"limp-people.{key}") for key in ("title", "caption"))
    charts = [_people_chart(walks, *panel) for panel in parts.told("limp-people.panels").items()]
    return parts.ChartGroup(charts, "limp-people", title, caption, "Walk")


def _people_chart(walks: parts.Records, curve: str, title: str) -> parts.Chart:
    """One curve, in degrees more than its mean in the own normal walk."""
    usual = walks[0]["curves"]

    def trace(name: str, curves: Json, whose: str, colour: str) -> parts.Trace:
        degrees = np.array(curves[whose][curve]) - np.mean(usual[whose][curve])
        percent = np.linspace(0, 100, len(degrees), endpoint=False).tolist()
        return parts.line_trace(name, percent, degrees.round(1).tolist(), colour)

    options: dict[str, list[parts.Trace]] = {}
    for walk in walks:
        traces = options.setdefault(_walk_of_people(walk), [])
        traces.append(trace("people", walk["curves"], "people", "@ink"))
        if walk["hurt"]:
            traces.append(trace("hurt", walk["curves"], "character", "@accent"))
        traces.append(trace("healthy", usual, "character", "@muted"))
    degrees = [value for traces in options.values() for each in traces for value in each["y"]]
    layout = {
        "xaxis": parts.axis("% of the cycle", dtick=25, range=[0, 100]),
        # The same for all walks, so that a small change looks small.
        "yaxis": {"range": [min(degrees) - 1, max(degrees) + 1]},
        "margin": {"l": 34, "r": 8},  # so that the legend is one line
    }
    return parts.Chart(f"limp-people-{curve}", title, "", (), layout, 240, None, options)


def _walk_of_people(walk: Json) -> str:
    """A walk of the ten people, and what hurts in the character beside it."""
    hurt = f"; hurt: {', '.join(walk['hurt'])}" if walk["hurt"] else ""
    return parts.words(f"limp-people.walks.{walk['gait']}") + hurt


def size_chart(found: Json) -> parts.Chart:
    """A chart of one effect over severity, with a line for each link, and the means over people.

    The effect is chosen in a menu.
    """
    shown = (row for row in found["sizes"] if row["part"] in COLOURS or "arm" in row["part"])
    of_links = grouped([row for row in shown if row["gait"] == "walk"], "link", "part", "side")
    options: dict[str, list[parts.Trace]] = {}
    for effect in SHOWN_EFFECTS:
        traces = options.setdefault(found["effects"][effect], [])
        for (link, part, side), rows in of_links.items():
            dash, colour = "dot" if side == "right" else "solid", COLOURS.get(part, "@g0")
            traces.append(line(link, rows, effect, colour, dash=dash))
        for i, (gait, sizes) in enumerate(found["people"].items()):
            mean, spread = sizes[effect]
            x = [10.3 + 0.1 * i]  # side by side, to the right of severity 10
            bars = {"type": "data", "array": [spread], "visible": True}
            name, marker = f"people, {gait.replace('_', ' ')}", {"color": "@muted", "size": 8}
            traces.append(parts.marker_trace(name, x, [mean], marker, error_y=bars))
    layout = {"xaxis": parts.axis("severity", range=[2.5, 11]), "yaxis": parts.axis("size")}
    return parts.chart("limp-sizes", layout=layout, height=560, choose="Effect", options=options)
