"""Whether moods and diagnoses can be recognised in generated walks, and how they change the walk.

The recogniser is trained on captured clips. A mood or diagnosis is called a manner: a way of walking that
holds for a whole clip. A channel is a group of inputs of the network, such as moods, with a column for each
mood. The measurement covers all channels whose columns are manners (`Channel.manner`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial

from collections.abc import Callable
from typing import Literal

from hobble.channels.shown import shown_names
from hobble.core.files import Json
from hobble.measures.measure import Cost, Measure, SampleOptions, sample_sentence
from hobble.measures.shown import chart
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
UNITS = {  # effect of a manner -> its unit
    "speed": "m/s",
    "stride": "cm",
    "trunk": "° forward",
    "arms": "° of swing",
    "head": "° forward",
}
# The bars of each manner: (key in `Effect`, label, colour). Walks are generated with the values 1 and .5.
BARS: tuple[tuple[Literal["captured", "generated", "generated_at_half"], str, str], ...] = (
    ("captured", "captured", "@muted"),
    ("generated", "generated at 1", "@accent"),
    ("generated_at_half", "generated at .5", "@predicted"),
)


def section(found: Json, material: ReportMaterial) -> parts.PageSection:
    """For each channel, how often its manners are recognised, and how much they change the walk.

    Empty for a network without manners. found: the content of manners.json.
    """
    if not found.get("applies"):
        return parts.PageSection("manners", [])
    content, shown_name = [], shown_names(material.network["skeleton"])
    for i, result in enumerate(found["channels"]):
        charts = [together_chart(result, shown_name), *(effect_chart(result, effect) for effect in UNITS)]
        # The first argument of each part is its place in the section.
        content += [
            parts.SectionPart(10 * i, parts.Paragraph(summarise_channel(result) + sample_sentence(found))),
            *(parts.SectionPart(10 * i + 1 + k, chart) for k, chart in enumerate(charts)),
        ]
    title = " and ".join(result["title"] for result in found["channels"])
    return parts.PageSection("manners", content, title=title, order=21)


def summarise_channel(result: Json) -> str:
    """A paragraph: how often the recogniser is right on generated walks, and on walks of people left out."""
    captured = result["captured"]
    text = (
        f"A recogniser trained on captured clips finds the right {result['title'].lower()} in "
        f"{_percent(result['right_at_1'])} of one-second windows of generated walks with a value of 1, and "
        f"in {_percent(captured['right'])} of the windows of captured clips that it was not trained on "
        f"({captured['people']} clips or people, each left out in turn). All generated walks had the same "
        f"three target speeds around {result['speed_asked']:.2f} m/s."
    )
    if alone := [m for m, count in captured["people_of"].items() if count < 2]:
        text += f" Each of these is shown by only one clip or person: {', '.join(alone)}. "
        text += "While this clip or person is left out, the recogniser has no example to learn from."
    return text


def together_chart(result: Json, shown_name: Callable[[str], str] = str) -> parts.Chart | None:
    """How often each manner is recognised while a column of another channel is at its highest value.

    shown_name: gives the text that the page shows for a column. None if the network has no other channel.
    """
    rows = result["together"]
    if not rows:
        return None
    manners = list(dict.fromkeys(row["manner"] for row in rows))
    columns = list(dict.fromkeys(row["column"] for row in rows))
    labels = [shown_name(column) for column in columns]
    shares = {(row["manner"], row["column"]): row["share"] for row in rows}
    # Plotly puts the first row at the bottom.
    cells = [[shares[m, c] for m in manners] for c in columns[::-1]]
    trace = parts.heatmap(manners, labels[::-1], cells, "%{x} with %{y}: %{z:.0%}<extra></extra>", zmax=1)
    # Numbers of windows with a manner: those that are named right, and all.
    right = sum((row["share"] or 0.0) * row["windows"] for row in rows if row["manner"] != NONE)
    total = sum(row["windows"] for row in rows if row["manner"] != NONE)
    layout = {
        "xaxis": {"type": "category", "side": "top", "automargin": True, "showgrid": False},
        "yaxis": {"type": "category", "automargin": True, "dtick": 1, "showgrid": False},
    }
    height, right = 120 + 20 * len(columns), _percent(right / total)
    name, title = f"{result['channel']}-together", result["title"].lower()
    return chart(name, [trace], layout, height, entry="manners-together", title=title, right=right)


def effect_chart(result: Json, effect: str) -> parts.Chart:
    """How much each manner changes one of the quantities in UNITS, in captured and in generated walks."""
    rows = [row for row in result["effects"] if row["effect"] == effect]
    manners, hover = [row["manner"] for row in rows], "%{x}: %{y:.2f}<extra>%{fullData.name}</extra>"
    traces = [
        parts.bar_trace(label, manners, [row[key] for row in rows], colour, hover)
        for key, label, colour in BARS
    ]
    words = f"Change of {effect} ({UNITS[effect]}) from the neutral walk."
    title = effect.capitalize()
    return parts.Chart(
        f"{result['channel']}-{effect}", title, words, traces, {"yaxis": {"title": UNITS[effect]}}, 260
    )


def _percent(share: float | None) -> str:
    return f"{100 * (share or 0):.0f}\N{NO-BREAK SPACE}%"
