"""Whether moods and diagnoses can be recognised in generated walks, and how they change the walk.

The recogniser is trained on captured clips. A mood or diagnosis is called a manner: a way of walking that
holds for a whole clip. A channel is a group of inputs of the network, such as moods, with a column for each
mood. The measurement covers all channels whose columns are manners (`Channel.manner`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

import numpy as np

from hobble.core.files import Json
from hobble.measures.measure import Cost, Measure, SampleOptions, sample_sentence
from hobble.measures.shown import grouped, with_spoken_names
from hobble.report import parts
from hobble.runtime.options import Runtime

MEASURE = Measure(
    name="manners",
    module=__name__,
    inputs=("weights", "clips", "summaries"),
    options=SampleOptions,
    runtime=tuple(Runtime.model_fields),
    people=True,
    # For each thousand frames: 36 MB and 0.4 s. At least 30 minutes.
    cost=Cost(mb_per_1000_frames=36, seconds_per_1000_frames=0.4, least_minutes=30),
)


NONE = "none"  # what the recogniser calls a walk without a manner
# The bars of each manner: key of an effect -> label, colour. Walks are generated with the values 1 and .5.
BARS = {
    "captured": ("captured", "@muted"),
    "generated": ("generated at 1", "@accent"),
    "generated_at_half": ("generated at .5", "@predicted"),
}


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """For each channel, how often its manners are recognised, and how much they change the walk.

    Empty for a network without manners. found: the content of manners.json.
    """
    if not found.get("applies"):
        return parts.PageSection("manners", [])
    found = with_spoken_names(found, material.network["skeleton"])
    contents: list[parts.Content | None] = []
    for result in found["channels"]:
        effects = grouped(result["effects"], "effect")
        contents += [
            parts.Paragraph(summarise_channel(result) + sample_sentence(found)),
            together_chart(result) if result["together"] else None,
            *(effect_chart(result["channel"], *each) for each in effects.items()),
        ]
    title = " and ".join(result["title"] for result in found["channels"])
    content = [parts.SectionPart(i, each) for i, each in enumerate(contents)]
    return parts.PageSection("manners", content, title=title, order=21)


def summarise_channel(result: Json) -> str:
    """A paragraph: how often the recogniser is right on generated walks, and on walks of people left out."""
    captured = result["captured"]
    alone = [manner for manner, count in captured["people_of"].items() if count < 2]
    return parts.words(
        *("manners.summary", *(["manners.alone"] if alone else [])),
        title=result["title"].lower(),
        right=_percent(result["right_at_1"]),
        captured=_percent(captured["right"]),
        people=captured["people"],
        speed=result["speed_asked"],
        alone=", ".join(alone),
    )


def together_chart(result: Json) -> parts.Chart:
    """How often each manner is recognised while a column of another channel is at its highest value."""
    by_column = grouped(result["together"], "column")
    columns = list(by_column)[::-1]  # plotly puts the first row at the bottom
    manners = [row["manner"] for row in by_column[columns[0]]]
    cells = [[row["share"] for row in by_column[column]] for column in columns]
    trace = parts.heatmap(manners, columns, cells, "%{x} with %{y}: %{z:.0%}<extra></extra>", zmax=1)
    with_manner = [row for row in result["together"] if row["manner"] != NONE]
    right = np.average(
        [row["share"] or 0.0 for row in with_manner], weights=[row["windows"] for row in with_manner]
    )
    layout = {
        "xaxis": {"type": "category", "side": "top", "automargin": True, "showgrid": False},
        "yaxis": {"type": "category", "automargin": True, "dtick": 1, "showgrid": False},
    }
    name, values = (
        f"{result['channel']}-together",
        {"title": result["title"].lower(), "right": _percent(right)},
    )
    return parts.chart(name, [trace], layout, 120 + 20 * len(columns), entry="manners-together", **values)


def effect_chart(channel: str, effect: str, rows: parts.Records) -> parts.Chart:
    """How much each manner changes a quantity, in captured and in generated walks."""
    manners, hover = [row["manner"] for row in rows], "%{x}: %{y:.2f}<extra>%{fullData.name}</extra>"
    traces = [
        parts.bar_trace(label, manners, [row[key] for row in rows], colour, hover)
        for key, (label, colour) in BARS.items()
    ]
    unit = parts.told("manners-effect.units")[effect]
    values = {"entry": "manners-effect", "effect": effect, "title": effect.capitalize(), "unit": unit}
    return parts.chart(f"{channel}-{effect}", traces, {"yaxis": {"title": unit}}, 260, **values)


def _percent(share: float | None) -> str:
    return f"{100 * (share or 0):.0f}\N{NO-BREAK SPACE}%"
